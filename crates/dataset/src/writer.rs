//! Writes a data set: the settings first, then the files of each shape, and the index last.

use crate::{
    Dataset, DatasetError, FileKind, FileLayout, FileRecord, INDEX_FILE, IndexEntry, Journal,
    JournalError, OutputError, SETTINGS_FILE, ShapeFiles, TIMING_FILE, Timing, WrittenFile,
    json_document, json_lines, write_atomically, write_atomically_with,
};
use partprobe_carrier::Carrier;
use partprobe_formats::{Compression, NpzWriteError, carrier_file};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

/// Any error while the lines of a file are written; [`OutputError`] names the file.
type AnyError = Box<dyn Error + Send + Sync>;

/// The reason why a data set, or a shape of it, cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetWriteError {
    /// The folder is not empty.
    #[error("{} is not empty; choose another folder", .0.display())]
    NotEmpty(PathBuf),
    /// The folder cannot be read.
    #[error("reading {}", path.display())]
    UnreadableFolder {
        /// The folder.
        path: PathBuf,
        /// The cause.
        source: io::Error,
    },
    /// Two shapes have this id, so their files would have one name.
    #[error("two shapes have the id `{0}`; give each shape an id of its own")]
    RepeatedId(String),
    /// The id cannot be the name of a file.
    #[error("the id `{0}` is not a file name; use one without slashes")]
    UnsafeId(String),
    /// A file or folder cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The journal cannot be read or written.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The carrier does not fit into its file.
    #[error("writing the carrier of shape {id}")]
    Carrier {
        /// The shape.
        id: String,
        /// The cause.
        source: NpzWriteError,
    },
    /// The settings cannot be written as JSON.
    #[error("writing the settings")]
    Settings(#[from] serde_json::Error),
    /// The data set that was written cannot be opened again.
    #[error(transparent)]
    Reopened(#[from] DatasetError),
}

/// A data set that is being written.
///
/// Each shape is on disk when the call that adds it returns. Until [`finish`](Self::finish), the folder has a [`Journal`] and no
/// index, so it is not mistaken for a complete data set.
#[derive(Debug)]
pub struct DatasetWriter {
    root: PathBuf,
    layout: FileLayout,
    compression: Compression,
    journal: Journal,
    ids: BTreeSet<String>,
    /// The number of added shapes of each source.
    n_of_source: BTreeMap<String, u64>,
}

impl DatasetWriteError {
    /// Whether the caller made a mistake, for example by choosing a folder that is in use.
    #[must_use]
    pub fn is_misuse(&self) -> bool {
        matches!(
            self,
            Self::NotEmpty(_) | Self::Journal(JournalError::InUse(_))
        )
    }
}

impl DatasetWriter {
    /// Makes the folder of a new data set, and writes its settings as JSON.
    ///
    /// The settings say how the shapes were labeled. `partprobe train --data` needs an object with the key `label`, and compares
    /// its values with the table `[label]` of the config.
    ///
    /// # Errors
    /// If the folder cannot be made, or is not empty.
    pub fn create(root: &Path, settings: &impl Serialize) -> Result<Self, DatasetWriteError> {
        fs::create_dir_all(root)
            .map_err(|error| OutputError::new("making the folder", root, error))?;
        let is_empty = fs::read_dir(root)
            .map_err(|source| DatasetWriteError::UnreadableFolder {
                path: root.to_owned(),
                source,
            })?
            .next()
            .is_none();
        if !is_empty {
            return Err(DatasetWriteError::NotEmpty(root.to_owned()));
        }
        Self::resume(root, settings)
    }

    /// Continues a data set that was not finished. Its settings are written again.
    ///
    /// A file counts as done if the journal lists it and all files that were written for it have their full size. Call
    /// [`Journal::has`] before you add a file, because the ids of earlier shapes are not compared with new ones.
    ///
    /// # Errors
    /// If another program writes to the data set, or its files cannot be read or written.
    pub fn resume(root: &Path, settings: &impl Serialize) -> Result<Self, DatasetWriteError> {
        let is_whole = |record: &FileRecord| {
            record
                .written
                .iter()
                .all(|written| has_full_size(root, written))
        };
        let journal = Journal::open(root, is_whole)?;
        write_settings(root, settings)?;
        Ok(Self {
            root: root.to_owned(),
            layout: FileLayout::Flat,
            compression: Compression::Stored,
            journal,
            ids: BTreeSet::new(),
            n_of_source: BTreeMap::new(),
        })
    }

    /// The same writer with another layout of the files that [`add`](Self::add) writes.
    #[must_use]
    pub fn with_layout(self, layout: FileLayout) -> Self {
        Self { layout, ..self }
    }

    /// The same writer with another compression of the carriers that [`add`](Self::add) writes.
    #[must_use]
    pub fn with_compression(self, compression: Compression) -> Self {
        Self {
            compression,
            ..self
        }
    }

    /// Writes a carrier, which becomes a shape of the data set. `source` is the name of the file from which it was made.
    ///
    /// # Errors
    /// If the carrier's id is not a file name or was used before, or its file cannot be written.
    pub fn add(&mut self, source: &str, carrier: &Carrier) -> Result<(), DatasetWriteError> {
        let entry = IndexEntry {
            source: source.to_owned(),
            ..IndexEntry::of_carrier(carrier)
        };
        self.add_with_line(entry, carrier)
    }

    /// Writes a carrier with the given line of the index. [`IndexEntry::of_carrier`] makes a line to start from.
    ///
    /// # Errors
    /// As for [`add`](Self::add).
    pub fn add_with_line(
        &mut self,
        mut entry: IndexEntry,
        carrier: &Carrier,
    ) -> Result<(), DatasetWriteError> {
        self.claim_id(&entry.id)?;
        let file = carrier_file(carrier, self.compression).map_err(|source| {
            DatasetWriteError::Carrier {
                id: entry.id.clone(),
                source,
            }
        })?;
        entry.content_hash = Some(file.content_hash.to_string());

        let files = ShapeFiles::new(&self.root, self.layout);
        let written = files.write(&mut entry, FileKind::Carrier, &file.bytes)?;
        self.record_line(entry, vec![written])
    }

    /// Adds a line for a file or shape that has no carrier. [`IndexEntry::without_carrier`] makes one.
    ///
    /// # Errors
    /// If the id was used before, or the journal cannot be written.
    pub fn add_without_carrier(&mut self, entry: IndexEntry) -> Result<(), DatasetWriteError> {
        self.claim_id(&entry.id)?;
        self.record_line(entry, Vec::new())
    }

    fn claim_id(&mut self, id: &str) -> Result<(), DatasetWriteError> {
        if !is_plain_name(id) {
            return Err(DatasetWriteError::UnsafeId(id.to_owned()));
        }
        if !self.ids.insert(id.to_owned()) {
            return Err(DatasetWriteError::RepeatedId(id.to_owned()));
        }
        Ok(())
    }

    /// Records one line. The position distinguishes the shapes of one file.
    fn record_line(
        &mut self,
        entry: IndexEntry,
        written: Vec<WrittenFile>,
    ) -> Result<(), DatasetWriteError> {
        let n_before = self.n_of_source.entry(entry.source.clone()).or_default();
        let position = *n_before;
        *n_before += 1;
        let record = FileRecord {
            source: entry.source.clone(),
            position,
            entries: vec![entry],
            written,
            seconds: None,
            ended: 0.0,
        };
        self.record(record)
    }

    /// Records a file whose results are already on disk. A later record of the same source and position replaces it.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub fn record(&mut self, record: FileRecord) -> Result<(), DatasetWriteError> {
        Ok(self.journal.record(record)?)
    }

    /// The journal.
    #[must_use]
    pub fn journal(&self) -> &Journal {
        &self.journal
    }

    /// The journal, for calls such as [`Journal::begin_session`].
    #[must_use]
    pub fn journal_mut(&mut self) -> &mut Journal {
        &mut self.journal
    }

    /// Writes the index, which completes the data set, and opens it.
    ///
    /// The lines are sorted by source. The lines of one source keep the order in which they were added.
    ///
    /// # Errors
    /// If the index cannot be written.
    pub fn finish(self) -> Result<Dataset, DatasetWriteError> {
        let root = self.root.clone();
        self.finish_visiting(|_| {})?;
        Ok(Dataset::open_any(&root)?)
    }

    /// Writes the index, and passes the lines of each file to `visit`. The lines are never all in memory at once.
    ///
    /// # Errors
    /// If the index cannot be written.
    pub fn finish_visiting(
        mut self,
        mut visit: impl FnMut(&[IndexEntry]),
    ) -> Result<(), DatasetWriteError> {
        let journal = &mut self.journal;
        write_atomically_with(&self.root.join(TIMING_FILE), |file| {
            journal.for_each_record(|record| -> Result<(), AnyError> {
                Ok(file.write_all(&json_lines([Timing::of(&record)])?)?)
            })
        })?;
        write_atomically_with(&self.root.join(INDEX_FILE), |file| {
            journal.for_each_record(|record| -> Result<(), AnyError> {
                visit(&record.entries);
                Ok(file.write_all(&json_lines(&record.entries)?)?)
            })
        })?;
        // A folder with an index and no journal is a complete data set.
        Ok(self.journal.remove()?)
    }
}

/// Whether an id can be the name of a file in any folder.
#[must_use]
pub fn is_plain_name(id: &str) -> bool {
    let mut components = Path::new(id).components();
    let first = components.next();
    matches!(first, Some(Component::Normal(name)) if name == id) && components.next().is_none()
}

fn write_settings(root: &Path, settings: &impl Serialize) -> Result<(), DatasetWriteError> {
    let bytes = json_document(settings)?;
    Ok(write_atomically(&root.join(SETTINGS_FILE), &bytes)?)
}

/// Whether a file reached the disk completely. After a power cut it may be incomplete.
fn has_full_size(root: &Path, written: &WrittenFile) -> bool {
    fs::metadata(root.join(&written.file)).is_ok_and(|data| data.len() == written.bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Status;
    use partprobe_carrier::{
        CarrierMeta, Face, FaceGraph, FaceType, LabelLayer, Mesh, STEP_PARTS, STEP_PARTS_RAW, Units,
    };

    /// One triangle, whose face is one part.
    fn triangle(id: &str) -> Carrier {
        let mesh = Mesh {
            vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]],
            tri_face: vec![0],
            vertex_normal: Vec::new(),
        };
        let graph = FaceGraph {
            faces: vec![Face::new(7, FaceType::Plane, 0.5)],
            edges: Vec::new(),
        };
        let meta = CarrierMeta {
            id: id.to_owned(),
            source_sha256: "ab".to_owned(),
            theta_deg: 8.0,
            tau_min: 0,
            chord_mm: 0.01,
            angle_rad: 0.3,
            diagonal_mm: mesh.diagonal(),
            units: Units::millimeters_and_radians(),
            lost: vec!["#3 ADVANCED_FACE: it has no boundary".to_owned()],
            notes: Vec::new(),
            instances: Vec::new(),
        };
        let parts = LabelLayer::from(vec![0]);
        let layers = [(STEP_PARTS_RAW, parts.clone()), (STEP_PARTS, parts)];
        Carrier::new(mesh, graph, layers, meta).unwrap()
    }

    fn settings() -> serde_json::Value {
        serde_json::json!({ "label": { "theta_deg": 8.0 } })
    }

    #[test]
    fn added_entries_are_read_in_the_order_of_the_sources() {
        for layout in [FileLayout::Flat, FileLayout::SubFolders] {
            let folder = tempfile::tempdir().unwrap();
            let root = folder.path().join("new/dataset");
            let mut writer = DatasetWriter::create(&root, &settings())
                .unwrap()
                .with_layout(layout);
            writer.add("d/z.step", &triangle("z__s2")).unwrap();
            writer.add("d/z.step", &triangle("z__s1")).unwrap();
            let failed = IndexEntry::without_carrier(
                "b",
                "d/b.step",
                Status::Failed,
                "not a STEP file".to_owned(),
            );
            writer.add_without_carrier(failed).unwrap();
            assert!(matches!(
                Dataset::open(&root),
                Err(DatasetError::Unfinished(_))
            ));

            let dataset = writer.finish().unwrap();
            let ids: Vec<&str> = dataset.entries().iter().map(|e| e.id.as_str()).collect();
            assert_eq!(ids, ["b", "z__s2", "z__s1"]);
            assert_eq!(dataset, Dataset::open(&root).unwrap());
            for entry in dataset.labeled() {
                assert_eq!(dataset.carrier(entry).unwrap(), triangle(&entry.id));
                assert_eq!((entry.n_faces, entry.n_parts, entry.lost.len()), (1, 1, 1));
            }
        }
    }

    #[test]
    fn ids_that_cannot_name_one_file_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = DatasetWriter::create(folder.path(), &settings()).unwrap();
        writer.add("a.step", &triangle("a")).unwrap();
        let repeated = writer.add("b.step", &triangle("a"));
        assert!(matches!(repeated, Err(DatasetWriteError::RepeatedId(_))));
        for id in ["", ".", "..", "a/b", "/a", "a/", "../a"] {
            let refused = writer.add("c.step", &triangle(id));
            assert!(
                matches!(refused, Err(DatasetWriteError::UnsafeId(_))),
                "{id}"
            );
        }
        assert_eq!(writer.finish().unwrap().entries().len(), 1);
    }

    #[test]
    fn a_data_set_is_not_written_over_and_can_be_resumed() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let mut writer = DatasetWriter::create(root, &settings()).unwrap();
        writer.add("a.step", &triangle("a")).unwrap();
        writer.add("b.step", &triangle("b")).unwrap();
        assert!(matches!(
            DatasetWriter::resume(root, &settings()),
            Err(DatasetWriteError::Journal(JournalError::InUse(_)))
        ));
        drop(writer);
        let again = DatasetWriter::create(root, &settings()).unwrap_err();
        assert!(again.is_misuse(), "{again}");

        // An incomplete file is not done.
        fs::write(root.join("b.npz"), b"torn").unwrap();
        let mut writer = DatasetWriter::resume(root, &settings()).unwrap();
        assert!(writer.journal().has("a.step") && !writer.journal().has("b.step"));
        writer.add("b.step", &triangle("b")).unwrap();
        let dataset = writer.finish().unwrap();
        assert_eq!(dataset.labeled().len(), 2);
        assert_eq!(
            dataset.carrier(dataset.labeled()[1]).unwrap(),
            triangle("b")
        );
    }
}
