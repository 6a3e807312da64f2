//! Writes files that are there completely or not at all.

use std::error::Error;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A file or folder that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("{doing} {}", path.display())]
pub struct OutputError {
    doing: &'static str,
    path: PathBuf,
    source: Box<dyn Error + Send + Sync>,
}

impl OutputError {
    /// The error of an action such as `writing` or `making the folder`.
    pub fn new(
        doing: &'static str,
        path: &Path,
        source: impl Into<Box<dyn Error + Send + Sync>>,
    ) -> Self {
        Self {
            doing,
            path: path.to_owned(),
            source: source.into(),
        }
    }
}

/// Tells the temporary files of this process apart.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes the bytes next to `path` and renames the file into place: a reader sees the old file or the new one.
///
/// # Errors
/// If the folder does not exist, or cannot be written to; nothing is left behind then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// The same for what is written piece by piece.
///
/// # Errors
/// If the folder does not exist or cannot be written to, or `write` fails; nothing is left behind then.
pub fn write_atomically_with<E: Into<Box<dyn Error + Send + Sync>>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), OutputError> {
    let unfinished = unfinished_name(path);
    let written = write_and_rename(&unfinished, path, write);
    if written.is_err() {
        // The first error is the one to report; a file that was never made cannot be removed either.
        let _ = fs::remove_file(&unfinished);
    }
    written.map_err(|source| OutputError::new("writing", path, source))
}

fn write_and_rename<E: Into<Box<dyn Error + Send + Sync>>>(
    unfinished: &Path,
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut file = BufWriter::new(File::create(unfinished)?);
    write(&mut file).map_err(E::into)?;
    file.flush()?;
    Ok(fs::rename(unfinished, path)?)
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
        assert!(write_atomically(&folder.path().join("missing/a.json"), b"").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
