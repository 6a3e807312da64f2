//! Computes on a separate thread, so that Python keeps running and reacts to Ctrl-C.
//!
//! If the user interrupts, the caller gets `KeyboardInterrupt` at once. The thread cannot be stopped: it ends when its
//! computation ends, and the result is dropped.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// The interval at which signals are checked.
const POLL: Duration = Duration::from_millis(50);
/// The size of the stack. Reading a STEP file may recurse deeply, and a worker of `partprobe label` has the same stack.
const STACK_BYTES: usize = 64 << 20;

/// Runs a computation without the interpreter's lock.
///
/// # Errors
/// If the user interrupts, the system cannot start a thread, or the computation panics.
pub(crate) fn compute<T: Send + 'static>(
    py: Python<'_>,
    computation: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = mpsc::channel();
    let run = move || {
        // The receiver may be gone after an interrupt.
        let _ = sender.send(computation());
    };
    thread::Builder::new().stack_size(STACK_BYTES).spawn(run)?;
    py.detach(move || {
        loop {
            match receiver.recv_timeout(POLL) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err(
                        "partprobe has a defect, whose message is on stderr; please report it with the input that shows it",
                    ));
                }
            }
        }
    })
}
