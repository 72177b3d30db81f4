//! The program `rodsweep`.

use std::process::ExitCode;

fn main() -> ExitCode {
    #[cfg(unix)]
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Without it Mesa complains on the standard error whenever adapters are listed.
        // SAFETY: no other thread has been started yet.
        unsafe { std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir()) };
    }
    ExitCode::from(rodsweep_cli::main_with(std::env::args_os()))
}
