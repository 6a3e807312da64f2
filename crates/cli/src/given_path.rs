//! Refuses a path of the command line that does not exist, or that the system does not allow to access, and tells whether two
//! paths are one.

use crate::standard_input::is_standard_input;
use crate::usage::UsageError;
use std::path::Path;

/// Checks that a path exists.
///
/// # Errors
/// If it does not exist, or if the system cannot determine it, for example without the permission to search a folder above it.
/// Then the message contains the error of the system.
pub(crate) fn ensure_exists(path: &Path) -> Result<(), UsageError> {
    let name = path.display();
    match path.try_exists() {
        Ok(true) => Ok(()),
        Ok(false) if is_standard_input(path) => Err(UsageError(
            "`-` is the standard input, and this argument is a file or a folder; store it in a file first"
                .to_owned(),
        )),
        Ok(false) => Err(UsageError(format!("{name} does not exist"))),
        Err(error) => Err(UsageError(format!("{name}: {error}"))),
    }
}

/// Whether two paths lead to one file or folder, which exists.
pub(crate) fn are_same_path(one: &Path, other: &Path) -> bool {
    matches!((one.canonicalize(), other.canonicalize()), (Ok(one), Ok(other)) if one == other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_missing_path_is_distinguished_from_an_unreadable_one() {
        let folder = tempfile::tempdir().unwrap();
        let reason = |name: &str| ensure_exists(&folder.path().join(name)).unwrap_err().0;
        assert_eq!(ensure_exists(folder.path()), Ok(()));
        assert!(reason("gone").ends_with("gone does not exist"));
        let dash = ensure_exists(Path::new("-")).unwrap_err().0;
        assert!(dash.starts_with("`-` is the standard input"), "{dash}");
        // The system refuses a name of this length, as it refuses a folder without permission.
        let long = reason(&"x".repeat(4000));
        assert!(!long.contains("does not exist"), "{long}");
    }
}
