//! Runs `partprobe label`: defines its arguments, and prints the summary.

use crate::config::{self, Attribute, Config, Emit, by_flag};
use crate::counted::counted;
use crate::interrupt::Interrupt;
use crate::label::{LabelJob, Shard, label_paths};
use crate::output_folder::is_output_error;
use crate::standard_input::{STDIN_NAME, StandardInput, is_standard_input, with_standard_input};
use crate::stdout::print_line;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Result, ensure};
use partprobe_dataset::{SETTINGS_FILE, Status};
use std::path::PathBuf;

/// Label STEP files: group faces into parts by primitive type and dihedral angle, and write labeled triangle meshes.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe label parts/ --out dataset/                     a folder and its subfolders
  partprobe label a.step b.step --out dataset/ --jobs 4     files
  partprobe label list.txt --out dataset/ --unit solid      a text file with one path per line
  find . -name '*.stp' | partprobe label --list - --out dataset/
  curl https://example.org/bracket.step | partprobe label - --out dataset/ --stdin-name bracket
  partprobe label abc_0000.7z --out dataset/ --resume       an archive, started or resumed
  partprobe label abc/ --out share1/ --shard 1/4            a quarter of the files, for `merge`
  partprobe label abc/ --out dataset/ --retry over-budget,timed-out --set label.watchdog_s=3600
  partprobe label robot.step --out dataset/ --instances     every occurrence in an assembly
  partprobe label parts/ --out dataset/ --set label.theta_deg=12
  partprobe label parts/ --out dataset/ --attributes normal,uv,curvature
  partprobe label parts/ --out dataset/ --layers brep-face,smooth-12    labels of other sources, per face

STEP files have the endings .step .stp .p21 .ste, or compressed .stpz .step.gz .stp.zst .step.xz and similar ones, in upper or
lower case.
Archives (.zip .tar .tar.gz .tgz .tar.zst .tar.xz .7z) are read without unpacking them to disk, also inside folders. If the
content of a file does not match its name, the content decides. A file that is not read has a line in the index, too.
DATASET contains a carrier <id>.npz per shape (numpy.load opens it), index.jsonl with a line per shape, dataset.json with the
settings, and timing.jsonl. A bad file never ends a batch: its line in the index gives the reason.
Results are written to disk at once. After Ctrl-C, a kill or a power cut, --resume continues and gives the same bytes. `partprobe
status DATASET` shows the progress.
Exit codes: 0 at least one shape was labeled, or --shard was given (with --strict: and no file is bad), 1 no shape was labeled, 2
wrong usage, 130 stopped by Ctrl-C.
In a finished data set, --resume labels again the shapes that are missing, damaged or changed.")]
pub(crate) struct LabelArgs {
    /// STEP files (also compressed), archives of them, folders, or text files that list paths; `-` is the standard input.
    #[arg(required_unless_present = "list", value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// A file with one path per line. It is read as a list even if its lines do not look like paths. `-` is the standard input.
    #[arg(long, value_name = "FILE")]
    list: Vec<PathBuf>,
    /// A file name for the data that `-` reads. It gives the shape its id, and its ending gives the format. Without an ending,
    /// the first bytes give the format.
    #[arg(long, default_value = STDIN_NAME, value_name = "NAME")]
    stdin_name: String,
    /// The folder to write.
    #[arg(long, short, value_name = "DATASET")]
    out: PathBuf,
    /// What becomes a shape: the whole file, or each distinct solid.
    #[arg(long, value_enum)]
    unit: Option<Unit>,
    /// Place every occurrence of every product of an assembly; if not given, each product is labeled once.
    #[arg(long)]
    instances: bool,
    /// The geometry kernel; the config's label.kernel if not given.
    #[arg(long, value_enum)]
    kernel: Option<Kernel>,
    /// The number of worker processes; one per core if not given. The data set does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Exit with 1 if any file has no carrier.
    #[arg(long)]
    strict: bool,
    /// The properties of the true surfaces to store at each vertex, in addition to its position.
    #[arg(long, value_name = "LIST", value_enum, value_delimiter = ',')]
    attributes: Vec<Attribute>,
    /// Label sources whose labels of faces are also stored in the carriers, for example brep-face,smooth-12.
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    layers: Vec<String>,
    /// Compress the carriers with deflate.
    #[arg(long)]
    compress: bool,
    /// Replace an existing data set.
    #[arg(long, conflicts_with_all = ["resume", "retry"])]
    force: bool,
    /// Resume a data set that was started earlier with the same inputs and settings, or start one.
    #[arg(long)]
    resume: bool,
    /// Resume, and label the files with these statuses again; limits may be higher than before.
    #[arg(long, value_name = "STATUS", value_enum, value_delimiter = ',')]
    retry: Vec<Retry>,
    /// Label one share of the files: the I-th of N.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// What to write for each shape; several values are separated by commas.
    #[arg(long, value_enum, value_delimiter = ',')]
    emit: Vec<Emit>,
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

/// The outcomes that can be tried again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Retry {
    /// A budget was hit.
    OverBudget,
    /// The watchdog ended it.
    TimedOut,
    /// The worker process ended.
    Crashed,
    /// The file could not be labeled.
    Failed,
}

impl From<Retry> for Status {
    fn from(retry: Retry) -> Self {
        match retry {
            Retry::OverBudget => Self::OverBudget,
            Retry::TimedOut => Self::TimedOut,
            Retry::Crashed => Self::Crashed,
            Retry::Failed => Self::Failed,
        }
    }
}

/// The geometry kernels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kernel {
    /// The kernel of partprobe.
    Own,
    /// The crates of truck, an independent second kernel, if they are built in (--features truck). It reads fewer files, and
    /// labels only whole files.
    Truck,
}

/// Labels the files, and prints the result.
///
/// # Errors
/// If no file could be labeled and this is not a share of a batch, or with `--strict` any could not.
pub(crate) fn label(args: &LabelArgs) -> Result<()> {
    // The standard input is read before the handler of Ctrl-C is installed, so Ctrl-C ends the wait for it. The file exists as
    // long as the batch.
    let (job, _standard_input) = job(args)?;
    let summary =
        label_paths(&job, &Interrupt::listen()?).map_err(|error| with_advice(error, args))?;
    print_line(&summary)?;
    // A share without a shape is a part of its batch like any other. `merge` looks at the whole batch.
    if args.shard.is_none() {
        summary.ensure_labeled(&args.out)?;
    }
    let failed = counted(
        usize::try_from(summary.n_failed())?,
        "file or solid",
        "files or solids",
    );
    ensure!(
        !args.strict || summary.n_failed() == 0,
        "{failed} could not be labeled"
    );
    Ok(())
}

/// Adds advice on how to finish an incomplete data set to an error.
fn with_advice(error: anyhow::Error, args: &LabelArgs) -> anyhow::Error {
    if !is_output_error(&error) || !args.out.join(SETTINGS_FILE).exists() {
        return error;
    }
    error.context(format!(
        "{} is not complete; make room, then call again with --resume",
        args.out.display()
    ))
}

/// The job. The second value is the standard input, if it is also labeled.
fn job(args: &LabelArgs) -> Result<(LabelJob, Option<StandardInput>)> {
    let is_dash = |path: &PathBuf| is_standard_input(path);
    ensure!(
        !(args.paths.iter().any(is_dash) && args.list.iter().any(is_dash)),
        UsageError(
            "`-` is given as a file and as a list, and the standard input can be read only once"
                .to_owned()
        )
    );
    ensure!(
        args.stdin_name == STDIN_NAME || args.paths.iter().any(is_dash),
        UsageError(
            "--stdin-name names the standard input, which is not read; give `-` as a file"
                .to_owned()
        )
    );
    let config = job_config(args)?;
    let max_bytes = config.label.max_file_mb << 20;
    let (paths, input) = with_standard_input(&args.paths, &args.stdin_name, max_bytes)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let n_workers = args.jobs.map_or(cores, usize::from);
    let job = LabelJob::in_folder(&paths, &args.out, &config, n_workers);
    let job = job.with_lists(&args.list).of_shard(args.shard);
    let outcomes: Vec<Status> = args.retry.iter().map(|&retry| retry.into()).collect();
    let job = match (args.force, args.resume, outcomes.as_slice()) {
        (true, ..) => job.replacing(),
        (_, _, [_, ..]) => job.retrying(&outcomes),
        (_, true, []) => job.resuming(),
        _ => job,
    };
    Ok((job, input))
}

/// The settings of the config and of the arguments that replace settings.
fn job_config(args: &LabelArgs) -> Result<Config> {
    let mut overrides = args.set.clone();
    let unit = args.unit.map(|unit| match unit {
        Unit::File => "label.unit=file",
        Unit::Solid => "label.unit=solid",
    });
    let kernel = args.kernel.map(|kernel| match kernel {
        Kernel::Own => "label.kernel=own",
        Kernel::Truck => "label.kernel=truck",
    });
    overrides.extend(unit.map(|unit| by_flag("--unit", unit)));
    overrides.extend(kernel.map(|kernel| by_flag("--kernel", kernel)));
    for (flag, key, names) in [
        (
            "--attributes",
            "label.attributes",
            serde_json::to_string(&args.attributes)?,
        ),
        (
            "--layers",
            "label.layers",
            serde_json::to_string(&args.layers)?,
        ),
    ] {
        if names != "[]" {
            overrides.push(by_flag(flag, format!("{key}={names}")));
        }
    }
    let instances = args.instances.then_some("label.instances=true");
    let compress = args.compress.then_some("label.compress=true");
    overrides.extend(instances.map(|set| by_flag("--instances", set)));
    overrides.extend(compress.map(|set| by_flag("--compress", set)));
    let mut config = config::load(&args.config, &overrides)?.config;
    if !args.emit.is_empty() {
        config.label.emit.clone_from(&args.emit);
        config.check().map_err(as_usage_error)?;
    }
    Ok(config)
}
