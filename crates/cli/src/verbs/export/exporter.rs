//! The seam between `export` and its formats, and the list of the formats.
//!
//! To add a format, write one file with the arguments of its subcommand, implement [`ShapeExporter`] for them, and add
//! a line to the list below. `--force` and the help follow the list.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::face_files::BrepnetArgs;
use super::mesh_files::{GlbArgs, ObjArgs, PlyArgs};
use super::part_files::PartsArgs;
use super::pointcept::PointceptArgs;
use super::session::ExportSession;
use super::shape_line::ShapeLine;
use crate::shape_input::ShapeInput;
use anyhow::Result;
use partprobe_carrier::Carrier;
use serde_json::Value;

/// A format: the arguments of its subcommand, and how the shapes are written in it.
pub(super) trait Exporter {
    /// The name of the subcommand, and of the format in `export.json`.
    const NAME: &'static str;
    /// The endings of its files, without the dot; `--force` replaces a folder only if it knows all endings in it.
    const EXTENSIONS: &'static [&'static str];
    /// The whole names of its files with an ending that is also that of a user's own files, such as `.py`.
    const FILE_NAMES: &'static [&'static str] = &[];

    /// Exports the shapes.
    ///
    /// # Errors
    /// If no shape could be exported, or the folder cannot be written to.
    fn export(&self) -> Result<()>;
}

/// A format in which each shape has files of its own, which depend on no other shape.
pub(super) trait ShapeExporter {
    /// The name of the subcommand, and of the format in `export.json`.
    const NAME: &'static str;
    /// The endings of its files, without the dot.
    const EXTENSIONS: &'static [&'static str];

    /// The arguments that every format takes.
    fn common(&self) -> &CommonArgs;

    /// The settings that decide the bytes of the files, apart from the common ones.
    fn settings(&self) -> Value;

    /// The files of one shape.
    ///
    /// # Errors
    /// If the format cannot hold the shape.
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files>;
}

impl<T: ShapeExporter + Sync> Exporter for T {
    const NAME: &'static str = <T as ShapeExporter>::NAME;
    const EXTENSIONS: &'static [&'static str] = <T as ShapeExporter>::EXTENSIONS;

    fn export(&self) -> Result<()> {
        let session =
            ExportSession::new(<T as ShapeExporter>::NAME, self.common(), &self.settings())?;
        let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();

        let mut lines = session
            .batch()
            .write(&shapes, |shape, carrier| self.files(shape, carrier))?;
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        session.batch().conclude(&lines)
    }
}

/// The files that one format writes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outputs {
    /// The endings of its files, without the dot.
    pub(super) extensions: &'static [&'static str],
    /// The whole names of its files that no ending stands for.
    pub(super) file_names: &'static [&'static str],
}

/// Makes the subcommands and the list of their files from one line for each format.
macro_rules! exporters {
    ($($(#[$help:meta])* $variant:ident($args:ty),)*) => {
        /// The formats.
        #[derive(Clone, Debug, clap::Subcommand)]
        pub(super) enum Format {
            $($(#[$help])* #[command(name = <$args as Exporter>::NAME)] $variant($args),)*
        }

        impl Format {
            /// Exports the shapes in this format.
            ///
            /// # Errors
            /// If no shape could be exported, or the folder cannot be written to.
            pub(super) fn export(&self) -> Result<()> {
                match self {
                    $(Self::$variant(args) => args.export(),)*
                }
            }
        }

        /// What each format writes, in the order of the list.
        pub(super) const OUTPUTS: &[Outputs] = &[$(Outputs {
            extensions: <$args as Exporter>::EXTENSIONS,
            file_names: <$args as Exporter>::FILE_NAMES,
        }),*];
    };
}

exporters! {
    /// glTF 2.0 binary: colored, with normals and feature ids (part, face, type).
    Glb(GlbArgs),
    /// PLY meshes, binary: int part, face and type of each triangle, and a color.
    Ply(PlyArgs),
    /// OBJ meshes, with .seg (a label a triangle) and .fidx (the source face of each triangle).
    Obj(ObjArgs),
    /// A mesh for each part, in a folder for each shape, with parts.json.
    Parts(PartsArgs),
    /// .seg with a label for each face in the order of the file, and the adjacency with STEP ids.
    Brepnet(BrepnetArgs),
    /// Point clouds with labels in train, val and test, as Pointcept's DefaultDataset reads them.
    Pointcept(PointceptArgs),
}
