//! Acts between two updates of a run: it writes the log, validates, writes checkpoints, and decides whether the training ends.
//!
//! The loop itself is `partprobe_net::fit`. The numbers of a training do not depend on anything in this file, except that
//! patience, Ctrl-C or a deadline can end it after a step.

use super::evaluation::score_against;
use super::loading::LoadingClocks;
use super::shapes::Shape;
use super::training_job::TrainingJob;
use super::training_log::{StepTime, TrainingLog};
use super::validation::{History, Validation};
use anyhow::{Result, bail};
use partprobe_eval::{Metric, ScoredShape, gtc};
use partprobe_net::{Observer, StepReport, TokenConfig, Training};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

/// Watches one training of a run.
pub(super) struct RunObserver<'a> {
    job: &'a TrainingJob<'a>,
    valid: &'a [&'a Shape],
    /// The number of steps between two validations. With 0, there is only a validation at the end.
    valid_every: usize,
    clocks: &'a LoadingClocks,
    /// The time at which the current update was started.
    begun: Instant,
    /// The time at which to stop with a checkpoint.
    deadline: Option<Instant>,
    pub(super) history: History,
    pub(super) log: TrainingLog<'a>,
}

impl<'a> RunObserver<'a> {
    /// Opens the log, and the history of validations up to the current step of the training.
    ///
    /// # Errors
    /// If a file of the run folder cannot be read or made.
    pub(super) fn new(
        job: &'a TrainingJob<'a>,
        training: &Training,
        n_shapes: usize,
        valid: &'a [&'a Shape],
        clocks: &'a LoadingClocks,
    ) -> Result<Self> {
        let steps = (training.n_steps_done(), training.settings().train.steps);
        let names = (job.supervision, job.seed);
        let valid_every = job.config.train.n_steps_between_validations(n_shapes);
        let mut history = History::read(job.folder, &job.path("validations.json"), steps.0)?;
        if steps.0 < steps.1 {
            // A training that is made longer was validated at its former end.
            history.keep_multiples_of(valid_every);
        }
        Ok(Self {
            job,
            valid,
            valid_every,
            clocks,
            begun: Instant::now(),
            deadline: job.args.deadline(),
            history,
            log: TrainingLog::open(job.folder, &job.execution.progress, names, steps)?,
        })
    }

    /// Whether too many validations were not better than the best one.
    pub(super) fn is_out_of_patience(&self) -> bool {
        self.history
            .is_out_of_patience(self.job.config.train.patience)
    }

    fn write_step(&mut self, report: &StepReport) -> Result<()> {
        let time = StepTime {
            total: self.begun.elapsed(),
            waiting: self.clocks.take_waiting(),
        };
        self.log.step(report, time)
    }

    /// Scores the validation shapes against the supervision itself, and keeps the best checkpoint.
    fn validate(&mut self, training: &Training) -> Result<()> {
        let begun = Instant::now();
        let scores: Vec<BTreeMap<Metric, f64>> = self
            .valid
            .par_iter()
            .map(|shape| self.score(training, shape))
            .collect::<Result<_>>()?;
        let decides = self.job.config.train.valid_metric.metric();
        let validation = Validation::mean(training.n_steps_done(), &scores, decides);

        if self.history.add(validation.clone()) {
            self.job
                .folder
                .write(&self.job.path("best"), &training.checkpoint()?)?;
        }
        self.job
            .folder
            .write_json(&self.job.path("validations.json"), &self.history)?;

        let best = self.history.best().unwrap_or(&validation);
        self.log
            .validation(&validation, best, scores.len(), begun.elapsed())
    }

    /// Every metric of the list, with the clusters of the first clusterer.
    fn score(&self, training: &Training, shape: &Shape) -> Result<BTreeMap<Metric, f64>> {
        let config = self.job.config;
        let TokenConfig {
            test_tokens,
            voxels,
            ..
        } = config.tokens;
        let tokens = partprobe_net::tokenize(&shape.sample, test_tokens, voxels)?;
        let embeddings = training.model().embed(&tokens)?;

        let clusterer = config.eval.clusterers[0];
        let found = score_against(
            shape,
            self.job.supervision,
            &tokens,
            &embeddings,
            clusterer,
            &config.eval,
        )?;
        let reference = shape.labels_by(self.job.supervision)?;
        let nearest = gtc(&embeddings, &tokens.token_of_point, reference)?;
        let clusters = ScoredShape::of_clusters(
            &found.predicted,
            reference,
            &tokens.token_of_point,
            &embeddings,
            found.scores,
        );
        let scored = ScoredShape {
            gtc: Some(nearest),
            ..clusters
        };
        Ok(scored.scores())
    }

    /// Whether the user or the deadline requires a stop.
    fn is_stopped(&self) -> bool {
        self.job.execution.interrupt.is_set()
            || self.deadline.is_some_and(|at| Instant::now() >= at)
    }
}

impl Observer for RunObserver<'_> {
    type Error = anyhow::Error;

    fn after_step(&mut self, training: &Training, report: &StepReport) -> Result<ControlFlow<()>> {
        let (done, n_steps) = (report.step, training.settings().train.steps);
        let is_due = |every: usize| done == n_steps || (every > 0 && done.is_multiple_of(every));
        self.write_step(report)?;

        if is_due(self.valid_every) && !self.valid.is_empty() {
            self.validate(training)?;
        }

        let is_last = done == n_steps || self.is_out_of_patience();
        let is_stopped = self.is_stopped();
        if is_last || is_stopped || is_due(self.job.config.train.checkpoint_every) {
            self.job
                .folder
                .write(&self.job.path("last"), &training.checkpoint()?)?;
        }
        if is_stopped && !is_last {
            // The time limit of the user is reached. A script distinguishes this from a failure by the exit code.
            self.job.execution.interrupt.ask();
            bail!(
                "stopped at step {done} of {n_steps}; the checkpoint is written, continue with --resume"
            );
        }

        self.begun = Instant::now();
        Ok(if is_last {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        })
    }
}
