//! Handles a limit on the size of files (`ulimit -f`, a batch system's quota): a write beyond it gives an error, like a full
//! disk.

/// Prevents the signal of such a write from ending the program without a message.
#[cfg(unix)]
pub(crate) fn report_as_error() {
    // The flag is not read, because the failed write reports the error. If the handler cannot be installed, the system's own
    // behavior remains, and no work is lost yet.
    let flag = std::sync::Arc::default();
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, flag);
}

/// Other systems have no such signal.
#[cfg(not(unix))]
pub(crate) fn report_as_error() {}
