//! Defines the arguments that every format of `export` takes.

use crate::shape_input::ShapeArgs;
use partprobe_render::FaceLabel;
use std::path::PathBuf;

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
