//! Unpacks the text of a STEP file, on disk or in memory, within the limit of bytes.

use super::over_budget::{OVER_MEMORY, OverBudget, too_large};
use anyhow::{Context, Result, bail, ensure};
use partprobe_formats::{UnpackError, unpacked_step};
use std::fs::{self, Metadata};
use std::io::ErrorKind;
use std::path::Path;

/// Reads a file and unpacks it, unless it is larger than `max_bytes`, packed or not.
///
/// # Errors
/// If the path is not a file, it cannot be read, it is too large, or its container is damaged.
pub(crate) fn step_text(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    unpacked(file_bytes(path, max_bytes)?, max_bytes)
}

/// The beginning of a STEP file.
const STEP_HEADER: &[u8] = b"ISO-10303-21";

/// Whether the beginning of a file has the header of a STEP file.
pub(super) fn begins_as_step(start: &[u8]) -> bool {
    start
        .windows(STEP_HEADER.len())
        .any(|window| window.eq_ignore_ascii_case(STEP_HEADER))
}

/// Reads a file without unpacking it, unless it is larger than `max_bytes`.
///
/// # Errors
/// If the path is not a file, it cannot be read, or it is too large.
pub(super) fn file_bytes(path: &Path, max_bytes: u64) -> Result<Vec<u8>> {
    // A path from a list may not exist. The message does not contain the path, because the index must be the same on any machine.
    let metadata = fs::metadata(path).context("opening the file")?;
    if let Some(kind) = special_kind(&metadata) {
        bail!("it is {kind}, not a file");
    }
    ensure!(
        metadata.len() <= max_bytes,
        OverBudget(too_large(max_bytes))
    );
    fs::read(path).map_err(|error| match error.kind() {
        ErrorKind::OutOfMemory => anyhow::Error::from(OverBudget(OVER_MEMORY.to_owned())),
        _ => anyhow::Error::from(error).context("reading the file"),
    })
}

/// The text of a STEP file's bytes, unless it is larger than `max_bytes`.
///
/// # Errors
/// If it is larger, or its container is damaged.
pub(super) fn unpacked(bytes: Vec<u8>, max_bytes: u64) -> Result<Vec<u8>> {
    unpacked_step(bytes, max_bytes).map_err(|error| match error {
        UnpackError::TooLarge { limit } => OverBudget(too_large(limit)).into(),
        error => error.into(),
    })
}

/// The kind of a path that is not a file. Returns `None` for files.
pub(super) fn special_kind(metadata: &Metadata) -> Option<&'static str> {
    let kind = metadata.file_type();
    if kind.is_file() {
        None
    } else if kind.is_dir() {
        Some("a folder")
    } else {
        Some(special_name(kind))
    }
}

#[cfg(unix)]
fn special_name(kind: fs::FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_fifo() {
        "a named pipe"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_block_device() || kind.is_char_device() {
        "a device"
    } else {
        "a special file"
    }
}

#[cfg(not(unix))]
fn special_name(_: fs::FileType) -> &'static str {
    "a special file"
}
