//! Runs `partprobe false-alarms`: counts how often trainings on one label source, which differ only in their seeds, seem to
//! differ.

use crate::config::load;
use crate::run::verdict_settings;
use crate::scored_run::ScoredRun;
use crate::stdout::{print_line, print_result};
use crate::usage::UsageError;
use anyhow::{Context, Result};
use partprobe_dataset::{json_document, write_atomically};
use partprobe_eval::{FalseAlarms, false_alarms};
use std::path::PathBuf;

/// Count how often trainings that differ only in their seeds are judged to be different (an A/A test)
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe false-alarms runs/aa

The run must have at least six seeds of one label source:
  partprobe run verdict --data dataset/ --set 'compare.supervision=[\"step-parts\"]' --set 'compare.seeds=[0,1,2,3,4,5]'")]
pub(crate) struct FalseAlarmsArgs {
    /// A finished run.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// Also write the counts as JSON to this file.
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Counts and prints.
///
/// # Errors
/// If the folder is not a finished run, or has too few seeds.
pub(crate) fn false_alarms_of(args: &FalseAlarmsArgs) -> Result<()> {
    let run = ScoredRun::read(&args.run)?;
    let config_file = args.run.join("config.toml");
    let config = load(&config_file.to_string_lossy(), &[])?.config;
    let supervision = &config.compare.supervision[0];
    let settings = verdict_settings(&config, [supervision.clone(), supervision.clone()]);
    let found = false_alarms(&run.rows, supervision, &settings).with_context(|| {
        UsageError(format!(
            "{} has too few trainings on `{supervision}`, or too few files; six seeds and ten files are needed",
            args.run.display()
        ))
    })?;
    if let Some(path) = &args.out {
        write_atomically(path, &json_document(&found)?)
            .with_context(|| format!("writing {}", path.display()))?;
    }
    if args.json {
        return print_line(String::from_utf8_lossy(&json_document(&found)?).trim_end());
    }
    print_result(text(&found))
}

fn text(found: &FalseAlarms) -> String {
    let FalseAlarms {
        supervision,
        n_seeds,
        n_pairs,
        n_false_pairs,
        n_verdicts,
        n_false_verdicts,
        seed_deviation,
    } = found;
    format!(
        "{n_seeds} trainings on `{supervision}` that differ in their seeds alone:\n\
         {n_false_pairs} of {n_pairs} pairs of trainings differ with p < 0.05.\n\
         {n_false_verdicts} of {n_verdicts} verdicts between three seeds and three others are false.\n\
         The standard deviation of a difference between two trainings is {seed_deviation:.4}."
    )
}
