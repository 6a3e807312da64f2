//! Progress on stderr: a bar where a person watches, nothing where stderr is a file.

use indicatif::{ProgressBar, ProgressStyle};

/// A bar over `n_items`, with a word for what is counted.
#[must_use]
pub fn bar(n_items: usize, what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(n_items as u64);
    // The template is a constant; where it ever fails to parse, the bar keeps its plain style.
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:32} {pos}/{len} [{elapsed} < {eta}]") {
        bar.set_style(style);
    }
    bar.with_message(what)
}
