//! Defines the arguments of `export`.

use super::formats::Format;
use anyhow::Result;

/// Write labeled shapes in the formats of other programs: GLB, PLY, OBJ, a mesh per part, BRepNet, Pointcept, PartField, Parquet,
/// WebDataset.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe export glb bracket.step --out glb/                  colored by part, for any viewer
  partprobe export ply dataset/ --out ply/ --label type
  partprobe export parts dataset/ --out parts/ --as obj         a mesh per part

  partprobe label abc_0000.7z --out abc/                        ABC to Pointcept in two commands
  partprobe export pointcept abc/ --out pc/
  partprobe export parquet dataset/ --out tables/               a row per shape, for pandas, polars and DuckDB

Every export contains export.json with its settings and shapes.jsonl with one line per shape, written last.
Exit codes: 0 at least one shape was written, 1 none, or a carrier is damaged, 2 wrong usage.")]
pub(crate) struct ExportArgs {
    #[command(subcommand)]
    format: Format,
}

/// Exports the shapes.
///
/// # Errors
/// If no shape could be exported, or the folder cannot be written to.
pub(crate) fn export(args: &ExportArgs) -> Result<()> {
    args.format.export()
}
