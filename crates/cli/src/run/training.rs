//! One supervision, one seed: training with a log, checkpoints, validation, early stopping and resume.

use super::diary::{Diary, StepTime};
use super::divergence::dump;
use super::evaluation::score_against;
use super::folder::RunFolder;
use super::loading::{Batches, LoadingPlan, with_loaders};
use super::shapes::{Points, Shape};
use super::stages::{Execution, weights_path};
use super::training_shapes::TrainingShapes;
use super::validation::{History, Validation};
use super::weights::weights_hash;
use crate::config::{Config, Keep, ValidMetric, differences, listed};
use anyhow::{Context, Result, anyhow, bail, ensure};
use eval::gtc;
use net::{ModelFile, ShapeKeys, StepReport, TokenConfig, TrainConfig, TrainError, TrainSettings, TrainedOn, Training};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// How a training is executed; nothing here changes its numbers.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct TrainingArgs {
    /// Threads that load shapes ahead of the updates; 0 loads them when they are due, on the threads of the updates.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(0..=1024))]
    loaders: u16,
    /// Draw the points of a training shape from its carrier each time that it is loaded, in place of keeping them in
    /// memory; the numbers stay the same.
    #[arg(long)]
    resample: bool,
    /// Stop each training after this many minutes, as Ctrl-C would: it leaves a checkpoint, and --resume continues.
    #[arg(long, value_name = "MINUTES", value_parser = minutes)]
    stop_after: Option<Duration>,
}

impl TrainingArgs {
    /// Where the points of training shapes are.
    pub(crate) fn points(&self) -> Points {
        if self.resample { Points::Redrawn } else { Points::Kept }
    }
}

fn minutes(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a number of minutes");
    let minutes: f64 = text.parse().map_err(|_| refused())?;
    Duration::try_from_secs_f64(60.0 * minutes).map_err(|_| refused())
}

/// What a training needs beside its shapes.
pub(crate) struct TrainingJob<'a> {
    pub(crate) folder: &'a RunFolder,
    pub(crate) config: &'a Config,
    pub(crate) supervision: &'a str,
    pub(crate) seed: u64,
    pub(crate) data: &'a TrainingData,
    pub(crate) execution: &'a Execution,
    pub(crate) args: &'a TrainingArgs,
}

/// What tells the shapes of a training from those of others.
#[derive(Clone, Debug)]
pub(crate) struct TrainingData {
    pub(crate) train: ShapeKeys,
    pub(crate) valid: ShapeKeys,
    /// A hash of the shapes' ids and carriers, in their order.
    pub(crate) digest: String,
}

/// How a config trains with a seed, where there are so many shapes.
pub(crate) fn train_settings(config: &Config, n_shapes: usize, seed: u64) -> TrainSettings {
    TrainSettings {
        loss: config.loss.clone(),
        optim: config.optim.clone(),
        augment: config.augment.clone(),
        tokens: config.tokens.clone(),
        train: TrainConfig {
            steps: config.train.n_steps(n_shapes),
            batch_shapes: config.train.batch_shapes,
            accumulate: config.train.accumulate,
            seed,
            sabotage: config.train.sabotage,
        },
    }
}

/// `training.json`: what a finished training says of itself.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct TrainingRecord {
    format_version: u32,
    /// Updates that were made.
    steps: usize,
    /// Whether patience ended it before its last step.
    stopped_early: bool,
    /// The best validation.
    best: Option<Validation>,
    /// Tensors that no gradient has reached; a sound training has none.
    pub(crate) untouched_tensors: Vec<String>,
    /// SHA-256 of the weights that are evaluated, in hexadecimal; `None` if an earlier version trained them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) weights_sha256: Option<String>,
}

impl TrainingRecord {
    /// What the finished training of a run says; none if it is not finished.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn read(folder: &RunFolder, supervision: &str, seed: u64) -> Result<Option<Self>> {
        let path = format!("checkpoints/{supervision}-{seed}/training.json");
        if !folder.path(&path).exists() {
            return Ok(None);
        }
        folder.read_json(&path, "put back a copy of the file, or train again in a new run folder").map(Some)
    }
}

/// A training on its way, with what it has told.
struct Course<'a> {
    training: Training,
    batches: Batches<'a>,
    history: History,
    diary: Diary<'a>,
    /// When to stop with a checkpoint.
    deadline: Option<Instant>,
}

impl Course<'_> {
    /// Makes one update, batch by batch; how long it waited for its shapes.
    fn update(&mut self) -> Result<(StepReport, Duration)> {
        let mut waiting = Duration::ZERO;
        let mut update = self.training.begin_update();
        for _ in 0..self.training.settings().train.accumulate {
            let begun = Instant::now();
            let batch = self.batches.next()?;
            waiting += begun.elapsed();
            self.training.add(&mut update, &batch)?;
        }
        Ok((self.training.finish(update)?, waiting))
    }
}

impl TrainingJob<'_> {
    /// Trains to the last step, from the last checkpoint if there is one, and writes the weights that are kept.
    ///
    /// # Errors
    /// If the loss stops being a number, the user interrupts (the checkpoint is then written), or a file cannot be
    /// written.
    pub(crate) fn train(&self, train: &TrainingShapes, valid: &[&Shape]) -> Result<()> {
        let deadline = self.args.stop_after.and_then(|time| Instant::now().checked_add(time));
        let training = self.start(train.n())?;
        let (first_step, n_steps) = (training.n_steps_done(), training.settings().train.steps);
        let history = History::read(self.folder, &self.path("validations.json"), first_step)?;
        let names = (self.supervision, self.seed);
        let diary = Diary::open(self.folder, &self.execution.progress, names, (first_step, n_steps))?;
        let loading = training.loading();
        let n_loaders = usize::from(self.args.loaders);
        let TrainConfig { batch_shapes, .. } = training.settings().train;
        let update_shapes = training.settings().train.update_shapes();
        let plan = LoadingPlan { loading, shapes: train, first_step, n_steps, update_shapes, batch_shapes, n_loaders };
        with_loaders(&plan, |batches| {
            let mut course = Course { training, batches, history, diary, deadline };
            let taken = self.take_steps(&mut course, train, valid);
            course.diary.end(course.training.n_steps_done(), course.batches.loading_seconds())?;
            taken?;
            self.write_weights(&course)
        })
    }

    fn take_steps(&self, course: &mut Course, train: &TrainingShapes, valid: &[&Shape]) -> Result<()> {
        let patience = self.config.train.patience;
        let n_steps = course.training.settings().train.steps;
        let valid_every = self.config.train.n_steps_between_validations(train.n());
        while !course.training.is_done() && !course.history.is_out_of_patience(patience) {
            self.update(course, train)?;
            let done = course.training.n_steps_done();
            let is_due = |every: usize| done == n_steps || (every > 0 && done.is_multiple_of(every));
            if is_due(valid_every) && !valid.is_empty() {
                self.validate(course, valid)?;
            }
            let is_last = done == n_steps || course.history.is_out_of_patience(patience);
            let stops = self.execution.interrupt.is_set() || course.deadline.is_some_and(|at| Instant::now() >= at);
            if is_last || is_due(self.config.train.checkpoint_every) || stops {
                self.folder.write(&self.path("last"), &course.training.checkpoint()?)?;
            }
            if stops && !is_last {
                bail!("stopped at step {done} of {n_steps}; the checkpoint is written, continue with --resume");
            }
        }
        Ok(())
    }

    fn path(&self, file: &str) -> String {
        format!("checkpoints/{}-{}/{file}", self.supervision, self.seed)
    }

    fn settings(&self, n_shapes: usize) -> TrainSettings {
        train_settings(self.config, n_shapes, self.seed)
    }

    /// What a checkpoint says of the data that it is trained on.
    fn data_note(&self) -> String {
        format!("{} {}", self.supervision, self.data.digest)
    }

    fn start(&self, n_shapes: usize) -> Result<Training> {
        let training = if self.folder.path(&self.path("last")).exists() {
            self.resumed("last", &self.settings(n_shapes))?
        } else {
            Training::new(&self.config.net, &self.settings(n_shapes), self.execution.backend)?
                .with_data(self.data_note())
        };
        Ok(training.with_threads(self.execution.threads)?)
    }

    /// The training of a checkpoint, if it is one of this training.
    fn resumed(&self, file: &str, settings: &TrainSettings) -> Result<Training> {
        let relative = self.path(file);
        let path = self.folder.path(&relative);
        let resumed = Training::resume(&self.folder.read(&relative)?, self.execution.backend);
        let resumed = resumed.with_context(|| format!("resuming from {}", path.display()))?;
        let differing = differences(resumed.settings(), settings);
        ensure!(
            differing.is_empty(),
            "{} was written with other settings: {}; choose another --out",
            path.display(),
            listed(&differing)
        );
        ensure!(
            resumed.data() == Some(self.data_note().as_str()),
            "{} was not trained on this run's shapes and labels, or an earlier version wrote it; choose another --out",
            path.display()
        );
        Ok(resumed)
    }

    fn update(&self, course: &mut Course, train: &TrainingShapes) -> Result<()> {
        let begun = Instant::now();
        let (report, waiting) = course.update().map_err(|error| self.explain(error, &course.training, train))?;
        course.diary.step(&report, StepTime { total: begun.elapsed(), waiting })
    }

    /// Keeps an update whose numbers are not finite, so that it can be made again.
    fn explain(&self, error: anyhow::Error, training: &Training, train: &TrainingShapes) -> anyhow::Error {
        if !matches!(error.downcast_ref(), Some(TrainError::NonFinite { .. })) {
            return error;
        }
        let batch = training.loading().batch(train.n(), training.n_steps_done());
        let shapes: Result<Vec<_>> = batch.into_iter().map(|idx| train.get(idx)).collect();
        let relative = format!("diverged/{}-{}", self.supervision, self.seed);
        match shapes.and_then(|shapes| dump(self.folder, &relative, training, &shapes, &error.to_string())) {
            Ok(()) => anyhow!("{error}; `partprobe replay {}` repeats it", self.folder.path(&relative).display()),
            Err(unwritten) => anyhow!("{error}; and keeping the update failed: {unwritten:#}"),
        }
    }

    /// Scores the validation shapes against the supervision itself, and keeps the best checkpoint.
    fn validate(&self, course: &mut Course, valid: &[&Shape]) -> Result<()> {
        let begun = Instant::now();
        let scores: Vec<[f64; 3]> =
            valid.par_iter().map(|shape| self.score(&course.training, shape)).collect::<Result<_>>()?;
        let mean = |of: usize| scores.iter().map(|score| score[of]).sum::<f64>() / scores.len() as f64;
        let [miou, gtc_miou, gtc_accuracy] = [0, 1, 2].map(mean);
        let score = match self.config.train.valid_metric {
            ValidMetric::Miou => miou,
            ValidMetric::GtcMiou => gtc_miou,
        };
        let validation = Validation { step: course.training.n_steps_done(), miou, gtc_miou, gtc_accuracy, score };
        if course.history.add(validation) {
            self.folder.write(&self.path("best"), &course.training.checkpoint()?)?;
        }
        self.folder.write_json(&self.path("validations.json"), &course.history)?;
        let best = *course.history.best().unwrap_or(&validation);
        course.diary.validation(validation, &best, valid.len(), begun.elapsed())
    }

    /// mIoU by the first clusterer, mIoU and accuracy by the nearest true centre.
    fn score(&self, training: &Training, shape: &Shape) -> Result<[f64; 3]> {
        let eval = &self.config.eval;
        let TokenConfig { test_tokens, voxels, .. } = self.config.tokens;
        let tokens = net::tokenize(&shape.sample, test_tokens, voxels)?;
        let embeddings = training.model().embed(&tokens)?;
        let found = score_against(shape, self.supervision, &tokens, &embeddings, eval.clusterers[0], eval)?;
        let centres = gtc(&embeddings, &tokens.token_of_point, shape.labels_by(self.supervision)?)?;
        Ok([found.scores.miou, centres.miou, centres.accuracy])
    }

    /// Writes the weights of the checkpoint that is evaluated, and what the training says of itself.
    fn write_weights(&self, course: &Course) -> Result<()> {
        let training = &course.training;
        let best = self.path("best");
        let model = match self.config.train.keep {
            Keep::Best if self.folder.path(&best).exists() => {
                self.resumed("best", training.settings())?.model().clone()
            }
            _ => training.model().clone(),
        };
        let trained_on = TrainedOn {
            supervision: self.supervision.to_owned(),
            settings: training.settings().clone(),
            train: self.data.train.clone(),
            valid: self.data.valid.clone(),
        };
        let file = ModelFile { model, preparation: self.config.preparation(), trained_on: Some(trained_on) };
        let weights = file.to_bytes()?;
        let record = TrainingRecord {
            format_version: 1,
            steps: training.n_steps_done(),
            stopped_early: !training.is_done(),
            best: course.history.best().copied(),
            untouched_tensors: training.untouched_tensors(),
            weights_sha256: Some(weights_hash(&weights)),
        };
        // The weights come last: where they are, the training is finished.
        self.folder.write_json(&self.path("training.json"), &record)?;
        self.folder.write(&weights_path(self.supervision, self.seed), &weights)
    }
}
