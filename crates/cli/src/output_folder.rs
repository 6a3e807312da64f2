//! Makes, checks and empties the folders that a command writes to.

use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{DatasetWriteError, OutputError};
use std::fs;
use std::path::Path;

/// Whether an error says that something could not be written: no shape is to blame, and the work ends.
#[must_use]
pub(crate) fn is_output_error(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let written = cause.downcast_ref();
        cause.is::<OutputError>() || matches!(written, Some(DatasetWriteError::Output(_)))
    })
}

/// Makes a folder and those above it, unless it is there.
///
/// # Errors
/// If it cannot be made; the error is an [`OutputError`], unless there is a file of that name.
pub(crate) fn make_folder(path: &Path) -> Result<()> {
    refuse_file(path)?;
    fs::create_dir_all(path).map_err(|error| OutputError::new("making the folder", path, error))?;
    Ok(())
}

fn refuse_file(folder: &Path) -> Result<()> {
    ensure!(
        folder.is_dir() || !folder.exists(),
        UsageError(format!(
            "{} is a file, not a folder; choose another --out",
            folder.display()
        ))
    );
    Ok(())
}

/// Refuses a folder that holds something: files of two calls in one folder cannot be told apart later.
///
/// # Errors
/// If the folder is not empty, is a file, or cannot be read.
pub(crate) fn ensure_empty(folder: &Path) -> Result<()> {
    refuse_file(folder)?;
    let is_empty = !folder.exists()
        || fs::read_dir(folder)
            .with_context(|| format!("reading {}", folder.display()))?
            .next()
            .is_none();
    ensure!(
        is_empty,
        UsageError(format!(
            "{} is not empty; choose another --out",
            folder.display()
        ))
    );
    Ok(())
}

/// Removes all that a folder holds, and leaves the folder itself.
///
/// # Errors
/// If something in it cannot be read or removed.
pub(crate) fn remove_content(folder: &Path) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    for entry in entries {
        let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
        let path = entry.path();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let removed = if is_folder {
            fs::remove_dir_all(&path)
        } else {
            fs::remove_file(&path)
        };
        removed.with_context(|| format!("removing {}", path.display()))?;
    }
    Ok(())
}
