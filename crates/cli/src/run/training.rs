//! One supervision, one seed: prepares a training or resumes it, runs `partprobe_net::fit`, and writes the weights that are kept.

use super::divergence::dump;
use super::folder::RunFolder;
use super::loading::{LoadedBatches, LoadingClocks, LoadingPlan, with_loaders};
use super::observer::RunObserver;
use super::shapes::{Points, Shape};
use super::stages::{Execution, weights_path};
use super::training_shapes::TrainingShapes;
use super::validation::{History, Validation};
use crate::config::{Config, Keep, differences, listed};
use anyhow::{Context, Result, anyhow, ensure};
use partprobe_carrier::sha256_hex;
use partprobe_net::{
    Fault, Faulty, ModelFile, ShapeKeys, TrainConfig, TrainError, TrainSettings, TrainedOn,
    Training, fit,
};
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// How a training is executed. Only a fault changes its numbers.
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
    /// Builds a defect into the training, to see whether the run's expectations notice.
    #[arg(long, value_name = "FAULT", hide = true, value_parser = fault)]
    inject_fault: Option<Fault>,
}

impl TrainingArgs {
    /// Where the points of training shapes are.
    pub(crate) fn points(&self) -> Points {
        if self.resample {
            Points::Redrawn
        } else {
            Points::Kept
        }
    }

    /// When to stop with a checkpoint.
    pub(super) fn deadline(&self) -> Option<Instant> {
        self.stop_after
            .and_then(|time| Instant::now().checked_add(time))
    }
}

fn minutes(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a number of minutes");
    let minutes: f64 = text.parse().map_err(|_| refused())?;
    Duration::try_from_secs_f64(60.0 * minutes).map_err(|_| refused())
}

fn fault(text: &str) -> Result<Fault, String> {
    let names = || Fault::ALL.map(Fault::name).join(", ");
    Fault::ALL
        .into_iter()
        .find(|fault| fault.name() == text)
        .ok_or_else(|| format!("`{text}` is not a fault; these are: {}", names()))
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
            defect: config.train.defect,
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
        folder
            .read_json(
                &path,
                "put back a copy of the file, or train again in a new run folder",
            )
            .map(Some)
    }
}

impl TrainingJob<'_> {
    /// Trains to the last step, from the last checkpoint if there is one, and writes the weights that are kept.
    ///
    /// # Errors
    /// If the loss stops being a number, the user interrupts (the checkpoint is then written), or a file cannot be
    /// written.
    pub(crate) fn train(&self, train: &TrainingShapes, valid: &[&Shape]) -> Result<()> {
        let mut training = self.start(train.n())?;
        let clocks = LoadingClocks::default();
        let mut observer = RunObserver::new(self, &training, train.n(), valid, &clocks)?;

        with_loaders(
            &self.loading_plan(&training, train),
            &clocks,
            |mut batches| {
                let fitted = self.fit(&mut training, &mut batches, &mut observer);
                observer
                    .log
                    .end(training.n_steps_done(), clocks.loading_seconds())?;
                fitted.map_err(|error| self.explain(error, &training, train))
            },
        )?;
        self.write_weights(&training, &observer.history)
    }

    /// The loop itself, with a fault where one is asked for. A resumed training may have ended early already.
    fn fit(
        &self,
        training: &mut Training,
        batches: &mut LoadedBatches<'_>,
        observer: &mut RunObserver<'_>,
    ) -> Result<()> {
        if observer.is_out_of_patience() {
            return Ok(());
        }
        match self.args.inject_fault {
            None => fit(training, batches, observer),
            Some(fault) => fit(
                training,
                &mut Faulty::new(batches, fault),
                &mut Faulty::new(observer, fault),
            ),
        }
    }

    fn loading_plan<'b>(&self, training: &Training, shapes: &'b TrainingShapes) -> LoadingPlan<'b> {
        let settings = &training.settings().train;
        LoadingPlan {
            loading: training.loading(),
            shapes,
            first_step: training.n_steps_done(),
            n_steps: settings.steps,
            update_shapes: settings.update_shapes(),
            batch_shapes: settings.batch_shapes,
            n_loaders: usize::from(self.args.loaders),
        }
    }

    pub(super) fn path(&self, file: &str) -> String {
        format!("checkpoints/{}-{}/{file}", self.supervision, self.seed)
    }

    fn settings(&self, n_shapes: usize) -> TrainSettings {
        train_settings(self.config, n_shapes, self.seed)
    }

    /// What a checkpoint says of the data that it is trained on.
    fn data_note(&self) -> String {
        let fault = self
            .args
            .inject_fault
            .map(|fault| format!(" with the fault {}", fault.name()));
        format!(
            "{} {}{}",
            self.supervision,
            self.data.digest,
            fault.unwrap_or_default()
        )
    }

    fn start(&self, n_shapes: usize) -> Result<Training> {
        let training = if self.folder.path(&self.path("last")).exists() {
            self.resumed("last", &self.settings(n_shapes))?
        } else {
            Training::new(
                &self.config.net,
                &self.settings(n_shapes),
                self.execution.backend,
            )?
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

    /// Keeps an update whose numbers are not finite, so that it can be made again.
    fn explain(
        &self,
        error: anyhow::Error,
        training: &Training,
        train: &TrainingShapes,
    ) -> anyhow::Error {
        if !matches!(error.downcast_ref(), Some(TrainError::NonFinite { .. })) {
            return error;
        }
        let batch = training.loading().batch(train.n(), training.n_steps_done());
        let shapes: Result<Vec<_>> = batch.into_iter().map(|idx| train.get(idx)).collect();
        let relative = format!("diverged/{}-{}", self.supervision, self.seed);
        match shapes.and_then(|shapes| {
            dump(
                self.folder,
                &relative,
                training,
                &shapes,
                &error.to_string(),
            )
        }) {
            Ok(()) => anyhow!(
                "{error}; `partprobe replay {}` repeats it",
                self.folder.path(&relative).display()
            ),
            Err(unwritten) => anyhow!("{error}; and keeping the update failed: {unwritten:#}"),
        }
    }

    /// Writes the weights of the checkpoint that is evaluated, and what the training says of itself.
    fn write_weights(&self, training: &Training, history: &History) -> Result<()> {
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
        let file = ModelFile {
            model,
            preparation: self.config.preparation(),
            trained_on: Some(trained_on),
        };
        let weights = file.to_bytes()?;
        let record = TrainingRecord {
            format_version: 1,
            steps: training.n_steps_done(),
            stopped_early: !training.is_done(),
            best: history.best().cloned(),
            untouched_tensors: training.untouched_tensors(),
            weights_sha256: Some(sha256_hex(&weights)),
        };
        // The weights come last: where they are, the training is finished.
        self.folder
            .write_json(&self.path("training.json"), &record)?;
        self.folder
            .write(&weights_path(self.supervision, self.seed), &weights)
    }
}
