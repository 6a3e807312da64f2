//! Makes, checks and empties the output folders of commands.

use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{DatasetWriteError, OutputError};
use std::fs;
use std::path::Path;

/// Whether an error says that something could not be written. Such an error is not caused by a shape, and ends the work.
#[must_use]
pub(crate) fn is_output_error(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        let written = cause.downcast_ref();
        cause.is::<OutputError>() || matches!(written, Some(DatasetWriteError::Output(_)))
    })
}

/// Makes a folder and those above it, unless it exists.
///
/// # Errors
/// If it cannot be made. The error is an [`OutputError`], unless there is a file with this name.
pub(crate) fn make_folder(path: &Path) -> Result<()> {
    refuse_file(path)?;
    fs::create_dir_all(path).map_err(|error| OutputError::new("making the folder", path, error))?;
    Ok(())
}

fn refuse_file(folder: &Path) -> Result<()> {
    // One question to the system: between two, another thread may make the folder.
    let is_file = fs::metadata(folder).is_ok_and(|found| !found.is_dir());
    ensure!(
        !is_file,
        UsageError(format!(
            "{} is a file, not a folder; choose another --out",
            folder.display()
        ))
    );
    Ok(())
}

/// Refuses a folder that is not empty, because files of two calls in one folder could not be distinguished later.
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

/// Removes the content of a folder, but neither the folder itself nor the entry `kept`.
///
/// # Errors
/// If something in it cannot be read or removed.
pub(crate) fn remove_content(folder: &Path, kept: Option<&Path>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    for entry in entries {
        let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
        let path = entry.path();
        if kept == Some(&path) {
            continue;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;
    use std::thread;

    #[test]
    fn several_threads_may_make_one_folder() {
        let parent = tempfile::tempdir().unwrap();
        for n in 0..200 {
            let folder = parent.path().join(n.to_string());
            let start = Barrier::new(4);
            let make = || {
                start.wait();
                make_folder(&folder)
            };
            thread::scope(|scope| {
                for made in [(); 4].map(|()| scope.spawn(make)) {
                    made.join().unwrap().unwrap();
                }
            });
        }
    }

    #[test]
    fn a_file_is_not_replaced_by_a_folder() {
        let parent = tempfile::tempdir().unwrap();
        let file = parent.path().join("out");
        fs::write(&file, "").unwrap();
        for refused in [make_folder(&file), ensure_empty(&file)] {
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("is a file, not a folder"), "{message}");
        }
    }
}
