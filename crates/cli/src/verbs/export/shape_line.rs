//! Defines a line of `shapes.jsonl`: the result of one shape of an export.

use crate::damaged_carriers::is_damaged_carrier;
use crate::shape_input::{FailedInput, ShapeInput};
use serde::{Deserialize, Serialize};

/// A shape with its files, or the reason why it has none.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct ShapeLine {
    /// The shape's id.
    pub(crate) id: String,
    /// The file from which it was read.
    pub(crate) source: String,
    /// Its side of the split, in formats that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) split: Option<String>,
    /// Shapes of one group are related and must not be on two sides of a split.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) group: Option<String>,
    /// Its files, relative to the export.
    pub(crate) files: Vec<String>,
    /// The reason why it has no files.
    pub(crate) reason: Option<String>,
    /// Whether its carrier exists but is not the one that was labeled.
    #[serde(skip)]
    pub(crate) is_damaged: bool,
}

impl ShapeLine {
    /// The line of a shape that was written.
    #[must_use]
    pub(crate) fn written(shape: &ShapeInput, files: Vec<String>) -> Self {
        Self {
            id: shape.id.clone(),
            source: shape.source.clone(),
            files,
            ..Self::default()
        }
    }

    /// The line of a shape that could not be exported.
    #[must_use]
    pub(crate) fn failed(shape: &ShapeInput, error: &anyhow::Error) -> Self {
        Self {
            id: shape.id.clone(),
            source: shape.source.clone(),
            reason: Some(format!("{error:#}")),
            is_damaged: is_damaged_carrier(error),
            ..Self::default()
        }
    }
}

impl From<&FailedInput> for ShapeLine {
    fn from(failed: &FailedInput) -> Self {
        let FailedInput { id, source, reason } = failed.clone();
        Self {
            id,
            source,
            reason: Some(reason),
            ..Self::default()
        }
    }
}
