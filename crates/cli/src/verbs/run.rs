//! Runs `partprobe run`: all stages, from STEP files or generated parts to the tables.

use crate::config::{Config, DataSource, load};
use crate::given_path::ensure_exists;
use crate::label::{LabelJob, label_paths};
use crate::run::{
    EndpointTables, Execution, ExecutionArgs, MachineArgs, Run, RunFolder, RunRecord, TrainingArgs,
    TrainingProcessArgs, checked_expectations, ensure_frozen_parts, ensure_initial_weights,
    ensure_settings_of, named_sources, page_of_run, remember_data, settings_of, today, with_data,
};
use crate::usage::UsageError;
use crate::verbs::synth::write_parts;
use anyhow::{Context, Result, bail};
use partprobe_dataset::Dataset;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Label, train one backbone per supervision, evaluate the backbones on held-out shapes, and print the tables.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe run smoke                           everything on generated parts, in minutes
  partprobe run abc-small --data abc/ fusion/   your own STEP files
  partprobe run my.toml --set train.steps=2000  your own config (see configs/base.toml for the keys)

Before the first training, the card of the label sources is printed, and written to source_card.md and source_card.json.
The run folder contains config.toml, split.json, log.jsonl, tensorboard/, checkpoints/, test/, predictions/, scores.jsonl,
tables.{md,csv,json} and report.html. A config's [expect] table bounds scores: expectations.{json,xml} say which bounds hold, and
the exit code is 3 if one is missed.")]
pub(crate) struct RunArgs {
    /// A shipped config or a TOML file. `partprobe config list` lists the shipped configs.
    #[arg(value_name = "NAME|FILE")]
    config: String,
    /// STEP files, folders, lists of paths, or a labeled data set. They replace `data.paths` of the config.
    #[arg(long, value_name = "PATH", num_args = 1..)]
    data: Vec<PathBuf>,
    /// The run folder; `runs/DATE-NAME` if not given.
    #[arg(long, short, value_name = "RUN")]
    out: Option<PathBuf>,
    /// Resume an interrupted run in the same folder.
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    training: TrainingArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
    /// The label source and the seed of each training that a repetition trains. `None` means all trainings of the config.
    #[arg(skip)]
    only: Option<Vec<(String, u64)>>,
}

impl RunArgs {
    /// The arguments that repeat a run, from the config in its folder.
    pub(super) fn of_folder(
        config: String,
        data: Vec<PathBuf>,
        out: PathBuf,
        only: Vec<(String, u64)>,
        (process, machine): (TrainingProcessArgs, MachineArgs),
    ) -> Self {
        Self {
            config,
            data,
            out: Some(out),
            resume: true,
            training: TrainingArgs::of_config(process),
            execution: ExecutionArgs {
                set: Vec::new(),
                machine,
            },
            only: Some(only),
        }
    }
}

/// Refuses the path of a manifest or of an endpoint's data set that does not exist, before anything is labeled.
fn ensure_named_paths(config: &Config) -> Result<()> {
    let manifest = &config.split.manifest;
    if !manifest.is_empty() {
        ensure_exists(Path::new(manifest))
            .map_err(|error| UsageError(format!("split.manifest: {error}")))?;
    }
    for endpoint in &config.endpoints {
        let Some(data) = &endpoint.data else { continue };
        ensure_exists(data)
            .map_err(|error| UsageError(format!("endpoints.{}.data: {error}", endpoint.name)))?;
    }
    Ok(())
}

/// Runs all stages. The exit code is 3 if an expectation is missed.
///
/// # Errors
/// If a stage fails. Finished work stays in the run folder, and `--resume` continues from there.
pub(crate) fn run(args: &RunArgs) -> Result<ExitCode> {
    let set = args.training.overrides(&args.execution.set);
    let loaded = load(&args.config, &set)?;
    let located = |error: anyhow::Error| loaded.located(&error);
    ensure_frozen_parts(&loaded.config).map_err(located)?;
    named_sources(&loaded.config).map_err(located)?;
    checked_expectations(&loaded.config).map_err(located)?;
    let data = given_data(args, &loaded.config)?;
    let loaded = with_data(&data, loaded, &args.config, &set)?;
    let data_set = match data.as_slice() {
        [path] if Dataset::is_at(path) => Some(settings_of(path)?),
        _ => None,
    };
    let root = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("runs").join(format!("{}-{}", today(), loaded.name)));
    let execution = Execution::new(&args.execution.machine)?;
    let supervision = &loaded.config.compare.supervision;
    ensure_initial_weights(&loaded.config, supervision, &root, execution.backend)?;
    let loaded = loaded.with_absolute_paths()?;
    ensure_named_paths(&loaded.config).map_err(|error| loaded.located(&error))?;
    let folder = RunFolder::open(&root, &loaded.merged, args.resume)?;
    let data_names = data.iter().map(|path| path.display().to_string()).collect();
    let mut timed = Stages {
        record: RunRecord::new(&execution, data_names, data_set),
    };
    timed.record.begin_run(&folder)?;
    let dataset = timed.stage("label", || {
        labeled_data(&data, &loaded.config, &folder, &execution)
    })?;
    ensure_settings_of(dataset.root(), &loaded)?;
    if let Some(settings) = &loaded.config.implicit {
        timed.stage("implicit", || {
            crate::implicit::run(&dataset, &loaded.config, settings, &folder, &execution)
        })?;
        timed.record.write(&folder)?;
        return Ok(ExitCode::SUCCESS);
    }
    let points = args.training.process.points();
    let mut run = timed.stage("sample", || {
        Run::new(&dataset, &loaded.config, &folder, &execution, points)
    })?;
    run.check_endpoints()?;
    remember_data(&folder, dataset.root())?;
    run.note_weak_split()?;
    run.note_collisions()?;
    run.note_source_card()?;
    let trainings = args
        .only
        .clone()
        .unwrap_or_else(|| trainings(&loaded.config));
    for (supervision, seed) in trainings {
        let name = format!("train {supervision}-{seed}");
        timed.stage(&name, || {
            run.train(&supervision, seed, &args.training.process)
        })?;
    }
    let rows = timed.stage("evaluate", || run.evaluate())?;
    timed.record.write(&folder)?;
    let results = run.write_results(&rows)?;
    if loaded.config.endpoints.is_empty() {
        return run.print_results(&results, EndpointTables::default());
    }
    let endpoints = timed.stage("endpoints", || run.evaluate_endpoints())?;
    timed.record.write(&folder)?;
    // The page lists the stages, and there is one more stage now.
    folder.write("report.html", page_of_run(&folder, None)?.as_bytes())?;
    run.print_results(&results, endpoints)
}

/// Times the stages for `run.json`.
struct Stages {
    record: RunRecord,
}

impl Stages {
    fn stage<T>(&mut self, name: &str, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let begun = Instant::now();
        let done = work().with_context(|| format!("stage `{name}`"));
        self.record
            .stage_seconds
            .push((name.to_owned(), begun.elapsed().as_secs_f64()));
        done
    }
}

/// The paths of the data, which are checked before a folder is made. There are none if parts are generated.
fn given_data(args: &RunArgs, config: &Config) -> Result<Vec<PathBuf>> {
    let given = if args.data.is_empty() {
        &config.data.paths
    } else {
        &args.data
    };
    if given.is_empty() && config.data.source == DataSource::Paths {
        bail!(UsageError(
            "no data: give --data PATH, or set data.source=synth".to_owned()
        ));
    }
    given.iter().try_for_each(|path| ensure_exists(path))?;
    Ok(given.clone())
}

/// The labeled data set: given by the user, or labeled into the run folder.
fn labeled_data(
    given: &[PathBuf],
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<Dataset> {
    if let [path] = given
        && Dataset::is_at(path)
    {
        return Ok(Dataset::open(path)?);
    }
    let out = folder.path("data/carriers");
    if Dataset::is_at(&out) {
        return Ok(Dataset::open(&out)?);
    }
    let paths = if given.is_empty() {
        let parts = folder.path("data/step");
        write_parts(&parts, &config.synth, &execution.progress)?;
        vec![parts]
    } else {
        given.to_vec()
    };
    labeled_into(&out, &paths, config, execution)
}

/// Labels files into a folder. Files that an interrupted call has labeled there are kept.
///
/// # Errors
/// If the files cannot be labeled, or the folder has a data set of other files.
pub(super) fn labeled_into(
    out: &Path,
    paths: &[PathBuf],
    config: &Config,
    execution: &Execution,
) -> Result<Dataset> {
    // An interrupted run is resumed with the same data as at its start.
    let job = LabelJob::in_folder(paths, out, config, execution.threads).resuming();
    let summary = label_paths(&job, &execution.interrupt)?;
    execution.progress.note(&summary.to_string());
    Ok(Dataset::open(out)?)
}

/// The trainings in their order: seed by seed, supervision by supervision.
pub(super) fn trainings(config: &Config) -> Vec<(String, u64)> {
    let of_seed = |&seed: &u64| {
        config
            .compare
            .supervision
            .iter()
            .map(move |name| (name.clone(), seed))
    };
    config.compare.seeds.iter().flat_map(of_seed).collect()
}
