//! Signals that end a run: what is finished is kept, and the user is told how to go on.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set by Ctrl-C, and by what else asks a program to end: SIGTERM and SIGHUP, or a console that is closed.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Set by SIGUSR1, and where workers share a run by SIGTERM: finish what was begun, then end.
static DRAINING: AtomicBool = AtomicBool::new(false);

/// From now on SIGUSR1, and SIGTERM if `on_term`, set the flag that is given. A second SIGTERM ends the run at once.
pub fn listen_for_drain(on_term: bool) -> &'static AtomicBool {
    #[cfg(unix)]
    {
        let handler = drain as extern "C" fn(libc::c_int) as libc::sighandler_t;
        // SAFETY: the handler only touches atomics.
        unsafe {
            libc::signal(libc::SIGUSR1, handler);
            if on_term {
                libc::signal(libc::SIGTERM, handler);
            }
        }
    }
    let _ = on_term;
    &DRAINING
}

#[cfg(unix)]
extern "C" fn drain(signal: libc::c_int) {
    if DRAINING.swap(true, Ordering::Relaxed) && signal == libc::SIGTERM {
        INTERRUPTED.store(true, Ordering::Relaxed);
    }
}

/// From now on those signals set the flag that is given, and nothing else.
pub fn listen() -> &'static AtomicBool {
    let stays_ignored = is_hangup_ignored();
    // A second handler cannot be set; then a signal simply ends the program.
    let _ = ctrlc::set_handler(|| INTERRUPTED.store(true, Ordering::Relaxed));
    if stays_ignored {
        ignore_hangup();
    }
    &INTERRUPTED
}

/// A file that may not grow further is then an error of the write that would have made it grow.
#[cfg(unix)]
pub fn outlive_file_limits() {
    // SAFETY: to ignore a signal runs no code of ours.
    unsafe { libc::signal(libc::SIGXFSZ, libc::SIG_IGN) };
}

/// Whether the program was started under `nohup`.
#[cfg(unix)]
fn is_hangup_ignored() -> bool {
    // SAFETY: the action is plain data, and asking for it changes nothing.
    let before = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut action);
        action
    };
    before.sa_sigaction == libc::SIG_IGN
}

#[cfg(unix)]
fn ignore_hangup() {
    // SAFETY: to ignore a signal runs no code of ours.
    unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
}

#[cfg(not(unix))]
pub fn outlive_file_limits() {}

#[cfg(not(unix))]
fn is_hangup_ignored() -> bool {
    false
}

#[cfg(not(unix))]
fn ignore_hangup() {}
