//! Prints warnings and errors on stderr, also if its reader has ended.

use std::fmt::Display;
use std::io::{self, Write};

/// Prints one line. If it cannot be written, the work still continues.
pub(crate) fn print_line(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}
