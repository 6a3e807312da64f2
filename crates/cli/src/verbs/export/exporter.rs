//! Defines the interface of an export format.
//!
//! To add a format, write one file with the arguments of its subcommand, implement [`ShapeExporter`] for them, and add a line to
//! the list in `formats.rs`. `--force` and the help use the list.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::outputs::Outputs;
use super::session::ExportSession;
use super::shape_line::ShapeLine;
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_carrier::Carrier;
use serde_json::Value;

/// A format: the arguments of its subcommand, and the function that writes the shapes.
pub(super) trait Exporter {
    /// The name of the subcommand, and of the format in `export.json`.
    const NAME: &'static str;
    /// The endings of its files, without the dot. `--force` replaces a folder only if it knows all endings in it.
    const EXTENSIONS: &'static [&'static str];
    /// The whole names of files whose ending is also that of a user's own files, such as `.py`.
    const FILE_NAMES: &'static [&'static str] = &[];

    /// Exports the shapes. `known` are the files of all formats, which `--force` may replace.
    ///
    /// # Errors
    /// If no shape could be exported, or the folder cannot be written to.
    fn export(&self, known: &'static [Outputs]) -> Result<()>;
}

/// A format in which each shape has its own files, which do not depend on other shapes.
pub(super) trait ShapeExporter {
    /// The name of the subcommand, and of the format in `export.json`.
    const NAME: &'static str;
    /// The endings of its files, without the dot.
    const EXTENSIONS: &'static [&'static str];

    /// The arguments that every format takes.
    fn common(&self) -> &CommonArgs;

    /// The settings that determine the bytes of the files, in addition to the common ones.
    fn settings(&self) -> Value;

    /// The files of one shape.
    ///
    /// # Errors
    /// If the format cannot represent the shape.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files>;
}

impl<T: ShapeExporter + Sync> Exporter for T {
    const NAME: &'static str = <T as ShapeExporter>::NAME;
    const EXTENSIONS: &'static [&'static str] = <T as ShapeExporter>::EXTENSIONS;

    fn export(&self, known: &'static [Outputs]) -> Result<()> {
        let name = <T as ShapeExporter>::NAME;
        let session = ExportSession::with_labels(name, self.common(), &self.settings(), known)?;
        let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();

        let mut lines = session
            .batch()
            .write(&shapes, |shape, carrier| self.files(shape, carrier))?;
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        session.batch().conclude(&lines)
    }
}
