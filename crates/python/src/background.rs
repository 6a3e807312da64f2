//! Computes on a thread of its own, so that Python runs on and Ctrl-C is heard.
//!
//! A computation goes in, and its result comes out. If the user interrupts, the caller gets `KeyboardInterrupt` at once.
//! The thread cannot be stopped: it ends when its computation does, and its result is dropped.

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

/// How often signals are looked at.
const POLL: Duration = Duration::from_millis(50);
/// Reading a STEP file may recurse deeply; a worker of `partprobe label` has the same stack.
const STACK_BYTES: usize = 64 << 20;

/// Runs a computation without the interpreter's lock.
///
/// # Errors
/// If the user interrupts, the system gives no thread, or the computation panics.
pub(crate) fn compute<T: Send + 'static>(
    py: Python<'_>,
    computation: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = mpsc::channel();
    let run = move || {
        // Nobody listens after an interrupt.
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
