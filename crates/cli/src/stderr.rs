//! Prints warnings and errors on stderr, where the reader may have gone away.

use std::fmt::Display;
use std::io::{self, Write};

/// Prints one line; one that cannot be written does not end the work.
pub(crate) fn print_line(text: impl Display) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}
