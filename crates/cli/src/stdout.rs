//! Prints results on stdout, whose reader may have ended (`partprobe inspect … | head`).
//!
//! Tables are Markdown. They are printed without changes into a pipe or a file, and aligned on a terminal.

use crate::aligned_tables::aligned;
use anyhow::{Context, Result};
use std::fmt::Display;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;

/// The requested form. It is set once, before any work.
static FORM: OnceLock<TableForm> = OnceLock::new();

/// How tables are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum TableForm {
    /// Aligned columns.
    Text,
    /// Markdown.
    Markdown,
}

/// Prints all tables in this form from now on, for any kind of stdout.
pub(crate) fn print_tables_as(form: TableForm) {
    // It was not set before, because the arguments are read once.
    let _ = FORM.set(form);
}

/// Prints a text with Markdown tables, and a line break.
///
/// # Errors
/// As for [`print_line`].
pub(crate) fn print_tables(markdown: impl Display) -> Result<()> {
    let by_place = || {
        if io::stdout().is_terminal() {
            TableForm::Text
        } else {
            TableForm::Markdown
        }
    };
    match *FORM.get_or_init(by_place) {
        TableForm::Text => {
            let width = terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
            print_line(aligned(&markdown.to_string(), width))
        }
        TableForm::Markdown => print_line(markdown),
    }
}

/// Prints a text with Markdown tables, as the result of work that continues even if stdout is no longer read.
///
/// # Errors
/// As for [`print_result`].
pub(crate) fn print_result_tables(markdown: impl Display) -> Result<()> {
    ignore_closed_pipe(print_tables(markdown))
}

/// Prints one result and a line break.
///
/// # Errors
/// If stdout cannot be written to. [`is_closed`] distinguishes a reader that has ended from a full disk.
pub(crate) fn print_line(text: impl Display) -> Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")
        .and_then(|()| out.flush())
        .context("writing to stdout")
}

/// Whether an error says that the results are no longer read, which is not a failure of the program.
#[must_use]
pub(crate) fn is_closed(error: &anyhow::Error) -> bool {
    let is_pipe = |cause: &(dyn std::error::Error + 'static)| {
        cause
            .downcast_ref::<io::Error>()
            .is_some_and(|error| error.kind() == ErrorKind::BrokenPipe)
    };
    error.chain().any(is_pipe)
}

/// Prints one result of work that continues even if stdout is no longer read.
///
/// # Errors
/// If stdout cannot be written to for another reason than that its reader has ended.
pub(crate) fn print_result(text: impl Display) -> Result<()> {
    ignore_closed_pipe(print_line(text))
}

fn ignore_closed_pipe(printed: Result<()>) -> Result<()> {
    printed.or_else(|error| {
        if is_closed(&error) {
            Ok(())
        } else {
            Err(error)
        }
    })
}
