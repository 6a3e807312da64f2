//! Refuses a path of the command line that does not exist, or that the system does not allow to access, and finds paths that are
//! given twice.

use crate::standard_input::is_standard_input;
use crate::usage::UsageError;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::fs;
use std::path::{Path, PathBuf};

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

/// Paths without those that name the same entry of a folder as an earlier one, and the earlier ones of these. A link is an entry of
/// its own.
pub(crate) fn distinct_paths(paths: &[PathBuf]) -> (Vec<PathBuf>, Vec<PathBuf>) {
    let mut folders = BTreeMap::new();
    let mut first_of: BTreeMap<PathBuf, &PathBuf> = BTreeMap::new();
    let (mut distinct, mut repeated) = (Vec::new(), Vec::new());
    for path in paths {
        match first_of.entry(entry_of(path, &mut folders)) {
            Entry::Occupied(first) => repeated.push((*first.get()).clone()),
            Entry::Vacant(place) => {
                place.insert(path);
                distinct.push(path.clone());
            }
        }
    }
    (distinct, repeated)
}

/// The entry of a folder that a path names: the true path of the folder, and the name in it.
pub(crate) fn entry_of(path: &Path, folders: &mut BTreeMap<PathBuf, PathBuf>) -> PathBuf {
    let Some(name) = path.file_name() else {
        return path.to_owned();
    };
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
        .unwrap_or(Path::new("."));
    let true_folder =
        |folder: &Path| fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    folders
        .entry(folder.to_owned())
        .or_insert_with(|| true_folder(folder))
        .join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_counts_once() {
        let folder = tempfile::tempdir().unwrap();
        let [here, again, gone] = ["a", "./a", "gone"].map(|name| folder.path().join(name));
        let given = [here.clone(), gone.clone(), again, gone.clone()];
        let (distinct, repeated) = distinct_paths(&given);
        assert_eq!(distinct, [here.clone(), gone.clone()]);
        assert_eq!(repeated, [here.clone(), gone]);

        #[cfg(unix)]
        {
            std::fs::write(&here, "").unwrap();
            let link = folder.path().join("link");
            std::os::unix::fs::symlink(&here, &link).unwrap();
            let given = [here, link];
            assert_eq!(distinct_paths(&given), (given.to_vec(), Vec::new()));
        }
    }

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
