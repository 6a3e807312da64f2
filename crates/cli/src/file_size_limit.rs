//! Turns a limit on the size of files (`ulimit -f`, a batch system's quota) into an error: a write beyond it is like a
//! full disk.

/// Keeps the signal that comes with such a write from ending the program without a word.
#[cfg(unix)]
pub(crate) fn report_as_error() {
    // Nobody reads the flag: the write that failed says what happened. A handler that cannot be installed leaves the
    // system's own behavior, and no work has begun that could be lost.
    let flag = std::sync::Arc::default();
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, flag);
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub(crate) fn report_as_error() {}
