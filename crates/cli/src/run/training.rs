//! Trains one supervision with one seed: prepares or resumes a training, runs `partprobe_net::fit`, and writes the weights.

use super::held_out::ensure_unseen;
use super::initial_weights::{LoadedWeights, initial_weights};
use super::loading::{LoadedBatches, LoadingClocks, LoadingPlan, with_loaders};
use super::longer::is_of_length;
use super::nonfinite::dump;
use super::observer::RunObserver;
use super::shapes::Shape;
use super::training_job::{TrainingJob, TrainingRecord, train_settings};
use super::training_shapes::TrainingShapes;
use super::validation::History;
use super::weights::weights_path;
use crate::config::{Keep, differences, listed};
use anyhow::{Context, Result, anyhow, ensure};
use partprobe_carrier::sha256_hex;
use partprobe_net::{
    FaultInjection, ModelFile, TrainError, TrainSettings, TrainedOn, Training, fit,
};

impl TrainingJob<'_> {
    /// Trains to the last step, from the last checkpoint if there is one, and writes the weights.
    ///
    /// # Errors
    /// If the loss becomes NaN, the user interrupts (then the checkpoint is written), or a file cannot be written.
    pub(crate) fn train(&self, train: &TrainingShapes, valid: &[&Shape]) -> Result<()> {
        let initial = self.initial_weights()?;
        let mut training = self.start(train.n(), initial.as_ref())?;
        let clocks = LoadingClocks::default();
        let mut observer = RunObserver::new(self, &training, train.n(), valid, &clocks)?;

        with_loaders(
            &self.loading_plan(&training, train),
            &clocks,
            |mut batches| {
                let fitted = self.fit(&mut training, &mut batches, &mut observer);
                observer.log.end(
                    training.n_steps_done(),
                    clocks.loading_seconds(),
                    fitted.is_ok(),
                )?;
                fitted.map_err(|error| self.explain(error, &training, train))
            },
        )?;
        self.write_weights(&training, &observer.history, initial)
    }

    /// The weights that `train.init` names. They must not have seen a test shape of this run.
    fn initial_weights(&self) -> Result<Option<LoadedWeights>> {
        let names = (self.supervision, self.seed);
        let loaded = initial_weights(self.config, names, self.execution.backend)?;
        if let Some(loaded) = &loaded {
            ensure_unseen(
                &loaded.initial.seen,
                "their training or validation",
                &self.data.test,
            )
            .context("train.init: these weights cannot be used here")?;
        }
        Ok(loaded)
    }

    /// The loop itself, with a fault if one is requested. A resumed training may already have ended early.
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
                &mut FaultInjection::new(batches, fault),
                &mut FaultInjection::new(observer, fault),
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

    fn settings(&self, n_shapes: usize) -> TrainSettings {
        train_settings(self.config, n_shapes, self.seed)
    }

    /// The note in a checkpoint about its training data.
    fn data_note(&self, initial: Option<&LoadedWeights>) -> String {
        let start = initial.map(|loaded| format!(" from {}", loaded.initial.sha256));
        let fault = self
            .args
            .inject_fault
            .map(|fault| format!(" with the fault {}", fault.name()));
        format!(
            "{} {}{}{}",
            self.supervision,
            self.data.digest,
            start.unwrap_or_default(),
            fault.unwrap_or_default()
        )
    }

    fn start(&self, n_shapes: usize, initial: Option<&LoadedWeights>) -> Result<Training> {
        let (net, settings) = (&self.config.net, self.settings(n_shapes));
        let note = self.data_note(initial);
        let training = if self.folder.path(&self.path("last")).exists() {
            self.resumed("last", &settings, &note)?
        } else if let Some(loaded) = initial {
            Training::from_weights(net, &settings, &loaded.model)?.with_data(note)
        } else {
            Training::new(net, &settings, self.execution.backend)?.with_data(note)
        };
        Ok(training.with_threads(self.execution.threads)?)
    }

    /// The training of a checkpoint, if the checkpoint belongs to this training.
    fn resumed(&self, file: &str, settings: &TrainSettings, note: &str) -> Result<Training> {
        let relative = self.path(file);
        let path = self.folder.path(&relative);
        let resumed = Training::resume(&self.folder.read(&relative)?, self.execution.backend);
        let resumed = resumed.with_context(|| format!("resuming from {}", path.display()))?;
        let mut differing = differences(resumed.settings(), settings);
        differing.retain(|difference| !is_of_length(&difference.key));
        ensure!(
            differing.is_empty(),
            "{} was written with other settings: {}; choose another --out",
            path.display(),
            listed(&differing)
        );
        ensure!(
            resumed.data() == Some(note),
            "{} was not trained on this run's shapes and labels from its initial weights, or an earlier version wrote it; \
             choose another --out",
            path.display()
        );
        resumed
            .extended(settings)
            .with_context(|| format!("resuming from {}", path.display()))
    }

    /// Stores an update whose numbers are not finite, so that it can be repeated.
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

    /// Writes the weights of the evaluated checkpoint, and the record of the training.
    fn write_weights(
        &self,
        training: &Training,
        history: &History,
        initial: Option<LoadedWeights>,
    ) -> Result<()> {
        let best = self.path("best");
        let model = match self.config.train.keep {
            Keep::Best if self.folder.path(&best).exists() => {
                let note = self.data_note(initial.as_ref());
                self.resumed("best", training.settings(), &note)?
                    .model()
                    .clone()
            }
            _ => training.model().clone(),
        };
        let trained_on = TrainedOn {
            supervision: self.supervision.to_owned(),
            settings: training.settings().clone(),
            train: self.data.train.clone(),
            valid: self.data.valid.clone(),
            initial: initial.map(|loaded| loaded.initial),
        };
        let file = ModelFile {
            model,
            preparation: self.config.preparation(),
            trained_on: Some(trained_on),
        };
        let weights = file.to_bytes()?;
        let record = TrainingRecord {
            format_version: partprobe_formats::FORMAT_VERSION,
            steps: training.n_steps_done(),
            stopped_early: !training.is_done(),
            best: history.best().cloned(),
            untouched_tensors: training.untouched_tensors(),
            weights_sha256: Some(sha256_hex(&weights)),
        };
        // The weights are written last. If they exist, the training is finished.
        self.folder
            .write_json(&self.path("training.json"), &record)?;
        self.folder
            .write(&weights_path(self.supervision, self.seed), &weights)
    }
}
