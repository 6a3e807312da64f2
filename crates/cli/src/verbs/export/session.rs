//! Prepares an export: its folder is made, its settings are written, and its shapes are known.

use super::batch::Batch;
use super::common_args::{CommonArgs, FolderArgs};
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
    after_stop: &'static str,
    is_strict: bool,
}

impl ExportSession {
    /// The session of a format with labels. The settings contain the choice of the labels.
    pub(super) fn with_labels(
        format: &str,
        common: &CommonArgs,
        settings: &Value,
        known: &'static [Outputs],
    ) -> Result<Self> {
        let mut settings = settings.clone();
        settings["label"] = json!(common.label);
        Self::new(format, &common.folder, &settings, known)
    }

    /// Makes the folder, writes the settings, and finds the shapes. `--force` only replaces the `known` files.
    pub(super) fn new(
        format: &str,
        args: &FolderArgs,
        settings: &Value,
        known: &'static [Outputs],
    ) -> Result<Self> {
        // This is checked before the folder is made, so that a mistyped path does not leave a folder behind.
        args.shapes.check()?;
        let replace = if args.force {
            Replace::Export(known)
        } else {
            Replace::Nothing
        };
        let folder = ExportFolder::make(&args.out, replace, &args.shapes.paths)?;
        let session = Self::in_folder(args, folder)?;
        // The former export is removed only now that there are shapes for a new one.
        session.folder.clear()?;
        session.folder.write_settings(format, settings)?;
        Ok(session)
    }

    /// The session of an export that was stopped, or a new one if the folder is empty.
    ///
    /// # Errors
    /// In addition to those of [`new`](Self::new), if the folder is an export with other settings.
    pub(super) fn resumed(format: &str, args: &FolderArgs, settings: &Value) -> Result<Self> {
        args.shapes.check()?;
        let folder = ExportFolder::resume(&args.out, format, settings)?;
        let session = Self::in_folder(args, folder)?;
        session.folder.write_settings(format, settings)?;
        Ok(session)
    }

    /// The same session, of a verb that can resume it after a stop.
    pub(super) fn resumable(self) -> Self {
        Self {
            after_stop: "continue with --resume",
            ..self
        }
    }

    fn in_folder(args: &FolderArgs, folder: ExportFolder) -> Result<Self> {
        let interrupt = Interrupt::listen()?;
        let sources = args
            .shapes
            .open(&folder.scratch(), &interrupt)
            .inspect_err(|_| folder.abandon())?;
        Ok(Self {
            sources,
            folder,
            interrupt,
            n_threads: args.shapes.n_threads(),
            after_stop: "export again with --force",
            is_strict: args.strict,
        })
    }

    pub(super) fn batch(&self) -> Batch<'_> {
        Batch {
            folder: &self.folder,
            interrupt: &self.interrupt,
            n_threads: self.n_threads,
            after_stop: self.after_stop,
            is_strict: self.is_strict,
        }
    }
}
