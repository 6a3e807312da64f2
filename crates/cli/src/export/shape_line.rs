//! A line of `shapes.jsonl`: what became of one shape of an export.

use crate::dataset::DamagedCarrier;
use crate::shape_source::{FailedSource, ShapeSource};
use serde::{Deserialize, Serialize};

/// The file that lists the shapes; it is written last, so a folder that has it is complete.
pub const SHAPES_FILE: &str = "shapes.jsonl";

/// A shape with its files, or why it has none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub struct ShapeLine {
    /// The shape's id.
    pub id: String,
    /// The file that it was read from.
    pub source: String,
    /// The side of the split that it is on, in formats that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split: Option<String>,
    /// Shapes of one group are related and must not be on two sides of a split.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub group: Option<String>,
    /// Its files, relative to the export.
    pub files: Vec<String>,
    /// Why it has no files.
    pub reason: Option<String>,
    /// Its carrier is there, and is not what was labeled.
    #[serde(skip)]
    pub is_damaged: bool,
}

impl ShapeLine {
    /// The line of a shape that was written.
    #[must_use]
    pub fn written(shape: &ShapeSource, files: Vec<String>) -> Self {
        Self {
            id: shape.id.clone(),
            source: shape.source.clone(),
            files,
            ..Self::default()
        }
    }

    /// The line of a shape that could not be exported.
    #[must_use]
    pub fn failed(shape: &ShapeSource, error: &anyhow::Error) -> Self {
        Self {
            id: shape.id.clone(),
            source: shape.source.clone(),
            reason: Some(format!("{error:#}")),
            is_damaged: DamagedCarrier::is_in(error),
            ..Self::default()
        }
    }
}

impl From<&FailedSource> for ShapeLine {
    fn from(failed: &FailedSource) -> Self {
        let FailedSource { id, source, reason } = failed.clone();
        Self {
            id,
            source,
            reason: Some(reason),
            ..Self::default()
        }
    }
}
