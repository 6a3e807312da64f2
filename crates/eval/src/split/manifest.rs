//! Defines a published split: the side of each shape, for any name and any triangulation of it.
//!
//! Lines of JSON go in or out, one per shape. Shapes are recognized by the hash of the file that they were read from, and by
//! the number of the solid in it.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The name of a side.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SideName {
    /// The shape trains backbones.
    Train,
    /// The shape chooses a checkpoint.
    Valid,
    /// The shape is scored.
    Test,
}

impl SideName {
    /// Its index among train, valid and test.
    pub(super) fn index(self) -> usize {
        match self {
            Self::Train => super::TRAIN,
            Self::Valid => super::VALID,
            Self::Test => super::TEST,
        }
    }
}

/// The key by which a shape is recognized.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ShapeKey {
    /// SHA-256 of the file, in hexadecimal.
    pub source_sha256: String,
    /// The `#` number of the solid, if the shape is one solid of its file.
    pub solid_step_id: Option<u64>,
}

/// A line of a manifest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ManifestLine {
    /// The key by which the shape is recognized.
    #[serde(flatten)]
    pub key: ShapeKey,
    /// The side of the shape.
    pub side: SideName,
    /// The name of the shape. It is for readers only.
    #[serde(default)]
    pub id: String,
    /// Its number of parts by the first reference. It is for readers only.
    #[serde(default)]
    pub n_parts: usize,
}

/// The side of each shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifest {
    lines: BTreeMap<ShapeKey, ManifestLine>,
}

/// The text is not a manifest.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ManifestError {
    /// A line is not JSON, or lacks a key.
    #[error("line {line}: {reason}")]
    Line {
        /// The number of the line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// Two lines put one shape on different sides.
    #[error(
        "line {line} puts the shape of {id} on another side than an earlier line; keep one of them"
    )]
    TwoSides {
        /// The number of the second line, counted from 1.
        line: usize,
        /// The name of the shape in the second line.
        id: String,
    },
}

impl Manifest {
    /// Reads lines of JSON. Empty lines are skipped, and unknown keys are ignored.
    ///
    /// # Errors
    /// If a line is not one of a manifest, or contradicts an earlier one.
    pub fn from_json_lines(text: &str) -> Result<Self, ManifestError> {
        let mut manifest = Self::default();
        for (number, text) in (1..).zip(text.lines()) {
            if text.trim().is_empty() {
                continue;
            }
            let line: ManifestLine =
                serde_json::from_str(text).map_err(|error| ManifestError::Line {
                    line: number,
                    reason: error.to_string(),
                })?;
            let earlier = manifest.lines.get(&line.key);
            if earlier.is_some_and(|earlier| earlier.side != line.side) {
                return Err(ManifestError::TwoSides {
                    line: number,
                    id: line.id,
                });
            }
            manifest.lines.insert(line.key.clone(), line);
        }
        Ok(manifest)
    }

    /// A manifest of these lines. If two lines are about the same shape, the first one is kept.
    #[must_use]
    pub fn of(lines: impl IntoIterator<Item = ManifestLine>) -> Self {
        let mut manifest = Self::default();
        for line in lines {
            manifest.lines.entry(line.key.clone()).or_insert(line);
        }
        manifest
    }

    /// The lines, sorted by side and then by the keys of the shapes.
    #[must_use]
    pub fn to_json_lines(&self) -> String {
        let mut lines: Vec<&ManifestLine> = self.lines.values().collect();
        lines.sort_by(|a, b| (a.side, &a.key).cmp(&(b.side, &b.key)));
        let json = |line: &&ManifestLine| {
            serde_json::json!({
                "side": line.side,
                "source_sha256": line.key.source_sha256,
                "solid_step_id": line.key.solid_step_id,
                "id": line.id,
                "n_parts": line.n_parts,
            })
        };
        lines
            .iter()
            .map(|line| format!("{}\n", json(line)))
            .collect()
    }

    /// Returns the side of a shape, or `None` if the manifest does not name it.
    #[must_use]
    pub fn side_of(&self, key: &ShapeKey) -> Option<SideName> {
        self.lines.get(key).map(|line| line.side)
    }

    /// The lines, sorted by the keys of the shapes.
    pub fn lines(&self) -> impl Iterator<Item = &ManifestLine> {
        self.lines.values()
    }
}
