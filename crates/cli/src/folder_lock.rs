//! Locks a folder to which a verb writes: while one program has the lock, no other one writes there or replaces the folder.
//!
//! The folder itself is locked, and not a file in it, so nothing is left behind. The lock ends with its program.

use crate::usage::UsageError;
use anyhow::{Result, bail};
use partprobe_dataset::is_locked_elsewhere;
use std::fs::File;
use std::path::Path;

/// A folder to which no other program writes as long as this value exists.
#[derive(Debug)]
pub(crate) struct FolderLock {
    /// `None` if folders cannot be opened: on some network drives, and on Windows.
    _folder: Option<File>,
}

impl FolderLock {
    /// Locks an existing folder. `doing` describes in an error what the other program does there, for example `exporting into`.
    ///
    /// # Errors
    /// If another program holds the lock.
    pub(crate) fn take(folder: &Path, doing: &str) -> Result<Self> {
        let folder_file = File::open(folder).ok();
        if folder_file.as_ref().is_some_and(is_locked_elsewhere) {
            bail!(UsageError(format!(
                "another partprobe is {doing} {}; wait until it ends, or choose another --out",
                folder.display()
            )));
        }
        Ok(Self {
            _folder: folder_file,
        })
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_folder_has_one_lock_holder_and_keeps_no_lock_file() {
        let folder = tempfile::tempdir().unwrap();
        let first = FolderLock::take(folder.path(), "exporting into").unwrap();
        let message = FolderLock::take(folder.path(), "exporting into").unwrap_err();
        assert!(
            message.is::<UsageError>()
                && message
                    .to_string()
                    .contains("another partprobe is exporting into"),
            "{message}"
        );
        drop(first);
        assert!(FolderLock::take(folder.path(), "exporting into").is_ok());
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
