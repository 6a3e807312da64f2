//! Makes, checks and empties the output folders of commands.

use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{DatasetWriteError, OutputError, is_unfinished};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

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

/// Refuses a folder that is not empty, because files of two calls in one folder could not be distinguished later. `remedy` says
/// what the user can do.
///
/// # Errors
/// If the folder is not empty, is a file, or cannot be read.
pub(crate) fn ensure_empty(folder: &Path, remedy: &str) -> Result<()> {
    ensure!(
        is_empty(folder)?,
        UsageError(format!("{} is not empty; {remedy}", folder.display()))
    );
    Ok(())
}

/// Whether a folder has no entry, or does not exist.
///
/// # Errors
/// If it is a file, or cannot be read.
pub(crate) fn is_empty(folder: &Path) -> Result<bool> {
    refuse_file(folder)?;
    if !folder.exists() {
        return Ok(true);
    }
    let reading = || format!("reading {}", folder.display());
    let mut entries = fs::read_dir(folder).with_context(reading)?;
    Ok(entries.next().is_none())
}

/// Removes the content of a folder, but neither the folder itself nor the entries `kept`.
///
/// # Errors
/// If something in it cannot be read or removed.
pub(crate) fn remove_content(folder: &Path, kept: &[&Path]) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    for entry in entries {
        let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
        let path = entry.path();
        if kept.contains(&path.as_path()) {
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

/// Refuses to write below a folder that was removed or moved away while its files were written. Otherwise the rest of them would be
/// in a new folder, without a lock and without the others.
///
/// # Errors
/// If there is no such folder.
pub(crate) fn ensure_still_there(folder: &Path) -> Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    let error = io::Error::new(
        io::ErrorKind::NotFound,
        "it was removed or moved while files were written to it",
    );
    Err(OutputError::new("writing to", folder, error).into())
}

/// All files below a folder. Links to folders are not followed.
///
/// # Errors
/// If a folder cannot be read.
pub(crate) fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in
            fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))?
        {
            let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
            if entry.file_type()?.is_dir() {
                open.push(entry.path());
            } else {
                files.push(entry.path());
            }
        }
    }
    Ok(files)
}

/// Removes files that a killed program was writing, from a folder that is known to be the output of a verb. It must be locked.
///
/// # Errors
/// If a folder cannot be read, or a file cannot be removed.
pub(crate) fn remove_unfinished(folder: &Path) -> Result<()> {
    for path in files_below(folder)? {
        if is_unfinished_file(&path) {
            remove_if_there(&path)?;
        }
    }
    Ok(())
}

/// Empties a folder in which a program was killed before it had finished any file. A folder with anything else is left alone. It
/// must be locked.
///
/// # Errors
/// If the folder cannot be read, or a file cannot be removed.
pub(crate) fn remove_if_all_unfinished(folder: &Path) -> Result<()> {
    let reading = || format!("reading {}", folder.display());
    let mut unfinished = Vec::new();
    for entry in fs::read_dir(folder).with_context(reading)? {
        let path = entry.with_context(reading)?.path();
        if !is_unfinished_file(&path) {
            return Ok(());
        }
        unfinished.push(path);
    }
    unfinished.iter().try_for_each(|path| remove_if_there(path))
}

fn is_unfinished_file(path: &Path) -> bool {
    is_unfinished(&path.file_name().unwrap_or_default().to_string_lossy()) && path.is_file()
}

/// Removes a file, unless it is gone already.
///
/// # Errors
/// If it cannot be removed.
pub(crate) fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
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
    fn only_a_folder_of_unfinished_files_is_emptied() {
        let folder = tempfile::tempdir().unwrap();
        let [unfinished, thesis] =
            [".a.npz.1-0.unfinished", "thesis.tex"].map(|name| folder.path().join(name));
        for path in [&unfinished, &thesis] {
            fs::write(path, "").unwrap();
        }
        remove_if_all_unfinished(folder.path()).unwrap();
        assert!(unfinished.is_file() && thesis.is_file());

        fs::remove_file(thesis).unwrap();
        remove_if_all_unfinished(folder.path()).unwrap();
        assert!(is_empty(folder.path()).unwrap());
    }

    #[test]
    fn a_file_is_not_replaced_by_a_folder() {
        let parent = tempfile::tempdir().unwrap();
        let file = parent.path().join("out");
        fs::write(&file, "").unwrap();
        for refused in [make_folder(&file), ensure_empty(&file, "")] {
            let message = refused.unwrap_err().to_string();
            assert!(message.contains("is a file, not a folder"), "{message}");
        }
    }
}
