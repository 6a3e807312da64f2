//! Writes files so that they exist completely or not at all.

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

    /// The file or folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Distinguishes the temporary files of this process.
static COUNTER: AtomicU64 = AtomicU64::new(0);

/// Writes the bytes to a file next to `path` and renames it to `path`. A reader sees the old file or the new file.
///
/// # Errors
/// If the folder does not exist, or cannot be written to. No file is left then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// The same for contents that are written piece by piece.
///
/// # Errors
/// If the folder does not exist or cannot be written to, or if `write` fails. No file is left then.
pub fn write_atomically_with<E: Into<Box<dyn Error + Send + Sync>>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), OutputError> {
    let failed = |source| OutputError::new("writing", path, source);
    // A link is kept, and the file that it leads to is replaced.
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    if is_special(&target) {
        return write_through(&target, write).map_err(failed);
    }
    let unfinished = unfinished_name(&target);
    let written = write_and_rename(&unfinished, &target, write);
    if written.is_err() {
        // Only the first error is reported. Removing fails if the file was never made, which does not matter.
        let _ = fs::remove_file(&unfinished);
    }
    written.map_err(failed)
}

/// Whether the path is neither a file nor a folder, but for example a device or a pipe. It must not be replaced by a file.
fn is_special(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir())
}

fn write_through<E: Into<Box<dyn Error + Send + Sync>>>(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), Box<dyn Error + Send + Sync>> {
    let mut file = BufWriter::new(File::options().write(true).open(path)?);
    write(&mut file).map_err(E::into)?;
    Ok(file.flush()?)
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
    fn a_file_is_replaced_completely_and_no_other_file_remains() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write_atomically(&path, b"first").unwrap();
        write_atomically(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        assert!(write_atomically(&folder.path().join("missing/a.json"), b"").is_err());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_are_not_replaced_by_files() {
        use std::os::unix::fs::{FileTypeExt, symlink};

        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (
            folder.path().join("a.json"),
            folder.path().join("link.json"),
        );
        fs::write(&file, b"first").unwrap();
        symlink(&file, &link).unwrap();
        write_atomically(&link, b"second").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"second");

        // This link protects the device itself if the test fails.
        let null = folder.path().join("null");
        symlink("/dev/null", &null).unwrap();
        assert!(is_special(&null));
        write_atomically(&null, b"gone").unwrap();
        let kind = fs::metadata("/dev/null").unwrap().file_type();
        assert!(kind.is_char_device());
    }
}
