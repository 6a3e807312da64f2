//! A labeled data set on disk: carriers, `index.jsonl` with a line a shape, and `dataset.json` with the settings.

mod audit;
mod carrier_file;
mod journal;
mod settings;

pub use audit::{Audit, Damage};
pub use carrier_file::{CarrierRef, DamagedCarrier};
pub use journal::{
    FileRecord, JOURNAL_FILE, Journal, JournalLine, WrittenFile, compare_sources, for_each_line,
    is_being_written, unix_seconds, write_journal,
};
pub use settings::{DatasetSettings, Inputs, NEUTRAL_LABEL_KEYS, SETTINGS_FILE};

use crate::config::Emit;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::Carrier;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Component, Path, PathBuf};

/// The file that lists the shapes; a folder without it is no data set.
pub const INDEX_FILE: &str = "index.jsonl";
/// Wall-clock times; no part of the data set.
pub const TIMING_FILE: &str = "timing.jsonl";

/// How labeling a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A carrier was written.
    Ok,
    /// The file cannot be labeled; the reason says why.
    Failed,
    /// The worker process ended: memory, stack, or a defect of the program.
    Crashed,
    /// The watchdog ended the worker process.
    TimedOut,
    /// The file asks for more work or memory than the settings allow; the reason names the budget.
    OverBudget,
    /// The member of an archive is not read: its name is unsafe or taken, or it is no plain file.
    Refused,
    /// What stands in a folder is not read, because it is not a file or its ending is not one of STEP.
    Skipped,
}

impl Status {
    /// The name that the index uses.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Failed => "failed",
            Self::Crashed => "crashed",
            Self::TimedOut => "timed-out",
            Self::OverBudget => "over-budget",
            Self::Refused => "refused",
            Self::Skipped => "skipped",
        }
    }
}

/// A line of `timing.jsonl`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Timing {
    /// The file's name in the index.
    pub source: String,
    /// Seconds in the worker; null where it did not answer.
    pub seconds: Option<f64>,
    /// Bytes that were written for it.
    pub bytes: u64,
    /// When it was done, in seconds since 1970.
    pub ended: f64,
}

impl Timing {
    /// The times of a file.
    #[must_use]
    pub fn of(record: &FileRecord) -> Self {
        let bytes = record.written.iter().map(|written| written.bytes).sum();
        Self {
            source: record.source.clone(),
            seconds: record.seconds,
            bytes,
            ended: record.ended,
        }
    }
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
    /// The hash of what the carrier holds, in hexadecimal; `None` if an earlier program labeled the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_hash: Option<String>,
    /// The labels and the face graph alone, where they were asked for, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels_file: Option<String>,
    /// The point sample, where it was asked for, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_file: Option<String>,
    /// The place in its archive of a member that was refused, counted from 1: two of one name are told apart by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub member: Option<u64>,
    /// Files that the line stands for, where it counts files that are not read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n_skipped: Option<u64>,
    /// SHA-256 of the STEP text, in hexadecimal; none where it could not be read.
    pub sha256: Option<String>,
    /// `#` number of the solid, where solids are the unit.
    pub solid_step_id: Option<u64>,
    /// The solid's name, where it says more than `Part 1`.
    pub product: Option<String>,
    /// Further solids of the file that are equal to this one, and were not labeled again.
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
    /// What was left out on purpose, and which faces are triangles of the file, with its `#` number.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl IndexEntry {
    /// The line of a file that has no carrier.
    #[must_use]
    pub fn without_carrier(id: &str, source: &str, status: Status, reason: String) -> Self {
        Self {
            source: source.to_owned(),
            reason: Some(reason),
            ..Self::empty(id, status)
        }
    }

    /// A line that says nothing but what became of a shape.
    pub(crate) fn empty(id: &str, status: Status) -> Self {
        Self {
            id: id.to_owned(),
            source: String::new(),
            status,
            reason: None,
            file: None,
            content_hash: None,
            labels_file: None,
            points_file: None,
            member: None,
            n_skipped: None,
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
            notes: Vec::new(),
        }
    }

    /// Where the shape's file of this kind is.
    pub(crate) fn file_mut(&mut self, emit: Emit) -> &mut Option<String> {
        match emit {
            Emit::Carrier => &mut self.file,
            Emit::Labels => &mut self.labels_file,
            Emit::Points => &mut self.points_file,
        }
    }

    /// The shape's files, relative to the data set.
    pub fn files(&self) -> impl Iterator<Item = &String> {
        [&self.file, &self.labels_file, &self.points_file]
            .into_iter()
            .flatten()
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
    /// If the folder is no data set, a line of its index is damaged, or it was labeled without carriers.
    pub fn open(path: &Path) -> Result<Self> {
        let dataset = Self::open_any(path)?;
        let is_bare = |entry: &IndexEntry| entry.file.is_none() && entry.files().next().is_some();
        ensure!(
            !dataset.entries.iter().any(is_bare),
            UsageError(format!(
                "{} holds no carriers; label again with --emit carrier",
                path.display()
            ))
        );
        Ok(dataset)
    }

    /// Reads the index, whatever was emitted for the shapes.
    ///
    /// # Errors
    /// If the folder is no data set, or a line of its index is damaged.
    pub fn open_any(path: &Path) -> Result<Self> {
        let index = path.join(INDEX_FILE);
        let is_unfinished = !index.exists() && path.join(JOURNAL_FILE).exists();
        ensure!(
            !is_unfinished,
            UsageError(format!(
                "{} is not finished; continue with `partprobe label … --resume`",
                path.display()
            ))
        );
        let text = fs::read_to_string(&index).with_context(|| {
            format!(
                "reading {}; `partprobe label` makes a data set",
                index.display()
            )
        })?;
        let parse = |(idx, line): (usize, &str)| {
            serde_json::from_str(line)
                .with_context(|| format!("{}, line {}", index.display(), idx + 1))
        };
        let entries = text.lines().enumerate().map(parse).collect::<Result<_>>()?;
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

    /// Where a file of a shape is.
    ///
    /// # Errors
    /// If the index names a file outside the data set.
    pub fn path_of(&self, entry: &IndexEntry, file: &str) -> Result<PathBuf> {
        let is_below = Path::new(file)
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        ensure!(
            is_below,
            "shape {}: `{file}` points outside the data set",
            entry.id
        );
        Ok(self.root.join(file))
    }

    /// The carrier of a shape, with all that must be true of it.
    ///
    /// # Errors
    /// If the shape has none, or the index names a file outside the data set.
    pub fn carrier_ref(&self, entry: &IndexEntry) -> Result<CarrierRef> {
        let file = entry
            .file
            .as_ref()
            .with_context(|| format!("shape {} has no carrier", entry.id))?;
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
    pub fn carrier(&self, entry: &IndexEntry) -> Result<Carrier> {
        self.carrier_ref(entry)?.read().map(|(carrier, _)| carrier)
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
        assert!(format!("{:#}", Dataset::open(folder.path()).unwrap_err()).contains("line 2"));
    }
}
