//! Signals that end a run: what is finished is kept, and the user is told how to go on.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set by Ctrl-C, and by what else asks a program to end: SIGTERM and SIGHUP, or a console that is closed.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

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
