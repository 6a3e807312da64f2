//! The verb itself.

use super::{LabelJob, label_paths};
use crate::config;
use crate::interrupt::Interrupt;
use crate::stdout::print_line;
use anyhow::{Result, ensure};
use std::path::PathBuf;

/// Label STEP files: parts by primitive type and dihedral angle, and a triangle mesh that carries them.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe label parts/ --out dataset/                     a folder, walked
  partprobe label a.step b.step --out dataset/ --jobs 4     files
  partprobe label list.txt --out dataset/ --unit solid      a text file with one path a line
  partprobe label parts/ --out dataset/ --set label.theta_deg=12

DATASET holds a carrier <id>.npz for each shape (numpy.load opens it), index.jsonl with a line a shape, dataset.json
with the settings, and timing.jsonl. One bad file never ends a batch: its line in the index says why.
Exit codes: 0 at least one carrier (with --strict: no bad file), 1 none, 2 wrong usage.")]
pub struct LabelArgs {
    /// STEP files, folders, or text files that list paths.
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, value_name = "DATASET")]
    out: PathBuf,
    /// What becomes a shape: the whole file, or each distinct solid.
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// The geometry kernel; the config's label.kernel if not given.
    #[arg(long, value_enum)]
    kernel: Option<Kernel>,
    /// Worker processes; as many as there are cores if not given. The data set does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Exit with 1 if any file has no carrier.
    #[arg(long)]
    strict: bool,
    /// Deflate the carriers.
    #[arg(long)]
    compress: bool,
    /// Replace a data set that is already there.
    #[arg(long)]
    force: bool,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example label.tau_min=0.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// What becomes a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Unit {
    /// All faces of a file.
    File,
    /// Each distinct solid of a file.
    Solid,
}

/// The geometry kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kernel {
    /// Partprobe's own.
    Own,
    /// The crates of truck, if they are built in (--features truck): a witness that reads fewer files, and whole ones only.
    Truck,
}

/// Labels, and prints what came of it.
///
/// # Errors
/// If no file could be labelled, or with `--strict` any could not.
pub fn label(args: &LabelArgs) -> Result<()> {
    let mut overrides = args.set.clone();
    overrides.extend(args.unit.map(|unit| match unit {
        Unit::File => "label.unit=file".to_owned(),
        Unit::Solid => "label.unit=solid".to_owned(),
    }));
    overrides.extend(args.kernel.map(|kernel| match kernel {
        Kernel::Own => "label.kernel=own".to_owned(),
        Kernel::Truck => "label.kernel=truck".to_owned(),
    }));
    overrides.extend(args.compress.then(|| "label.compress=true".to_owned()));
    let config = config::load(&args.config, &overrides)?.config.label;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let job = LabelJob::in_folder(&args.paths, &args.out, &config, args.jobs.map_or(cores, usize::from));
    let job = if args.force { job.replacing() } else { job };
    let summary = label_paths(&job, &Interrupt::listen()?)?;
    print_line(&summary)?;
    ensure!(summary.n_carriers > 0, "no file could be labelled; {} says why", args.out.join("index.jsonl").display());
    ensure!(!args.strict || summary.n_failed() == 0, "{} files or solids could not be labelled", summary.n_failed());
    Ok(())
}
