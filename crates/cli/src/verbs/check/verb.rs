//! Defines the arguments of `check`.

use super::labels::{LabelsArgs, check_labels};
use super::pointcept::{PointceptArgs, check_pointcept};
use anyhow::Result;

/// Check a folder that is meant for another program, or label files that are meant for a data set.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe check pointcept pc/
  partprobe check labels seg/ --data dataset/

Exit codes: 0 no problem, 1 a problem (each is a line on stdout), 2 wrong usage.")]
pub(crate) struct CheckArgs {
    #[command(subcommand)]
    format: Format,
}

/// The formats.
#[derive(Clone, Debug, clap::Subcommand)]
enum Format {
    /// Check array shapes and types, finite numbers, unit normals, contiguous instances, one class per instance, and disjoint
    /// splits.
    Pointcept(PointceptArgs),
    /// Check which shapes of a data set label files would label, how they would be joined, and what does not fit.
    Labels(LabelsArgs),
}

/// Checks a folder.
///
/// # Errors
/// If there is a problem, or nothing to check.
pub(crate) fn check(args: &CheckArgs) -> Result<()> {
    match &args.format {
        Format::Pointcept(args) => check_pointcept(args),
        Format::Labels(args) => check_labels(args),
    }
}
