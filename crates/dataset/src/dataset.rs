//! Opens a data set: the lines of its index, and the carrier of each shape.

use crate::{CarrierRef, DamagedCarrier, FileRecord, IndexEntry, JOURNAL_FILE, WrittenFile};
use partprobe_carrier::Carrier;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

/// The file that lists the shapes. A folder without it is not a data set.
pub const INDEX_FILE: &str = "index.jsonl";
/// The file with the settings that determine the contents of a data set.
pub const SETTINGS_FILE: &str = "dataset.json";

/// The reason why a data set, or a shape of it, cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The data set was labeled without carriers.
    #[error("{} holds no carriers; label again with --emit carrier", .0.display())]
    NoCarriers(PathBuf),
    /// There is a journal but no index.
    #[error("{} is not finished; continue with `partprobe label … --resume`", .0.display())]
    Unfinished(PathBuf),
    /// There is no index, or no folder.
    #[error("{} is not a data set; make one with `partprobe label`", .0.display())]
    NotADataset(PathBuf),
    /// The index cannot be read.
    #[error("reading {}", path.display())]
    Unreadable {
        /// The index.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// A line of the index does not describe a shape.
    #[error("{}, line {line}", path.display())]
    DamagedLine {
        /// The index.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// The shape with this id has no carrier.
    #[error("shape {0} has no carrier")]
    NoCarrier(String),
    /// The index names a file that is not below the data set.
    #[error("shape {id}: `{file}` points outside the data set")]
    OutsidePath {
        /// The shape.
        id: String,
        /// The path in the index.
        file: String,
    },
    /// A carrier is not the one that was labeled.
    #[error(transparent)]
    Damaged(#[from] DamagedCarrier),
}

impl DatasetError {
    /// Whether the caller gave the wrong folder: it is not a data set, is unfinished, or has no carriers.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        matches!(
            self,
            Self::NoCarriers(_) | Self::Unfinished(_) | Self::NotADataset(_)
        )
    }
}

/// A data set that was opened.
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    root: PathBuf,
    entries: Vec<IndexEntry>,
}

impl Dataset {
    /// The folder.
    #[must_use]
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Whether the folder is a data set with an index.
    #[must_use]
    pub fn is_at(path: &Path) -> bool {
        path.join(INDEX_FILE).is_file()
    }

    /// Reads the index of a data set whose shapes have carriers.
    ///
    /// # Errors
    /// If the folder is not a data set, a line of its index is damaged, or it was labeled without carriers.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let dataset = Self::open_any(path)?;
        let is_bare = |entry: &IndexEntry| entry.file.is_none() && entry.files().next().is_some();
        if dataset.entries.iter().any(is_bare) {
            return Err(DatasetError::NoCarriers(path.to_owned()));
        }
        Ok(dataset)
    }

    /// Reads the index. The data set need not have carriers.
    ///
    /// # Errors
    /// If the folder is not a data set, or a line of its index is damaged.
    pub fn open_any(path: &Path) -> Result<Self, DatasetError> {
        let index = path.join(INDEX_FILE);
        if !index.exists() && path.join(JOURNAL_FILE).exists() {
            return Err(DatasetError::Unfinished(path.to_owned()));
        }
        let unreadable = |source: io::Error| match source.kind() {
            io::ErrorKind::NotFound | io::ErrorKind::NotADirectory => {
                DatasetError::NotADataset(path.to_owned())
            }
            _ => DatasetError::Unreadable {
                path: index.clone(),
                source,
            },
        };
        let text = fs::read_to_string(&index).map_err(unreadable)?;
        let parse = |(index_of_line, line): (usize, &str)| {
            serde_json::from_str(line).map_err(|source| DatasetError::DamagedLine {
                path: index.clone(),
                line: index_of_line + 1,
                source,
            })
        };
        let entries = text
            .lines()
            .enumerate()
            .map(parse)
            .collect::<Result<_, _>>()?;
        Ok(Self {
            root: path.to_owned(),
            entries,
        })
    }

    /// Every line of the index, in its order.
    #[must_use]
    pub fn entries(&self) -> &[IndexEntry] {
        &self.entries
    }

    /// The shapes that have a carrier, in the order of the index.
    #[must_use]
    pub fn labeled(&self) -> Vec<&IndexEntry> {
        self.entries
            .iter()
            .filter(|entry| entry.file.is_some())
            .collect()
    }

    /// The files of the data set as they were in the [`Journal`](crate::Journal), without their times.
    #[must_use]
    pub fn records(&self) -> Vec<FileRecord> {
        let of_one_file =
            |a: &IndexEntry, b: &IndexEntry| a.source == b.source && b.member.is_none();
        self.entries
            .chunk_by(of_one_file)
            .map(|entries| self.record(entries))
            .collect()
    }

    /// The record of a file with these lines.
    fn record(&self, entries: &[IndexEntry]) -> FileRecord {
        let first = entries.first();
        FileRecord {
            source: first.map_or_else(String::new, |entry| entry.source.clone()),
            position: first.and_then(|entry| entry.member).unwrap_or(0),
            entries: entries.to_vec(),
            written: entries
                .iter()
                .flat_map(|entry| self.written(entry))
                .collect(),
            seconds: None,
            ended: 0.0,
        }
    }

    /// The files of a shape with their sizes. A missing file has 0 bytes.
    fn written(&self, entry: &IndexEntry) -> Vec<WrittenFile> {
        let with_size = |file: &String| WrittenFile {
            file: file.clone(),
            bytes: fs::metadata(self.root.join(file)).map_or(0, |data| data.len()),
        };
        entry.files().map(with_size).collect()
    }

    /// The path of a file of a shape.
    ///
    /// # Errors
    /// If the index names a file outside the data set.
    pub fn path_of(&self, entry: &IndexEntry, file: &str) -> Result<PathBuf, DatasetError> {
        let is_below = Path::new(file)
            .components()
            .all(|component| matches!(component, Component::Normal(_)));
        if !is_below {
            return Err(DatasetError::OutsidePath {
                id: entry.id.clone(),
                file: file.to_owned(),
            });
        }
        Ok(self.root.join(file))
    }

    /// The location of a shape's carrier, with the values that it must have.
    ///
    /// # Errors
    /// If the shape has none, or the index names a file outside the data set.
    pub fn carrier_ref(&self, entry: &IndexEntry) -> Result<CarrierRef, DatasetError> {
        let file = entry
            .file
            .as_ref()
            .ok_or_else(|| DatasetError::NoCarrier(entry.id.clone()))?;
        Ok(CarrierRef {
            path: self.path_of(entry, file)?,
            id: Some(entry.id.clone()),
            source_sha256: entry.sha256.clone(),
            content_hash: entry.content_hash.clone(),
        })
    }

    /// Reads the carrier of a shape.
    ///
    /// # Errors
    /// If the shape has none, or its file is damaged, was changed, or is that of another shape.
    pub fn carrier(&self, entry: &IndexEntry) -> Result<Carrier, DatasetError> {
        let (carrier, _) = self.carrier_ref(entry)?.read()?;
        Ok(carrier)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Status;

    #[test]
    fn an_index_round_trips_and_damage_is_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!Dataset::is_at(folder.path()));
        for path in [folder.path().to_owned(), folder.path().join("gone")] {
            let refused = Dataset::open(&path).unwrap_err();
            assert!(matches!(refused, DatasetError::NotADataset(_)), "{refused}");
        }
        let entry =
            IndexEntry::without_carrier("a", "x/a.step", Status::TimedOut, "slow".to_owned());
        let line = serde_json::to_string(&entry).unwrap();
        fs::write(folder.path().join(INDEX_FILE), format!("{line}\n")).unwrap();
        let dataset = Dataset::open(folder.path()).unwrap();
        assert_eq!(
            (dataset.entries(), dataset.labeled().len()),
            (&[entry.clone()][..], 0)
        );
        assert!(dataset.carrier(&entry).is_err());
        fs::write(folder.path().join(INDEX_FILE), format!("{line}\n{{}}\n")).unwrap();
        let damaged = Dataset::open(folder.path()).unwrap_err();
        assert!(damaged.to_string().ends_with("line 2"), "{damaged}");
    }
}
