//! The arguments of `export`.

use super::exporter::Format;
use crate::shape_source::ShapeArgs;
use anyhow::Result;
use partprobe_render::FaceLabel;
use std::path::PathBuf;

/// Write labeled shapes in the formats of other programs: GLB, PLY, OBJ, a mesh per part, BRepNet, Pointcept.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe export glb bracket.step --out glb/                  colored by part, for any viewer
  partprobe export ply dataset/ --out ply/ --label type
  partprobe export parts dataset/ --out parts/ --as obj         a mesh for each part
  partprobe label abc_0000.7z --out abc/                        ABC to Pointcept in two commands
  partprobe export pointcept abc/ --out pc/

Every export holds export.json with its settings and shapes.jsonl with a line a shape, written last.
Exit codes: 0 at least one shape was written, 1 none, or a carrier is damaged, 2 wrong usage.")]
pub(crate) struct ExportArgs {
    #[command(subcommand)]
    format: Format,
}

/// What every format takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CommonArgs {
    #[command(flatten)]
    pub(super) shapes: ShapeArgs,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace an export that is already there.
    #[arg(long)]
    pub(super) force: bool,
    /// The label of a face: what gives it its color, its number and its mesh.
    #[arg(long, visible_alias = "color", value_enum, default_value_t = FaceLabel::Part)]
    pub(super) label: FaceLabel,
}

/// Exports the shapes.
///
/// # Errors
/// If no shape could be exported, or the folder cannot be written to.
pub(crate) fn export(args: &ExportArgs) -> Result<()> {
    args.format.export()
}
