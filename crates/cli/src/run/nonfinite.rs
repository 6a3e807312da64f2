//! Stores an update with numbers that are not finite, so that `partprobe replay` can repeat it.

use super::folder::RunFolder;
use anyhow::{Context, Result};
use partprobe_carrier::PointSample;
use partprobe_formats::{Compression, SampleLabels, sample_from_npz, sample_to_npz};
use partprobe_net::{TrainShape, Training};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fs;
use std::path::Path;

/// The name of the labels in the files of the shapes.
const LABELS: &str = "supervision";

/// `batch.json` of a dump: the shapes of the update, in their order. Shape k is in `<k>.npz`.
#[derive(Deserialize, Serialize)]
pub(crate) struct DumpedUpdate {
    format_version: u32,
    /// The update, counted from 1.
    pub(crate) step: usize,
    pub(crate) error: String,
    shapes: Vec<String>,
}

/// Writes the state of the training before the update, and the update's shapes with their points and labels.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn dump(
    folder: &RunFolder,
    relative: &str,
    training: &Training,
    shapes: &[Cow<'_, TrainShape>],
    error: &str,
) -> Result<()> {
    folder.write(&format!("{relative}/checkpoint"), &training.checkpoint()?)?;
    for (k, shape) in shapes.iter().enumerate() {
        let labels = SampleLabels::from([(LABELS.to_owned(), shape.labels.clone())]);
        let bytes = sample_to_npz(&shape.sample, &labels, Compression::Stored)?;
        folder.write(&format!("{relative}/{k}.npz"), &bytes)?;
    }
    let batch = DumpedUpdate {
        format_version: partprobe_formats::FORMAT_VERSION,
        step: training.n_steps_done() + 1,
        error: error.to_owned(),
        shapes: shapes.iter().map(|shape| shape.id.clone()).collect(),
    };
    folder.write_json(&format!("{relative}/batch.json"), &batch)
}

impl DumpedUpdate {
    /// The file of a dump that names its shapes.
    pub(crate) const FILE: &str = "batch.json";

    /// Reads the description of the update in a dump.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn read(dump: &Path) -> Result<Self> {
        let path = dump.join(Self::FILE);
        serde_json::from_slice(&read(&path)?).with_context(|| path.display().to_string())
    }

    /// The state of the training before the update.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn checkpoint(dump: &Path) -> Result<Vec<u8>> {
        read(&dump.join("checkpoint"))
    }

    /// The shapes of the update, with their points and labels.
    ///
    /// # Errors
    /// If a file cannot be read.
    pub(crate) fn read_shapes(&self, dump: &Path) -> Result<Vec<TrainShape>> {
        read_shapes(dump, self)
    }
}

fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("reading {}", path.display()))
}

fn read_shapes(dump: &Path, batch: &DumpedUpdate) -> Result<Vec<TrainShape>> {
    let read_shape = |(k, id): (usize, &String)| {
        let path = dump.join(format!("{k}.npz"));
        let (sample, mut labels): (PointSample, SampleLabels) =
            sample_from_npz(&read(&path)?).with_context(|| path.display().to_string())?;
        let labels = labels
            .remove(LABELS)
            .with_context(|| format!("{} has no labels", path.display()))?;
        Ok(TrainShape {
            id: id.clone(),
            sample,
            labels,
        })
    };
    batch.shapes.iter().enumerate().map(read_shape).collect()
}
