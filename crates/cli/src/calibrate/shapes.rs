//! From arguments to carriers: data sets and carrier files are read, STEP files are labelled in this process.

use crate::config::LabelConfig;
use crate::dataset::{Dataset, IndexEntry};
use crate::label::{carriers_of_path, source_files};
use anyhow::{Context, Result};
use carrier::Carrier;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;

/// Something that holds carriers.
#[derive(Clone, Debug)]
pub(super) enum ShapeSource {
    /// A STEP file or a carrier file, with the name that warnings use.
    File { path: PathBuf, name: String },
    /// A shape of a data set.
    Entry { dataset: Arc<Dataset>, entry: Box<IndexEntry> },
}

impl ShapeSource {
    /// Finds what the arguments hold, in their order.
    pub(super) fn all(paths: &[PathBuf]) -> Result<Vec<Self>> {
        let mut sources = Vec::new();
        for path in paths {
            if Dataset::is_at(path) {
                let dataset = Arc::new(Dataset::open(path)?);
                let entry =
                    |entry: &IndexEntry| Self::Entry { dataset: Arc::clone(&dataset), entry: Box::new(entry.clone()) };
                sources.extend(dataset.labelled().into_iter().map(entry));
            } else {
                let files = source_files(std::slice::from_ref(path))?;
                sources.extend(files.into_iter().map(|file| Self::File { path: file.path, name: file.name }));
            }
        }
        Ok(sources)
    }

    /// The name that a warning uses.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::File { name, .. } => name,
            Self::Entry { entry, .. } => &entry.id,
        }
    }

    /// The carriers; several where each solid of a file is a shape.
    pub(super) fn carriers(&self, config: &LabelConfig) -> Result<Vec<Carrier>> {
        match self {
            // A defect of the kernel costs the file that shows it, not the calibration.
            Self::File { path, .. } => catch_unwind(AssertUnwindSafe(|| carriers_of_path(path, config)))
                .ok()
                .context("a defect of partprobe: reading the file panicked")?,
            Self::Entry { dataset, entry } => Ok(vec![dataset.carrier(entry)?]),
        }
    }
}
