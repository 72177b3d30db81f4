//! The command line.

mod cli;

fn main() -> std::process::ExitCode {
    #[cfg(unix)]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Without it Mesa complains on the standard error whenever adapters are listed.
        // SAFETY: no other thread has been started yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    cli::main()
}
