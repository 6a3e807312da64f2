//! Trains both sources seed by seed, and looks at the scores after each seed.

use super::budget::{Budget, Speed};
use super::mine::Mine;
use super::sentence::Finding;
use crate::MISSED_BOUND;
use crate::config::{LoadedConfig, load};
use crate::given_path::ensure_exists;
use crate::run::{
    Execution, ExecutionArgs, Run, RunFolder, TrainingArgs, error_rate, measured_false_alarms,
    named_sources, remember_data, today, verdict_settings, with_data,
};
use crate::run_path::RUN_OF_VERDICT;
use crate::stdout::{print_line, print_result};
use crate::usage::UsageError;
use crate::verbs::run::labeled_into;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{Dataset, json_document};
use partprobe_eval::{FalseAlarms, LOOK_LIMITS, Look, ScoreRow, Verdict, VerdictSettings, look};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Decide within a time budget whether one label source trains better backbones than another
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe verdict --mine labels/ --data parts/ --budget 60m           your label files against step-parts
  partprobe verdict --mine ward-20 --against step-parts --data dataset/ two known sources

Both sources train the same network on the same shapes, with up to three seeds. After each seed the scores on held-out shapes are
tested, and the trainings stop as soon as the difference is larger than chance explains. OUT/run is a run folder: `partprobe eval
OUT/run` adds all tables. Exit codes: 0 a verdict was printed, 3 the verdict is not that of --expect.")]
pub(crate) struct VerdictArgs {
    /// The label source to judge: a name (see `partprobe sources`), or a file or folder of labels.
    #[arg(long, value_name = "SOURCE|PATH")]
    mine: String,
    /// The type of the label files; if not given, it is the only type with which the labels join.
    #[arg(long = "type", value_name = "TYPE")]
    import_type: Option<String>,
    /// The label source to compare with.
    #[arg(long, value_name = "SOURCE", default_value = "step-parts")]
    against: String,
    /// Score only against this label source; if not given, score against both compared sources, so that neither has an advantage.
    #[arg(long, value_name = "SOURCE")]
    referee: Option<String>,
    /// STEP files, folders, lists of paths, or a labeled data set.
    #[arg(long, value_name = "PATH", num_args = 1.., required = true)]
    data: Vec<PathBuf>,
    /// The time for all trainings and scores, for example 60m or 2h. The program first measures its speed, and then chooses the
    /// number of updates. If the trainings turn out to be slower, a seed that would end more than a quarter later is not trained.
    #[arg(long, value_name = "TIME", default_value = "60m", value_parser = time)]
    budget: Duration,
    /// The number of updates of each training, instead of --budget. The verdict then does not depend on the machine.
    #[arg(long, value_name = "N", conflicts_with = "budget")]
    updates: Option<usize>,
    /// Files whose names are equal up to this text are one collection, which stays on one side of the split. With an empty text,
    /// each file is a collection.
    #[arg(long, value_name = "TEXT", default_value = "")]
    collection_separator: String,
    /// Exit with 3 if the verdict is a different one.
    #[arg(long, value_enum, value_name = "VERDICT")]
    expect: Option<Expected>,
    /// The folder to write; `runs/DATE-verdict` if not given.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Resume an interrupted verdict in the same folder.
    #[arg(long)]
    resume: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    training: TrainingArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// The verdicts that a job can ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Expected {
    Better,
    NotWorse,
}

/// The number of updates of the training that measures the speed.
const SPEED_UPDATES: usize = 50;

/// `verdict.json`: the verdict, all looks, and the settings of the comparison.
#[derive(Serialize)]
struct VerdictFile<'a> {
    mine: &'a str,
    against: &'a str,
    referees: &'a [String],
    updates: usize,
    verdict: Verdict,
    looks: &'a [Look],
    is_stopped_by_budget: bool,
    false_alarms: &'a FalseAlarms,
    sentence: &'a str,
}

/// Trains, evaluates the scores, and prints the verdict.
///
/// # Errors
/// If the sources are unknown, the budget is too small, or a stage fails. `--resume` continues.
pub(crate) fn verdict(args: &VerdictArgs) -> Result<ExitCode> {
    let begun = Instant::now();
    let execution = Execution::new(&args.execution.machine)?;
    let root = args
        .out
        .clone()
        .unwrap_or_else(|| Path::new("runs").join(format!("{}-verdict", today())));
    let is_started = root.join(RUN_OF_VERDICT).join("split.json").exists();
    ensure!(
        args.resume || !is_started,
        UsageError(format!(
            "{} holds a verdict that was started; resume it with --resume, or choose another --out",
            root.display()
        ))
    );
    let dataset = labeled(args, &root, &execution)?;
    let session = Session::new(args, &root, &dataset, &execution)?;
    let budget = Budget {
        begun,
        total: args.budget,
    };
    let n_updates = session.updates(budget)?;
    // Without a budget of its own, and for a resumed verdict, all seeds are trained.
    let has_budget = args.updates.is_none() && !args.resume;
    session.decide(n_updates, has_budget.then_some(budget))
}

/// The labeled data set: given by the user, or labeled into the folder.
fn labeled(args: &VerdictArgs, root: &Path, execution: &Execution) -> Result<Dataset> {
    if let [path] = args.data.as_slice()
        && Dataset::is_at(path)
    {
        return Ok(Dataset::open(path)?);
    }
    args.data.iter().try_for_each(|path| ensure_exists(path))?;
    let config = load("verdict", &[])?.config;
    labeled_into(&root.join("data"), &args.data, &config, execution)
}

/// A verdict in progress.
struct Session<'a> {
    args: &'a VerdictArgs,
    root: &'a Path,
    dataset: &'a Dataset,
    execution: &'a Execution,
    mine: Mine,
    false_alarms: FalseAlarms,
}

impl<'a> Session<'a> {
    fn new(
        args: &'a VerdictArgs,
        root: &'a Path,
        dataset: &'a Dataset,
        execution: &'a Execution,
    ) -> Result<Self> {
        let mine = Mine::find(
            &args.mine,
            args.import_type.as_deref(),
            dataset.root(),
            &args.execution.set,
        )?;
        ensure!(
            mine.name != args.against,
            UsageError(format!("`{}` is compared with itself", mine.name))
        );
        if let Some(hint) = &mine.hint {
            execution.progress.note(hint);
        }
        Ok(Self {
            args,
            root,
            dataset,
            execution,
            mine,
            false_alarms: measured_false_alarms()?,
        })
    }

    /// The names of both sources.
    fn compared(&self) -> [&str; 2] {
        [&self.mine.name, &self.args.against]
    }

    /// The config of the trainings.
    fn config(&self, n_updates: usize) -> Result<LoadedConfig> {
        let args = self.args;
        let quoted = |text: &str| toml::Value::from(text).to_string();
        let (mine, against) = (quoted(&self.mine.name), quoted(&args.against));
        let referees = match &args.referee {
            Some(referee) => quoted(referee),
            None => format!("{against}, {mine}"),
        };
        let mut overrides = self.mine.overrides.clone();
        overrides.extend([
            format!("compare.supervision=[{mine}, {against}]"),
            format!("compare.references=[{referees}]"),
            // Both sources are referees themselves unless another one is given.
            format!(
                "compare.score_against_supervisions={}",
                args.referee.is_none()
            ),
            format!("train.steps={n_updates}"),
            format!(
                "split.collection_separator={}",
                quoted(&args.collection_separator)
            ),
        ]);
        overrides.extend(args.execution.set.iter().cloned());
        let loaded = load("verdict", &overrides)?;
        named_sources(&loaded.config).map_err(|error| loaded.located(&error))?;
        let data = [self.dataset.root().to_path_buf()];
        with_data(&data, loaded, "verdict", &overrides)?.with_absolute_paths()
    }

    /// The number of updates: that of a resumed verdict, the requested one, or the largest one that fits into the budget.
    fn updates(&self, budget: Budget) -> Result<usize> {
        let config_file = self.root.join(RUN_OF_VERDICT).join("config.toml");
        if config_file.exists() {
            let steps = load(&config_file.to_string_lossy(), &[])?
                .config
                .train
                .steps;
            ensure!(
                self.args.updates.is_none_or(|updates| updates == steps),
                UsageError(format!(
                    "this verdict trains with {steps} updates; resume it without --updates, or choose another --out"
                ))
            );
            return Ok(steps);
        }
        if let Some(n_updates) = self.args.updates {
            return Ok(n_updates);
        }
        let speed = self.speed()?;
        speed.updates_within(budget.left()).map_err(|least| {
            let minutes = (least + budget.begun.elapsed()).as_secs_f64() / 60.0;
            anyhow::Error::from(UsageError(format!(
                "a budget of {:.0} minutes is too small for these shapes; give at least {:.0}m",
                budget.total.as_secs_f64() / 60.0,
                minutes.ceil()
            )))
        })
    }

    /// Measures the speed with a short training in a folder that is removed afterwards.
    fn speed(&self) -> Result<Speed> {
        let path = self.root.join("speed");
        let is_new = !self.root.exists();
        let loaded = self.config(SPEED_UPDATES)?;
        if path.exists() {
            fs::remove_dir_all(&path)?;
        }
        let folder = RunFolder::open(&path, &loaded.merged, false)?;
        let mut run = self.run(&loaded, &folder)?;
        if let Err(error) = ensure_decidable(&run, self.compared(), &path) {
            if is_new {
                remove_if_empty(self.root);
            }
            return Err(error);
        }
        let seed = loaded.config.compare.seeds[0];
        run.train(&self.mine.name, seed, &self.args.training.process)?;
        let boundaries = run.boundaries()?;
        let begun = Instant::now();
        run.score_trained(&self.mine.name, seed, &boundaries)?;
        let speed = Speed::of_log(&folder, begun.elapsed())?;
        drop(run);
        drop(folder);
        fs::remove_dir_all(&path)?;
        if is_new {
            remove_if_empty(self.root);
        }
        Ok(speed)
    }

    fn run<'b>(&'b self, loaded: &'b LoadedConfig, folder: &'b RunFolder) -> Result<Run<'b>> {
        let points = self.args.training.process.points();
        Run::new(self.dataset, &loaded.config, folder, self.execution, points)
    }

    /// Trains seed by seed until a look decides, and prints the result.
    fn decide(&self, n_updates: usize, budget: Option<Budget>) -> Result<ExitCode> {
        let loaded = self.config(n_updates)?;
        let folder = RunFolder::open(
            &self.root.join(RUN_OF_VERDICT),
            &loaded.merged,
            self.args.resume,
        )?;
        let mut run = self.run(&loaded, &folder)?;
        ensure_decidable(&run, self.compared(), folder.root())?;
        remember_data(&folder, self.dataset.root())?;
        let settings = VerdictSettings {
            seed_deviation: self.false_alarms.seed_deviation,
            ..verdict_settings(
                &loaded.config,
                [self.mine.name.clone(), self.args.against.clone()],
            )
        };

        let boundaries = run.boundaries()?;
        let begun = Instant::now();
        let mut rows: Vec<ScoreRow> = Vec::new();
        let mut looks: Vec<Look> = Vec::new();
        let mut time_per_seed = Duration::ZERO;
        let mut stopped_after = None;
        for &seed in &loaded.config.compare.seeds {
            for source in &loaded.config.compare.supervision {
                run.train(source, seed, &self.args.training.process)?;
                rows.extend(run.score_trained(source, seed, &boundaries)?);
            }
            let found = look(&rows, &settings)?;
            self.execution.progress.note(&progress_line(&found));
            let is_last = found.is_last();
            looks.push(found);
            time_per_seed = begun.elapsed() / looks.len() as u32;
            if is_last {
                break;
            }
            if budget.is_some_and(|budget| budget.is_too_short_for(time_per_seed)) {
                stopped_after = Some(looks.len());
                break;
            }
        }
        let last = looks.last().context("no seed to train with")?;
        let finding = Finding {
            mine: &self.mine.name,
            against: &self.args.against,
            references: &settings.references,
            n_updates,
            look: last,
            time_per_seed,
        };
        let sentence = [Some(finding.sentence()), stopped_after.map(stop_sentence)];
        let sentence: Vec<String> = sentence.into_iter().flatten().collect();
        let sentence = sentence.join("\n");
        self.report(&VerdictFile {
            mine: &self.mine.name,
            against: &self.args.against,
            referees: &settings.references,
            updates: n_updates,
            verdict: last.verdict,
            looks: &looks,
            is_stopped_by_budget: stopped_after.is_some(),
            false_alarms: &self.false_alarms,
            sentence: &sentence,
        })?;
        Ok(self.exit_code(last.verdict))
    }

    /// Writes `verdict.json`, and prints it or its sentence.
    fn report(&self, file: &VerdictFile<'_>) -> Result<()> {
        let json = json_document(file)?;
        let path = self.root.join("verdict.json");
        partprobe_dataset::write_atomically(&path, &json)
            .with_context(|| format!("writing {}", path.display()))?;
        if self.args.json {
            return print_line(String::from_utf8_lossy(&json).trim_end());
        }
        print_result(format_args!(
            "{}\n{}\nfolder: {}",
            file.sentence,
            error_rate(file.false_alarms),
            self.root.display()
        ))
    }

    fn exit_code(&self, verdict: Verdict) -> ExitCode {
        let is_met = match self.args.expect {
            None => true,
            Some(Expected::Better) => verdict == Verdict::Better,
            Some(Expected::NotWorse) => verdict != Verdict::Worse,
        };
        if is_met {
            ExitCode::SUCCESS
        } else {
            ExitCode::from(MISSED_BOUND)
        }
    }
}

/// Removes a folder without content, so that nothing is left if the verdict is refused. A folder with other content is kept.
fn remove_if_empty(folder: &Path) {
    let _ = fs::remove_dir(folder);
}

/// A sentence about the seeds that were not trained, because the budget would be exceeded.
fn stop_sentence(n_seeds: usize) -> String {
    format!(
        "The trainings took longer than the measured speed promised, so the budget ended after {n_seeds} of {} seeds. Repeat the \
         command with --resume to train the others.",
        LOOK_LIMITS.len()
    )
}

/// Refuses data with which no look could decide, before any training, and removes the run folder if nothing was trained in it.
fn ensure_decidable(run: &Run<'_>, compared: [&str; 2], folder: &Path) -> Result<()> {
    let checked = run
        .ensure_test_groups()
        .and_then(|()| run.ensure_different_labels(compared));
    // A verdict of an earlier version trained first. Its weights must not be removed.
    if checked.is_err() && !folder.join("checkpoints").exists() {
        fs::remove_dir_all(folder).with_context(|| format!("removing {}", folder.display()))?;
    }
    checked
}

fn progress_line(look: &Look) -> String {
    let found = &look.difference;
    format!(
        "look {}: Δ mIoU {:+.3}, p = {:.4}, decides below {:.4}",
        look.number,
        found.mean,
        found.p.unwrap_or(1.0),
        look.limit
    )
}

/// A number with the unit h, m or s.
fn time(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a time; write for example 60m or 2h");
    let (number, seconds) = match text
        .trim()
        .split_at_checked(text.trim().len().saturating_sub(1))
    {
        Some((number, "h")) => (number, 3600.0),
        Some((number, "m")) => (number, 60.0),
        Some((number, "s")) => (number, 1.0),
        _ => return Err(refused()),
    };
    let number: f64 = number.trim().parse().map_err(|_| refused())?;
    Duration::try_from_secs_f64(number * seconds).map_err(|_| refused())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_has_a_unit() {
        for (text, seconds) in [("60m", 3600), ("2h", 7200), ("0.5 h", 1800), ("90s", 90)] {
            assert_eq!(time(text), Ok(Duration::from_secs(seconds)));
        }
        for text in ["", "60", "m", "-1m", "nan h", "60 minutes"] {
            assert!(time(text).is_err(), "{text}");
        }
    }
}
