//! Files that are there whole or not at all.

use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A file or folder that could not be written; no shape is to blame for it, and the work ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputError {
    doing: &'static str,
    path: PathBuf,
}

impl OutputError {
    /// Whether an error says that something could not be written.
    #[must_use]
    pub fn is_in(error: &anyhow::Error) -> bool {
        error.is::<Self>()
    }
}

impl std::fmt::Display for OutputError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.doing, self.path.display())
    }
}

/// Makes a folder and those above it, unless it is there.
///
/// # Errors
/// If it cannot be made; the error is an [`OutputError`], but for a file that stands there.
pub fn make_folder(path: &Path) -> Result<()> {
    refuse_file(path)?;
    fs::create_dir_all(path).with_context(|| OutputError {
        doing: "making the folder",
        path: path.to_owned(),
    })
}

/// Tells the temporary files of this process apart.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes the bytes beside `path` and renames the file into place: a reader sees the old file or the new one.
///
/// # Errors
/// If the folder does not exist, or cannot be written to; the error is an [`OutputError`], and nothing is left behind.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically_with(path, |file| Ok(file.write_all(bytes)?))
}

/// The same for what is written piece by piece.
///
/// # Errors
/// If the folder does not exist or cannot be written to, or `write` fails; nothing is left behind then.
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<()> {
    let unfinished = unfinished_name(path);
    let written = File::create(&unfinished)
        .map_err(anyhow::Error::from)
        .and_then(|file| {
            let mut file = BufWriter::new(file);
            write(&mut file)?;
            file.flush()?;
            Ok(fs::rename(&unfinished, path)?)
        });
    if written.is_err() {
        // The first error is the one to report; a file that was never made cannot be removed either.
        let _ = fs::remove_file(&unfinished);
    }
    written.with_context(|| OutputError {
        doing: "writing",
        path: path.to_owned(),
    })
}

fn unfinished_name(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    path.with_file_name(format!(
        ".{name}.{}-{number}.unfinished",
        std::process::id()
    ))
}

/// Whether a name is that of a file that [`write_atomically`] did not finish.
#[must_use]
pub fn is_unfinished(name: &str) -> bool {
    name.starts_with('.') && name.ends_with(".unfinished")
}

fn refuse_file(folder: &Path) -> Result<()> {
    ensure!(
        !folder.is_file(),
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
pub fn ensure_empty(folder: &Path) -> Result<()> {
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
pub fn remove_content(folder: &Path) -> Result<()> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_and_nothing_else_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write_atomically(&path, b"first").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        let error = write_atomically(&folder.path().join("missing/a.json"), b"")
            .context("outer")
            .unwrap_err();
        assert!(OutputError::is_in(&error));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
