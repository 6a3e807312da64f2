//! Defines the arguments that every format of `export` takes.

use crate::shape_input::ShapeArgs;
use partprobe_render::FaceLabel;
use std::path::PathBuf;

/// The shapes, and the folder of an export.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct FolderArgs {
    #[command(flatten)]
    pub(super) shapes: ShapeArgs,
    /// The folder to write.
    #[arg(long, short, value_name = "DIR")]
    pub(super) out: PathBuf,
    /// Replace an existing export.
    #[arg(long)]
    pub(super) force: bool,
    /// Exit with 1 if any file or shape failed.
    #[arg(long)]
    pub(super) strict: bool,
}

/// What every format with labels takes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct CommonArgs {
    #[command(flatten)]
    pub(super) folder: FolderArgs,
    /// The label that gives a face its color, its number and its mesh: part, raw-part (before small parts were absorbed), type,
    /// face, cad (the color in the STEP file), or the name of a label layer that the carriers store.
    #[arg(long, visible_alias = "color", value_name = "LABEL", default_value_t = FaceLabel::Part)]
    pub(super) label: FaceLabel,
}
