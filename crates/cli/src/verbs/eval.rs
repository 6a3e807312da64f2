//! Runs `partprobe eval`: it scores the trained backbones of a run folder again.

use crate::config::{Config, Difference, differences, load, shown};
use crate::run::{
    Execution, ExecutionArgs, Run, RunFolder, checked_expectations, ensure_settings_of,
    ensure_source_of_run, is_scoring, named_sources, remembered_data,
};
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_dataset::Dataset;
use std::path::PathBuf;
use std::process::ExitCode;

/// Score the trained backbones of a run folder again, and write its tables.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe eval runs/mine --set eval.restarts=30

--set accepts the keys for scoring backbones: compare.*, endpoints, eval.*, expect.*, net.refine, sources.*, tokens.test_poses and
tokens.test_tokens. The values stay in the config of the run folder. To return to former values, set them again.")]
pub(crate) struct EvalArgs {
    /// The run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The labeled data set, if it has moved since the run.
    #[arg(long, value_name = "DATASET")]
    data: Option<PathBuf>,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Evaluates the trained backbones of the folder. The exit code is 3 if an expectation is missed.
///
/// # Errors
/// If the folder is not a run, or its data set cannot be read.
pub(crate) fn eval(args: &EvalArgs) -> Result<ExitCode> {
    let folder = RunFolder::existing(&args.run)?;
    let config_file = folder.path("config.toml").to_string_lossy().into_owned();
    let loaded = load(&config_file, &args.execution.set)?.with_absolute_paths()?;
    loaded.config.ensure_point_probe()?;
    let stored = load(&config_file, &[])?.config;
    refuse_new_settings(&stored, &loaded.config)?;
    for source in &loaded.config.compare.supervision {
        if !stored.compare.supervision.contains(source) {
            ensure_source_of_run(folder.root(), &loaded.config, source)?;
        }
    }
    named_sources(&loaded.config).map_err(|error| loaded.located(&error))?;
    checked_expectations(&loaded.config).map_err(|error| loaded.located(&error))?;
    let execution = Execution::new(&args.execution.machine)?;
    let data = match &args.data {
        Some(path) => path.clone(),
        None => remembered_data(&folder)?,
    };
    let dataset = Dataset::open(&data)?;
    ensure_settings_of(&data, &loaded)?;
    let run = Run::to_score(&dataset, &loaded.config, &folder, &execution)?;
    run.check_endpoints()?;
    let rows = run.evaluate()?;
    if !args.execution.set.is_empty() {
        // The scores below depend on these settings, so the folder must have the same settings.
        folder.write("config.toml", loaded.merged.as_bytes())?;
    }
    let results = run.write_results(&rows)?;
    run.print_results(&results, run.evaluate_endpoints()?)
}

/// Refuses new values of settings that influenced the training, because the run's config would then be wrong.
fn refuse_new_settings(stored: &Config, requested: &Config) -> Result<()> {
    let fixed: Vec<String> = differences(stored, requested)
        .into_iter()
        .filter(|difference| !is_scoring(&difference.key))
        .map(|Difference { key, here, there }| {
            let [here, there] = [&here, &there].map(shown);
            format!("{key} is {here} in this run and cannot become {there}")
        })
        .collect();
    ensure!(
        fixed.is_empty(),
        UsageError(format!(
            "{}: it decided which shapes were trained on, and how; make a new run folder for another value",
            fixed.join("; ")
        ))
    );
    Ok(())
}
