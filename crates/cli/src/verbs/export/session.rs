//! Prepares an export: its folder is made, its settings are written, and its shapes are known.

use super::batch::Batch;
use super::common_args::CommonArgs;
use super::folder::{ExportFolder, Replace};
use super::outputs::Outputs;
use crate::interrupt::Interrupt;
use crate::shape_input::ShapeInputs;
use anyhow::Result;
use serde_json::{Value, json};

/// An export whose folder is made and whose shapes are known.
pub(super) struct ExportSession {
    pub(super) sources: ShapeInputs,
    pub(super) folder: ExportFolder,
    interrupt: Interrupt,
    n_threads: usize,
}

impl ExportSession {
    /// Makes the folder, writes the settings, and finds the shapes; `--force` replaces the `known` files only.
    pub(super) fn new(
        format: &str,
        common: &CommonArgs,
        settings: &Value,
        known: &'static [Outputs],
    ) -> Result<Self> {
        // Before the folder is made: a mistyped path must not leave one behind.
        common.shapes.check()?;
        let replace = if common.force {
            Replace::Export(known)
        } else {
            Replace::Nothing
        };
        let folder = ExportFolder::make(&common.out, replace, &common.shapes.paths)?;
        let mut settings = settings.clone();
        settings["label"] = json!(common.label);
        folder.write_settings(format, &settings)?;
        let interrupt = Interrupt::listen()?;
        let sources = common
            .shapes
            .open(&folder.scratch(), &interrupt)
            .inspect_err(|_| folder.abandon())?;
        Ok(Self {
            sources,
            folder,
            interrupt,
            n_threads: common.shapes.n_threads(),
        })
    }

    pub(super) fn batch(&self) -> Batch<'_> {
        Batch {
            folder: &self.folder,
            interrupt: &self.interrupt,
            n_threads: self.n_threads,
        }
    }
}
