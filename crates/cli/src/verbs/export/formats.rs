//! Lists the formats of `export`: one line per format defines its subcommand and its files.

use super::exporter::Exporter;
use super::face_files::BrepnetArgs;
use super::mesh_files::{GlbArgs, ObjArgs, PlyArgs};
use super::outputs::Outputs;
use super::parquet::ParquetArgs;
use super::part_files::PartsArgs;
use super::partfield_input::PartFieldInputArgs;
use super::pointcept::PointceptArgs;
use super::webdataset::WebdatasetArgs;
use anyhow::Result;

/// Makes the subcommands and the list of their files from one line per format.
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
                    $(Self::$variant(args) => args.export(OUTPUTS),)*
                }
            }
        }

        /// The files of each format, in the order of the list.
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
    /// OBJ meshes, with .seg (one label per triangle) and .fidx (the B-Rep face of each triangle).
    Obj(ObjArgs),
    /// One mesh per part, in one folder per shape, with parts.json.
    Parts(PartsArgs),
    /// .seg files with one label per face in the order of the file, and the adjacency with STEP ids.
    Brepnet(BrepnetArgs),
    /// Point clouds with labels in train, val and test, as Pointcept's DefaultDataset reads them.
    Pointcept(PointceptArgs),
    /// Meshes that PartField reads, and a map with which its results are read.
    PartFieldInput(PartFieldInputArgs),
    /// Parquet tables with a row per shape and lists per face and edge, for pandas, polars, DuckDB and datasets.
    Parquet(ParquetArgs),
    /// Tar shards of NPZ and JSON files, as WebDataset reads them.
    Webdataset(WebdatasetArgs),
}
