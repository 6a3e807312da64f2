//! Locks a file or folder for this program.

use std::fs::{File, TryLockError};

/// Locks an open file or folder, and returns whether another program has already locked it.
///
/// The lock ends with the value `file`. Some file systems have no locks. On these, work continues without one.
#[must_use]
pub fn is_locked_elsewhere(file: &File) -> bool {
    matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}
