//! Prints results on stdout, where the reader may have gone away (`partprobe inspect … | head`).

use anyhow::{Context, Result};
use std::fmt::Display;
use std::io::{self, ErrorKind, Write};

/// Prints one result and a line break.
///
/// # Errors
/// If stdout cannot be written to; [`is_closed`] tells a reader that has gone away from a full disk.
pub(crate) fn print_line(text: impl Display) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")
        .and_then(|()| out.flush())
        .context("writing to stdout")
}

/// Whether an error says that nobody reads the results any more, which is no failure of ours.
#[must_use]
pub(crate) fn is_closed(error: &anyhow::Error) -> bool {
    let is_pipe = |cause: &(dyn std::error::Error + 'static)| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
    };
    error.chain().any(is_pipe)
}

/// Prints one result of work that goes on whether or not somebody reads it.
///
/// # Errors
/// If stdout cannot be written to for another reason than that its reader has gone away.
pub(crate) fn print_result(text: impl Display) -> Result<()> {
    print_line(text).or_else(|error| {
        if is_closed(&error) {
            Ok(())
        } else {
            Err(error)
        }
    })
}
