//! The lock on a folder that a verb writes: while one program holds it, no other one writes there, or replaces the folder.
//!
//! The folder itself is locked, not a file in it, so that nothing is left behind. The lock goes with its program.

use crate::usage::UsageError;
use anyhow::{Result, bail};
use std::fs::{File, TryLockError};
use std::path::Path;

/// A folder that no other program writes to as long as this value lives.
#[derive(Debug)]
pub(crate) struct FolderLock {
    /// `None` where folders cannot be locked: on some network drives, and on Windows.
    _folder: Option<File>,
}

impl FolderLock {
    /// Locks a folder that exists; `doing` says in an error what the other program does there, for example `exporting into`.
    ///
    /// # Errors
    /// If another program holds the lock.
    pub(crate) fn take(folder: &Path, doing: &str) -> Result<Self> {
        let Ok(opened) = File::open(folder) else {
            return Ok(Self { _folder: None });
        };
        let refused = || {
            format!(
                "another partprobe is {doing} {}; wait until it ends, or choose another --out",
                folder.display()
            )
        };
        let is_locked = lock(&opened, refused)?;
        Ok(Self {
            _folder: is_locked.then_some(opened),
        })
    }
}

/// Locks an open file or folder for this program. Returns whether it is locked: file systems without locks exist, and
/// work goes on there all the same.
///
/// # Errors
/// If another program holds the lock; `refused` gives the message.
pub(crate) fn lock(file: &File, refused: impl FnOnce() -> String) -> Result<bool> {
    match file.try_lock() {
        Ok(()) => Ok(true),
        Err(TryLockError::WouldBlock) => bail!(UsageError(refused())),
        Err(TryLockError::Error(_)) => Ok(false),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_holder_and_keeps_no_trace_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let first = FolderLock::take(folder.path(), "exporting into").unwrap();
        let told = FolderLock::take(folder.path(), "exporting into").unwrap_err();
        assert!(
            told.is::<UsageError>()
                && told
                    .to_string()
                    .contains("another partprobe is exporting into"),
            "{told}"
        );
        drop(first);
        assert!(FolderLock::take(folder.path(), "exporting into").is_ok());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
