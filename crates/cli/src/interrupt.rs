//! Sets a flag at Ctrl-C. Long computations check it between two steps, write their results so far, and explain how to resume.

use anyhow::{Context, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user has asked this process to stop. The exit code depends on it.
static STOP_REQUESTED: AtomicBool = AtomicBool::new(false);

/// The exit code of a program that was stopped by Ctrl-C.
pub(crate) const EXIT_CODE: u8 = 130;

/// Whether the user has asked to stop, for any listener.
#[must_use]
pub(crate) fn was_requested() -> bool {
    STOP_REQUESTED.load(Ordering::Relaxed)
}

/// Ends the program with [`EXIT_CODE`] at Ctrl-C. It is for work without partial results.
///
/// # Errors
/// If the handler cannot be installed, or there is already one.
pub(crate) fn end_at_once() -> Result<()> {
    ctrlc::set_handler(|| std::process::exit(i32::from(EXIT_CODE))).context("listening for Ctrl-C")
}

/// Set once the user has asked to stop.
#[derive(Clone, Debug, Default)]
pub(crate) struct Interrupt {
    flag: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listens for Ctrl-C and the termination signal. A second signal ends the program at once.
    ///
    /// # Errors
    /// If the handler cannot be installed, or there is already one.
    pub(crate) fn listen() -> Result<Self> {
        let interrupt = Self::default();
        let flag = Arc::clone(&interrupt.flag);
        ctrlc::set_handler(move || {
            STOP_REQUESTED.store(true, Ordering::Relaxed);
            if flag.swap(true, Ordering::Relaxed) {
                std::process::exit(i32::from(EXIT_CODE));
            }
        })
        .context("listening for Ctrl-C")?;
        Ok(interrupt)
    }

    /// Asks to stop, like Ctrl-C. The program then ends with [`EXIT_CODE`].
    pub(crate) fn ask(&self) {
        STOP_REQUESTED.store(true, Ordering::Relaxed);
        self.flag.store(true, Ordering::Relaxed);
    }

    /// Whether the user has asked to stop.
    #[must_use]
    pub(crate) fn is_set(&self) -> bool {
        self.flag.load(Ordering::Relaxed)
    }
}
