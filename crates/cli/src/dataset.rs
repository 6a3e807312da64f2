//! A labelled data set on disk: carriers, `index.jsonl` with a line a shape, and `dataset.json` with the settings.

use anyhow::{Context, Result, ensure};
use carrier::Carrier;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The file that lists the shapes; a folder without it is no data set.
pub const INDEX_FILE: &str = "index.jsonl";
/// The file with the settings.
pub const SETTINGS_FILE: &str = "dataset.json";
/// Wall-clock times; no part of the data set.
pub const TIMING_FILE: &str = "timing.jsonl";

/// How labelling a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A carrier was written.
    Ok,
    /// The file cannot be labelled; the reason says why.
    Failed,
    /// The worker process ended: memory, stack, or a defect of the program.
    Crashed,
    /// The watchdog ended the worker process.
    TimedOut,
}

/// One line of the index: a shape with its carrier, or a file without one.
///
/// The counts are 0 where there is no carrier.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct IndexEntry {
    /// The shape's id; the carrier's file is named after it.
    pub id: String,
    /// The file, by the name of the argument and the path below it; it is the same on any machine.
    pub source: String,
    /// How it ended.
    pub status: Status,
    /// Why there is no carrier.
    pub reason: Option<String>,
    /// The carrier, relative to the data set.
    pub file: Option<String>,
    /// SHA-256 of the STEP text, in hexadecimal; none where it could not be read.
    pub sha256: Option<String>,
    /// `#` number of the solid, where solids are the unit.
    pub solid_step_id: Option<u64>,
    /// The solid's name, where it says more than `Part 1`.
    pub product: Option<String>,
    /// Further solids of the file that are equal to this one, and were not labelled again.
    pub n_equal_solids: usize,
    /// Faces.
    pub n_faces: usize,
    /// Parts, by the predicate alone.
    pub n_parts: usize,
    /// Parts after small ones were absorbed.
    pub n_labels: usize,
    /// Triangles of the plain carrier.
    pub n_triangles: usize,
    /// Shared edges.
    pub n_edges: usize,
    /// Shared edges without a defined angle.
    pub n_undefined_angles: usize,
    /// Edges with more than two faces.
    pub n_non_manifold_edges: u64,
    /// Every face, loop and entity that was lost, with its `#` number and the reason.
    pub lost: Vec<String>,
}

impl IndexEntry {
    /// The line of a file that has no carrier.
    #[must_use]
    pub fn without_carrier(id: &str, source: &str, status: Status, reason: String) -> Self {
        Self {
            id: id.to_owned(),
            source: source.to_owned(),
            status,
            reason: Some(reason),
            file: None,
            sha256: None,
            solid_step_id: None,
            product: None,
            n_equal_solids: 0,
            n_faces: 0,
            n_parts: 0,
            n_labels: 0,
            n_triangles: 0,
            n_edges: 0,
            n_undefined_angles: 0,
            n_non_manifold_edges: 0,
            lost: Vec::new(),
        }
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

    /// Whether the folder is a finished data set.
    #[must_use]
    pub fn is_at(path: &Path) -> bool {
        path.join(INDEX_FILE).is_file()
    }

    /// Reads the index.
    ///
    /// # Errors
    /// If the folder is no data set, or a line of its index is damaged.
    pub fn open(path: &Path) -> Result<Self> {
        let index = path.join(INDEX_FILE);
        let text = fs::read_to_string(&index)
            .with_context(|| format!("reading {}; `partprobe label` makes a data set", index.display()))?;
        let parse = |(idx, line): (usize, &str)| {
            serde_json::from_str(line).with_context(|| format!("{}, line {}", index.display(), idx + 1))
        };
        let entries = text.lines().enumerate().map(parse).collect::<Result<_>>()?;
        Ok(Self { root: path.to_owned(), entries })
    }

    /// Every line of the index, in its order.
    #[must_use]
    pub fn entries(&self) -> &[IndexEntry] {
        &self.entries
    }

    /// The shapes that have a carrier, in the order of the index.
    #[must_use]
    pub fn labelled(&self) -> Vec<&IndexEntry> {
        self.entries.iter().filter(|entry| entry.file.is_some()).collect()
    }

    /// Reads the carrier of a shape.
    ///
    /// # Errors
    /// If the shape has none, or its file is damaged.
    pub fn carrier(&self, entry: &IndexEntry) -> Result<Carrier> {
        let file = entry.file.as_ref().with_context(|| format!("shape {} has no carrier", entry.id))?;
        let is_below = Path::new(file).components().all(|part| matches!(part, Component::Normal(_)));
        ensure!(is_below, "shape {}: `{file}` points outside the data set", entry.id);
        let path = self.root.join(file);
        let bytes = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
        formats::carrier_from_npz(&bytes).with_context(|| path.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_comes_back_and_damage_is_named() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!Dataset::is_at(folder.path()));
        assert!(Dataset::open(folder.path()).is_err());
        let entry = IndexEntry::without_carrier("a", "x/a.step", Status::TimedOut, "slow".to_owned());
        let line = serde_json::to_string(&entry).unwrap();
        fs::write(folder.path().join(INDEX_FILE), format!("{line}\n")).unwrap();
        let dataset = Dataset::open(folder.path()).unwrap();
        assert_eq!((dataset.entries(), dataset.labelled().len()), (&[entry.clone()][..], 0));
        assert!(dataset.carrier(&entry).is_err());
        fs::write(folder.path().join(INDEX_FILE), format!("{line}\n{{}}\n")).unwrap();
        assert!(format!("{:#}", Dataset::open(folder.path()).unwrap_err()).contains("line 2"));
    }
}
