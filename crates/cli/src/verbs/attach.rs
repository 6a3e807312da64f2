//! Runs `partprobe attach`: STEP files get the labels of a package, or are refused with their names.

use crate::config::{self, Config, Emit, LabelConfig};
use crate::counted::counted;
use crate::dataset_settings::settings_sha256;
use crate::interrupt::Interrupt;
use crate::label::{LabelJob, ReleasedLabels, label_paths};
use crate::label_package::LabelPackage;
use crate::output_folder::is_output_error;
use crate::stderr;
use crate::stdout::print_line;
use crate::usage::as_usage_error;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{Dataset, INDEX_FILE, IndexEntry, SETTINGS_FILE, Status};
use std::collections::BTreeSet;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The largest number of files that are named on stderr because they are not attached. The index names all of them.
const MAX_WARNINGS: usize = 10;

/// Join a package of released labels with STEP files: label the files with the settings of the package, and compare.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe attach package/ parts/ --out dataset/

Each file is found in the package by the SHA-256 of its STEP text. Its name and its compression do not matter. It is labeled with
the settings of the package, and gets the id that it has there. DATASET is the data set that the package was made from, without
the files that are missing here. Its carriers have the same bytes if the program is the same.
A file that the package does not have is refused by name (`refused` in the index). A shape with other labels than those of the
package has no carrier (`differs`), and the reason names the first face that differs.
Exit codes: 0 every file is attached or has no labels in the package either, 1 a file is not attached, 2 wrong usage, 130 stopped
by Ctrl-C.")]
pub(crate) struct AttachArgs {
    /// The package.
    #[arg(value_name = "PACKAGE")]
    package: PathBuf,
    /// STEP files (also compressed), archives of them, folders, or text files that list paths.
    #[arg(required_unless_present = "list", value_name = "PATH")]
    paths: Vec<PathBuf>,
    /// A file with one path per line; `-` is the standard input.
    #[arg(long, value_name = "FILE")]
    list: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, short, value_name = "DATASET")]
    out: PathBuf,
    /// The number of worker processes; one per core if not given. The data set does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Replace an existing data set.
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Resume a data set that was started earlier with the same package and inputs, or start one.
    #[arg(long)]
    resume: bool,
}

/// Labels the files, compares them, and prints the result.
///
/// # Errors
/// If the package is damaged, or any file is not attached.
pub(crate) fn attach(args: &AttachArgs) -> Result<()> {
    let package = LabelPackage::open(&args.package)?;
    package.check_files_without_labels()?;
    let config = config_of(&package)?;
    warn_of_other_version(&package);
    let released = Arc::new(ReleasedLabels::open(package)?);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let n_workers = args.jobs.map_or(cores, usize::from);
    let job = LabelJob::in_folder(&args.paths, &args.out, &config, n_workers)
        .with_lists(&args.list)
        .with_released(&released);
    let job = match (args.force, args.resume) {
        (true, _) => job.replacing(),
        (_, true) => job.resuming(),
        _ => job,
    };
    label_paths(&job, &Interrupt::listen()?).map_err(|error| with_advice(error, args))?;

    let dataset = Dataset::open_any(&args.out)?;
    let outcome = Outcome::of(dataset.entries(), &released);
    outcome.warn();
    print_line(format_args!("{}: {outcome}", args.out.display()))?;
    ensure!(
        outcome.problems.is_empty(),
        "{} not attached; {} says why",
        counted(
            outcome.problems.len(),
            "file or shape is",
            "files or shapes are"
        ),
        args.out.join(INDEX_FILE).display()
    );
    ensure!(outcome.n_attached > 0, "no file has labels in the package");
    Ok(())
}

/// The settings of a package, which write carriers.
fn config_of(package: &LabelPackage) -> Result<Config> {
    let manifest = &package.manifest;
    let label = &manifest.settings["label"];
    let root = package.root().display();
    ensure!(
        settings_sha256(label).as_ref() == Some(&manifest.settings_sha256),
        "{root}: the settings do not have the hash that `release.json` names; get the package again"
    );
    let label: LabelConfig = serde_json::from_value(label.clone()).with_context(|| {
        format!(
            "{root} was labeled by another version of partprobe, whose settings are not known here"
        )
    })?;
    let mut config = config::load("base", &[])?.config;
    config.label = LabelConfig {
        emit: vec![Emit::Carrier],
        ..label
    };
    config.check().map_err(as_usage_error)?;
    Ok(config)
}

fn warn_of_other_version(package: &LabelPackage) {
    let (theirs, ours) = (&package.manifest.program_version, env!("CARGO_PKG_VERSION"));
    if theirs != ours {
        stderr::print_line(format_args!(
            "warning: the package was labeled by partprobe {theirs}, and this is {ours}; labels may differ"
        ));
    }
}

/// Adds advice on how to finish an incomplete data set to an error.
fn with_advice(error: anyhow::Error, args: &AttachArgs) -> anyhow::Error {
    if !is_output_error(&error) || !args.out.join(SETTINGS_FILE).exists() {
        return error;
    }
    error.context(format!(
        "{} is not complete; make room, then call again with --resume",
        args.out.display()
    ))
}

/// The results of the files.
#[derive(Debug, Default)]
struct Outcome {
    n_attached: usize,
    /// Attached shapes whose carrier has the hash of the released one.
    n_identical: usize,
    /// Attached shapes of which the package has the hash of the carrier.
    n_compared: usize,
    /// Files and solids that also have no labels in the package.
    n_unlabeled: usize,
    /// The files that are not attached: source and reason.
    problems: Vec<(String, String)>,
    /// Files of the package that were not given.
    n_not_given: usize,
}

impl Outcome {
    fn of(entries: &[IndexEntry], released: &ReleasedLabels) -> Self {
        let mut outcome = Self::default();
        let mut given = BTreeSet::new();
        for entry in entries
            .iter()
            .filter(|entry| entry.status != Status::Skipped)
        {
            let shape = released.shape(&entry.id).map(|shape| &shape.shape);
            given.extend(shape.map(|shape| &shape.file_id));
            match (entry.status, shape) {
                (Status::Ok, Some(shape)) => {
                    outcome.n_attached += 1;
                    outcome.n_compared += usize::from(shape.content_hash.is_some());
                    let is_identical =
                        shape.content_hash.is_some() && shape.content_hash == entry.content_hash;
                    outcome.n_identical += usize::from(is_identical);
                }
                (status, Some(shape)) if shape.status == status.name() => {
                    outcome.n_unlabeled += 1;
                }
                _ => outcome.problems.push((
                    entry.source.clone(),
                    entry.reason.clone().unwrap_or_default(),
                )),
            }
        }
        let files: BTreeSet<&String> = released
            .shapes()
            .map(|shape| &shape.shape.file_id)
            .collect();
        outcome.n_not_given = files.difference(&given).count();
        outcome
    }

    fn warn(&self) {
        for (source, reason) in self.problems.iter().take(MAX_WARNINGS) {
            stderr::print_line(format_args!("warning: {source}: {reason}"));
        }
        if self.problems.len() > MAX_WARNINGS {
            stderr::print_line(format_args!(
                "warning: and {} more, see {INDEX_FILE}",
                self.problems.len() - MAX_WARNINGS
            ));
        }
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shapes = counted(self.n_attached, "shape", "shapes");
        writeln!(f, "{shapes} attached with equal labels")?;
        if self.n_compared > 0 {
            let (n, of) = (self.n_identical, self.n_compared);
            writeln!(f, "carriers identical to the released ones: {n} of {of}")?;
        }
        let n = self.n_unlabeled;
        writeln!(f, "without labels, as in the package: {n}")?;
        writeln!(f, "not attached: {}", self.problems.len())?;
        write!(
            f,
            "files of the package that were not given: {}",
            self.n_not_given
        )
    }
}
