//! The arguments of `check`.

use super::pointcept::{PointceptArgs, check_pointcept};
use anyhow::Result;

/// Look over a folder that is meant for another program, and name every problem.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe check pointcept pc/
Exit codes: 0 no problem, 1 a problem (each is a line on stdout), 2 wrong usage.")]
pub(crate) struct CheckArgs {
    #[command(subcommand)]
    format: Format,
}

/// The formats.
#[derive(Clone, Debug, clap::Subcommand)]
enum Format {
    /// Shapes, types, finite numbers, unit normals, contiguous instances, one class an instance, disjoint splits.
    Pointcept(PointceptArgs),
}

/// Checks a folder.
///
/// # Errors
/// If there is a problem, or nothing to check.
pub(crate) fn check(args: &CheckArgs) -> Result<()> {
    let Format::Pointcept(args) = &args.format;
    check_pointcept(args)
}
