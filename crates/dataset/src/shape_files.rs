//! Writes the files of shapes into a data set, and defines their paths.

use crate::{IndexEntry, OutputError, WrittenFile, write_atomically};
use partprobe_carrier::sha256_hex;
use std::fs;
use std::path::{Path, PathBuf};

/// The kind of a file of a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FileKind {
    /// The carrier.
    Carrier,
    /// Only the labels and the face graph.
    Labels,
    /// The sampled points.
    Points,
}

/// How the files of many shapes are divided among folders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FileLayout {
    /// Carriers are in the folder itself, the other kinds in `labels/` and `points/`.
    #[default]
    Flat,
    /// Each kind has 256 sub-folders, named by the hash of the id. Choose it for more than about a thousand shapes.
    SubFolders,
}

impl FileLayout {
    /// The path of a shape's file, relative to the data set. It depends on nothing but these values.
    #[must_use]
    pub fn path(self, id: &str, kind: FileKind) -> String {
        let folder = match kind {
            FileKind::Carrier => "",
            FileKind::Labels => "labels/",
            FileKind::Points => "points/",
        };
        match self {
            Self::Flat => format!("{folder}{id}.npz"),
            Self::SubFolders => {
                let hash = sha256_hex(id.as_bytes());
                format!("{folder}{}/{id}.npz", &hash[..2])
            }
        }
    }
}

/// Writes the files of shapes into the folder of a data set. Several threads may use it at the same time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShapeFiles {
    root: PathBuf,
    layout: FileLayout,
}

impl ShapeFiles {
    /// The files of the data set in this folder.
    #[must_use]
    pub fn new(root: &Path, layout: FileLayout) -> Self {
        Self {
            root: root.to_owned(),
            layout,
        }
    }

    /// Writes a file of a shape, and enters its path into the line of the shape.
    ///
    /// The id must be a plain file name.
    ///
    /// # Errors
    /// If the file, or the folder that it belongs to, cannot be written.
    pub fn write(
        &self,
        entry: &mut IndexEntry,
        kind: FileKind,
        bytes: &[u8],
    ) -> Result<WrittenFile, OutputError> {
        let file = self.layout.path(&entry.id, kind);
        let path = self.root.join(&file);
        let folder = path.parent().unwrap_or(&self.root);
        fs::create_dir_all(folder)
            .map_err(|error| OutputError::new("making the folder", folder, error))?;
        write_atomically(&path, bytes)?;

        let name = match kind {
            FileKind::Carrier => &mut entry.file,
            FileKind::Labels => &mut entry.labels_file,
            FileKind::Points => &mut entry.points_file,
        };
        *name = Some(file.clone());
        Ok(WrittenFile {
            file,
            bytes: bytes.len() as u64,
        })
    }
}
