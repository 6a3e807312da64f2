//! Reads files for label sources, which open none themselves.

use partprobe_sources::{FileError, PathKind, SourceFiles};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file system of this machine. Relative paths begin at the folder in which the program was started.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DiskFiles;

impl SourceFiles for DiskFiles {
    fn kind(&self, path: &str) -> PathKind {
        match fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => PathKind::Folder,
            Ok(_) => PathKind::File,
            // Reading it gives the system's error.
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => PathKind::File,
            Err(_) => PathKind::Missing,
        }
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        fs::read(path).map_err(|error| file_error(Path::new(path), &error))
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, FileError> {
        let root = Path::new(folder);
        let mut files = Vec::new();
        let mut open: Vec<PathBuf> = vec![root.to_owned()];
        while let Some(folder) = open.pop() {
            let in_folder = |error: std::io::Error| file_error(&folder, &error);
            for entry in fs::read_dir(&folder).map_err(in_folder)? {
                let entry = entry.map_err(in_folder)?;
                // A link to a folder is not followed, because it may lead back.
                if entry.file_type().map_err(in_folder)?.is_dir() {
                    open.push(entry.path());
                } else {
                    files.push(entry.path());
                }
            }
        }
        let below = files.iter().filter_map(|file| file.strip_prefix(root).ok());
        let mut names: Vec<String> = below.map(with_slashes).collect();
        names.sort();
        Ok(names)
    }
}

fn with_slashes(path: &Path) -> String {
    let names = path
        .components()
        .map(|name| name.as_os_str().to_string_lossy());
    names.collect::<Vec<_>>().join("/")
}

fn file_error(path: &Path, error: &std::io::Error) -> FileError {
    FileError {
        path: path.display().to_string(),
        reason: error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_listed_to_the_bottom_and_sorted() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir_all(folder.path().join("b/c")).unwrap();
        for name in ["z.seg", "b/c/a.seg", "b/a.seg"] {
            fs::write(folder.path().join(name), name).unwrap();
        }
        let root = folder.path().to_str().unwrap();
        assert_eq!(
            DiskFiles.list(root).unwrap(),
            ["b/a.seg", "b/c/a.seg", "z.seg"]
        );
        assert_eq!(DiskFiles.kind(root), PathKind::Folder);
        assert_eq!(DiskFiles.kind(&format!("{root}/z.seg")), PathKind::File);

        let missing = format!("{root}/y.seg");
        assert_eq!(DiskFiles.kind(&missing), PathKind::Missing);
        let error = DiskFiles.read(&missing).unwrap_err();
        assert!(error.to_string().starts_with(&missing), "{error}");
    }
}
