//! Shows progress on stderr: a bar if stderr is a terminal, plain lines if it is a file, and nothing after `--quiet`.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether `--quiet` was given. It is set once, before any work.
static IS_QUIET: AtomicBool = AtomicBool::new(false);

/// Shows no bars and no notes from now on, but still warnings.
pub(crate) fn be_quiet() {
    IS_QUIET.store(true, Ordering::Relaxed);
}

/// The output of progress.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Progress;

impl Progress {
    /// Shows bars if stderr is a terminal. Notes are always printed.
    #[must_use]
    pub(crate) fn on_terminal() -> Self {
        Self
    }

    /// A bar over `n_items`. It disappears when it is finished or dropped.
    #[must_use]
    pub(crate) fn bar(&self, what: &str, n_items: usize) -> ProgressBar {
        let target = if IS_QUIET.load(Ordering::Relaxed) {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(n_items as u64), target);
        // The template is a constant. If it could not be parsed, the bar would keep its plain style.
        if let Ok(style) =
            ProgressStyle::with_template("{msg} {bar:32} {pos}/{len} [{elapsed} < {eta}]")
        {
            bar.set_style(style);
        }
        bar.with_message(what.to_owned())
            .with_finish(indicatif::ProgressFinish::AndClear)
    }

    /// Prints a line. After `--quiet`, it must begin with `warning:`.
    pub(crate) fn note(&self, line: &str) {
        if line.starts_with("warning:") || !IS_QUIET.load(Ordering::Relaxed) {
            crate::stderr::print_line(line);
        }
    }
}
