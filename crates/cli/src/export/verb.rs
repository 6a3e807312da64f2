//! The arguments of `export`, and which writer each format has.

use super::batch::{Batch, Files};
use super::face_files::{TableFormat, face_files};
use super::folder::{ExportFolder, Replace};
use super::mesh_files::{PartFormat, Vertices, glb_files, obj_files, part_files, ply_files};
use super::pointcept::{self, PointceptArgs};
use super::shape_line::ShapeLine;
use crate::face_label::FaceLabel;
use crate::interrupt::Interrupt;
use crate::shape_source::{ShapeArgs, ShapeSource, ShapeSources};
use anyhow::Result;
use carrier::Carrier;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Write labelled shapes in the formats of other programs: GLB, PLY, OBJ, a mesh per part, BRepNet, Pointcept.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe export glb bracket.step --out glb/                  coloured by part, for any viewer
  partprobe export ply dataset/ --out ply/ --label type
  partprobe export parts dataset/ --out parts/ --as obj         a mesh for each part
  partprobe label abc_0000.7z --out abc/                        ABC to Pointcept in two commands
  partprobe export pointcept abc/ --out pc/

Every export holds export.json with its settings and shapes.jsonl with a line a shape, written last.
Exit codes: 0 at least one shape was written, 1 none, or a carrier is damaged, 2 wrong usage.")]
pub struct ExportArgs {
    #[command(subcommand)]
    format: Format,
}

/// The formats.
#[derive(Clone, Debug, clap::Subcommand)]
enum Format {
    /// glTF 2.0 binary: coloured, with normals and feature ids (part, face, type).
    Glb(GlbArgs),
    /// PLY meshes, binary: int part, face and type of each triangle, and a colour.
    Ply(MeshArgs),
    /// OBJ meshes, with .seg (a label a triangle) and .fidx (the source face of each triangle).
    Obj(MeshArgs),
    /// A mesh for each part, in a folder for each shape, with parts.json.
    Parts(PartsArgs),
    /// .seg with a label for each face in the order of the file, and the adjacency with STEP ids.
    Brepnet(BrepnetArgs),
    /// Point clouds with labels in train, val and test, as Pointcept's DefaultDataset reads them.
    Pointcept(PointceptArgs),
}

/// What every format takes.
#[derive(Clone, Debug, clap::Args)]
pub struct CommonArgs {
    #[command(flatten)]
    pub(super) shapes: ShapeArgs,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace an export that is already there.
    #[arg(long)]
    pub(super) force: bool,
    /// The label of a face: what gives it its colour, its number and its mesh.
    #[arg(long, visible_alias = "color", value_enum, default_value_t = FaceLabel::Part)]
    pub(super) label: FaceLabel,
}

/// What `glb` takes.
#[derive(Clone, Debug, clap::Args)]
struct GlbArgs {
    #[command(flatten)]
    common: CommonArgs,
}

/// What `ply` and `obj` take.
#[derive(Clone, Debug, clap::Args)]
struct MeshArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// Whether faces share their vertices.
    #[arg(long, value_enum, default_value_t = Vertices::Welded)]
    vertices: Vertices,
}

/// What `parts` takes.
#[derive(Clone, Debug, clap::Args)]
struct PartsArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// The format of the meshes.
    #[arg(long = "as", value_enum, default_value_t = PartFormat::Ply)]
    format: PartFormat,
}

/// What `brepnet` takes.
#[derive(Clone, Debug, clap::Args)]
struct BrepnetArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// The format of the adjacency.
    #[arg(long = "as", value_enum, default_value_t = TableFormat::Json)]
    format: TableFormat,
}

/// Exports the shapes.
///
/// # Errors
/// If no shape could be exported, or the folder cannot be written to.
pub fn export(args: &ExportArgs) -> Result<()> {
    match &args.format {
        Format::Glb(GlbArgs { common }) => {
            each_alone("glb", common, &json!({}), |shape, carrier| glb_files(shape, carrier, common.label))
        }
        Format::Ply(MeshArgs { common, vertices }) => {
            let settings = json!({ "vertices": vertices });
            each_alone("ply", common, &settings, |shape, carrier| ply_files(shape, carrier, common.label, *vertices))
        }
        Format::Obj(MeshArgs { common, vertices }) => {
            let settings = json!({ "vertices": vertices });
            each_alone("obj", common, &settings, |shape, carrier| obj_files(shape, carrier, common.label, *vertices))
        }
        Format::Parts(PartsArgs { common, format }) => {
            let settings = json!({ "as": format });
            each_alone("parts", common, &settings, |shape, carrier| part_files(shape, carrier, common.label, *format))
        }
        Format::Brepnet(BrepnetArgs { common, format }) => {
            let settings = json!({ "as": format });
            each_alone("brepnet", common, &settings, |shape, carrier| face_files(shape, carrier, common.label, *format))
        }
        Format::Pointcept(args) => pointcept::export(args),
    }
}

/// An export in which each shape has files of its own.
fn each_alone(
    format: &str,
    common: &CommonArgs,
    settings: &Value,
    files_of: impl Fn(&ShapeSource, &Carrier) -> Result<Files> + Sync,
) -> Result<()> {
    let opened = Opened::new(format, common, settings)?;
    let shapes: Vec<&ShapeSource> = opened.sources.shapes.iter().collect();
    let mut lines = opened.batch().write(&shapes, files_of)?;
    lines.extend(opened.sources.failed.iter().map(ShapeLine::from));
    opened.batch().conclude(&lines)
}

/// An export whose folder is made and whose shapes are known.
pub(super) struct Opened {
    pub(super) sources: ShapeSources,
    pub(super) folder: ExportFolder,
    interrupt: Interrupt,
    n_threads: usize,
}

impl Opened {
    /// Makes the folder, writes the settings, and finds the shapes.
    pub(super) fn new(format: &str, common: &CommonArgs, settings: &Value) -> Result<Self> {
        // Before the folder is made: a mistyped path must not leave one behind.
        common.shapes.check()?;
        let replace = if common.force { Replace::Export } else { Replace::Nothing };
        let folder = ExportFolder::make(&common.out, replace, &common.shapes.paths)?;
        let mut settings = settings.clone();
        settings["label"] = json!(common.label);
        folder.write_settings(format, &settings)?;
        let interrupt = Interrupt::listen()?;
        let sources = common.shapes.open(&folder.scratch(), &interrupt).inspect_err(|_| folder.abandon())?;
        Ok(Self { sources, folder, interrupt, n_threads: common.shapes.n_threads() })
    }

    pub(super) fn batch(&self) -> Batch<'_> {
        Batch { folder: &self.folder, interrupt: &self.interrupt, n_threads: self.n_threads }
    }
}
