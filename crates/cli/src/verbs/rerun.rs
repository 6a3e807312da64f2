//! Runs `partprobe rerun`: it repeats a run only from its folder, and compares the results byte by byte.

use crate::config::{Config, DataSource, load};
use crate::counted::counted;
use crate::run::{MachineArgs, RunFolder, TrainingProcessArgs, remembered_data, weights_path};
use crate::stderr;
use crate::stdout::print_result;
use crate::usage::UsageError;
use crate::verbs::run::{RunArgs, run, trainings};
use anyhow::{Context, Result, ensure};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The largest number of different files whose names are printed.
const MAX_NAMED: usize = 10;

/// Repeat a run from its folder alone, and compare weights, predictions and scores byte for byte
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe rerun runs/mine --out runs/again

The config, the split, the seeds and the path of the data set are those of the folder. Generated parts are generated again. The
number of threads does not matter. Exit codes: 0 all files are the same, 1 a file differs.")]
pub(crate) struct RerunArgs {
    /// The run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The folder of the new run; `RUN-again` if not given.
    #[arg(long, short, value_name = "RUN")]
    out: Option<PathBuf>,
    /// Resume a repetition that was interrupted.
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    training: TrainingProcessArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

/// Repeats and compares.
///
/// # Errors
/// If the folder is not a finished run, or a stage fails.
pub(crate) fn rerun(args: &RerunArgs) -> Result<ExitCode> {
    let config_file = args.run.join("config.toml");
    ensure!(
        config_file.is_file(),
        UsageError(format!(
            "{} is not a run folder: it has no config.toml",
            args.run.display()
        ))
    );
    let config = load(&config_file.to_string_lossy(), &[])?.config;
    config.ensure_point_probe()?;
    ensure!(
        args.run.join("scores.jsonl").is_file(),
        UsageError(format!(
            "{} has no scores; only a finished run can be compared",
            args.run.display()
        ))
    );
    let out = args.out.clone().unwrap_or_else(|| with_again(&args.run));
    if !args.resume {
        begin_again(&args.run, &out)?;
    }
    let repeated = RunArgs::of_folder(
        config_file.to_string_lossy().into_owned(),
        data_of(&args.run)?,
        out.clone(),
        finished_trainings(&args.run, &config),
        (args.training.clone(), args.machine.clone()),
    );
    // A missed bound is a result that is also compared.
    run(&repeated)?;

    let differing = differing_files(&args.run, &out)?;
    for (name, difference) in differing.names.iter().take(MAX_NAMED) {
        print_result(format_args!("{difference}: {name}"))?;
    }
    let n_differing = differing.names.len();
    print_result(format_args!(
        "{} compared, {n_differing} of them differ",
        counted(differing.n_compared, "file", "files")
    ))?;
    Ok(if n_differing == 0 {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

/// The trainings of the run that have weights. Others are named, and not trained, because there is nothing to compare them with.
fn finished_trainings(run: &Path, config: &Config) -> Vec<(String, u64)> {
    let is_finished =
        |(supervision, seed): &(String, u64)| run.join(weights_path(supervision, *seed)).is_file();
    let (finished, others): (Vec<_>, Vec<_>) = trainings(config).into_iter().partition(is_finished);
    for (supervision, seed) in others {
        stderr::print_line(format_args!(
            "{supervision}, seed {seed}: the run has no weights of it, so it is not trained"
        ));
    }
    finished
}

/// Makes the new folder with the inputs of the run: its config, and its split, which was not changed by an evaluation against
/// other references.
fn begin_again(run: &Path, out: &Path) -> Result<()> {
    ensure!(
        !out.exists(),
        UsageError(format!(
            "{} is there already; choose another --out, or --resume",
            out.display()
        ))
    );
    fs::create_dir_all(out).with_context(|| format!("making {}", out.display()))?;
    for file in ["config.toml", "split.json"] {
        fs::copy(run.join(file), out.join(file))
            .with_context(|| format!("copying {}", run.join(file).display()))?;
    }
    Ok(())
}

fn with_again(run: &Path) -> PathBuf {
    let name = run.file_name().unwrap_or_default().to_string_lossy();
    run.with_file_name(format!("{name}-again"))
}

/// The data set of the run, or nothing if the run generated its parts.
fn data_of(path: &Path) -> Result<Vec<PathBuf>> {
    let folder = RunFolder::open_read_only(path)?;
    let config = load(&folder.path("config.toml").to_string_lossy(), &[])?.config;
    let data = remembered_data(&folder)?;
    let is_own = data.starts_with(folder.root());
    Ok(if is_own && config.data.source == DataSource::Synth {
        Vec::new()
    } else {
        vec![data]
    })
}

/// The result of a comparison of two run folders.
struct Comparison {
    n_compared: usize,
    /// The files that are not the same, and how they differ.
    names: Vec<(String, &'static str)>,
}

/// Compares all files that a run makes from its numbers. Logs and times are left out.
fn differing_files(first: &Path, second: &Path) -> Result<Comparison> {
    let mut names: BTreeSet<String> = BTreeSet::new();
    for root in [first, second] {
        for folder in ["checkpoints", "predictions", "test"] {
            add_files(root, &root.join(folder), &mut names)?;
        }
        names.insert("scores.jsonl".to_owned());
    }
    let content = |root: &Path, name: &str| fs::read(root.join(name)).ok();
    let compared = |name: &String| {
        let difference = match (content(first, name), content(second, name)) {
            (first, second) if first == second => return None,
            (Some(first), Some(second)) if values(name, &first) == values(name, &second) => {
                "differs in the settings that it records, not in its values"
            }
            (Some(_), Some(_)) => "differs",
            (None, _) => "is in the new run only",
            (_, None) => "is missing in the new run",
        };
        Some((name.clone(), difference))
    };
    Ok(Comparison {
        n_compared: names.len(),
        names: names.iter().filter_map(compared).collect(),
    })
}

/// The values of a file: all of its bytes, or those behind the header of a safetensors file, whose length its first eight bytes
/// tell.
fn values<'a>(name: &str, bytes: &'a [u8]) -> &'a [u8] {
    let header = match bytes.first_chunk() {
        Some(&length) if name.ends_with(".safetensors") => {
            8_usize.saturating_add(u64::from_le_bytes(length) as usize)
        }
        _ => 0,
    };
    bytes.get(header..).unwrap_or(bytes)
}

/// The weights and arrays below a folder.
fn add_files(root: &Path, folder: &Path, names: &mut BTreeSet<String>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            add_files(root, &path, names)?;
            continue;
        }
        let is_result = path
            .extension()
            .is_some_and(|ending| ending == "npz" || ending == "safetensors");
        if let (true, Ok(name)) = (is_result, path.strip_prefix(root)) {
            names.insert(name.to_string_lossy().into_owned());
        }
    }
    Ok(())
}
