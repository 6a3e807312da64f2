//! Runs `partprobe train`: it trains one backbone per seed on one label source, into a run folder.

use crate::config::load;
use crate::run::{
    Execution, ExecutionArgs, Run, RunFolder, RunRecord, TrainingArgs, ensure_frozen_parts,
    ensure_initial_weights, ensure_source_of_run, remember_data, settings_of, weights_path,
    with_data,
};
use crate::stdout::print_result;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Result, ensure};
use partprobe_dataset::Dataset;
use std::path::PathBuf;
use std::process::ExitCode;

/// Train one backbone on one supervision, and write it into a run folder.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe train abc-small --data carriers/ --supervision step-parts --out runs/mine
Train the second source into the same folder with --resume, then `partprobe eval runs/mine`.
--resume --set train.steps=N makes a finished training longer, if its schedule allows it."
)]
pub(crate) struct TrainArgs {
    /// A shipped config or a TOML file. `partprobe config list` lists the shipped configs.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// The labeled data set (`partprobe label` makes one).
    #[arg(long, value_name = "DATASET")]
    data: PathBuf,
    /// The label source to train on; it must be listed in the config's compare.supervision.
    #[arg(long, value_name = "SOURCE")]
    supervision: String,
    /// The run folder.
    #[arg(long, short, value_name = "RUN")]
    out: PathBuf,
    /// Resume an interrupted training, or train another source of compare.supervision into the same folder.
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    training: TrainingArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Trains each seed of one supervision source.
///
/// # Errors
/// If the data set cannot be read, or training fails. The last checkpoint is kept.
pub(crate) fn train(args: &TrainArgs) -> Result<ExitCode> {
    let set = args.training.overrides(&args.execution.set);
    let loaded = load(&args.config, &set)?;
    loaded.config.ensure_point_probe()?;
    ensure_frozen_parts(&loaded.config).map_err(|error| loaded.located(&error))?;
    let source = &args.supervision;
    loaded
        .config
        .ensure_known_source(source)
        .map_err(|error| as_usage_error(error.context("--supervision")))?;
    ensure_source_of_run(&args.out, &loaded.config, source)?;
    let known = &loaded.config.compare.supervision;
    ensure!(
        known.contains(&args.supervision),
        UsageError(format!(
            "`{}` is not in compare.supervision ({}); add it with --set 'compare.supervision={}'",
            args.supervision,
            known.join(", "),
            toml::Value::from([known.as_slice(), std::slice::from_ref(&args.supervision)].concat())
        ))
    );
    // This is checked before the folder is made, so that a mistyped path does not leave a folder behind.
    let dataset = Dataset::open(&args.data)?;
    let loaded = with_data(std::slice::from_ref(&args.data), loaded, &args.config, &set)?;
    let execution = Execution::new(&args.execution.machine)?;
    let supervision = std::slice::from_ref(&args.supervision);
    ensure_initial_weights(&loaded.config, supervision, &args.out, execution.backend)?;
    let loaded = loaded.with_absolute_paths()?;
    let config = &loaded.config;
    let folder = RunFolder::open(&args.out, &loaded.merged, args.resume)?;
    let data = vec![args.data.display().to_string()];
    RunRecord::new(&execution, data, Some(settings_of(&args.data)?)).begin_training(&folder)?;
    let points = args.training.process.points();
    let mut run = Run::new(&dataset, config, &folder, &execution, points)?;
    remember_data(&folder, &args.data)?;
    run.note_weak_split()?;
    run.note_collisions()?;
    run.note_source_card()?;
    for &seed in &config.compare.seeds {
        run.train(&args.supervision, seed, &args.training.process)?;
        print_result(
            folder
                .path(&weights_path(&args.supervision, seed))
                .display(),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}
