//! One supervision, one seed: training with a log, checkpoints, validation and resume.

use super::evaluation::score_against;
use super::folder::RunFolder;
use super::shapes::Shape;
use super::stages::weights_path;
use crate::config::{Config, Keep};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use anyhow::{Context, Result, bail, ensure};
use net::{Backend, TrainConfig, TrainSettings, TrainShape, Training};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// What a training needs beside its shapes.
pub(crate) struct TrainingJob<'a> {
    pub(crate) folder: &'a RunFolder,
    pub(crate) config: &'a Config,
    pub(crate) supervision: &'a str,
    pub(crate) seed: u64,
    pub(crate) backend: Backend,
    pub(crate) threads: usize,
    pub(crate) progress: &'a Progress,
    pub(crate) interrupt: &'a Interrupt,
}

/// The best validation score so far, as `best.json` holds it.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
struct Best {
    step: usize,
    miou: f64,
}

/// A line of `log.jsonl` for one update.
#[derive(Serialize)]
struct StepLine<'a> {
    event: &'static str,
    supervision: &'a str,
    seed: u64,
    step: usize,
    loss: f64,
    pull: f64,
    push: f64,
    proto_ce: f64,
    learning_rate: f64,
    grad_norm: f64,
    seconds: f64,
}

/// A line of `log.jsonl` for one validation.
#[derive(Serialize)]
struct ValidLine<'a> {
    event: &'static str,
    supervision: &'a str,
    seed: u64,
    step: usize,
    miou: f64,
    n_shapes: usize,
}

impl TrainingJob<'_> {
    /// Trains to the last step, from the last checkpoint if there is one, and writes the weights that are kept.
    ///
    /// # Errors
    /// If the loss stops being a number, the user interrupts (the checkpoint is then written), or a file cannot be written.
    pub(crate) fn train(&self, train: &[TrainShape], valid: &[&Shape]) -> Result<()> {
        let mut training = self.start()?;
        let steps = self.config.train.steps;
        let bar = self.progress.bar(&format!("train {} seed {}", self.supervision, self.seed), steps);
        bar.set_position(training.n_steps_done() as u64);
        while training.n_steps_done() < steps {
            self.update(&mut training, train)?;
            bar.inc(1);
            let done = training.n_steps_done();
            if self.is_due(self.config.train.valid_every, done) && !valid.is_empty() {
                let best = self.validate(&training, valid)?;
                bar.set_message(format!("validation mIoU {:.3} at step {}", best.miou, best.step));
            }
            if self.is_due(self.config.train.checkpoint_every, done) || self.interrupt.is_set() {
                self.folder.write(&self.path("last"), &training.checkpoint()?)?;
            }
            if self.interrupt.is_set() && done < steps {
                bail!("interrupted at step {done} of {steps}; the checkpoint is written, go on with --resume");
            }
        }
        bar.finish();
        self.write_weights(&training)
    }

    fn path(&self, file: &str) -> String {
        format!("checkpoints/{}-{}/{file}", self.supervision, self.seed)
    }

    fn is_due(&self, every: usize, done: usize) -> bool {
        done == self.config.train.steps || (every > 0 && done.is_multiple_of(every))
    }

    fn settings(&self) -> TrainSettings {
        let config = self.config;
        TrainSettings {
            loss: config.loss.clone(),
            optim: config.optim.clone(),
            augment: config.augment.clone(),
            tokens: config.tokens.clone(),
            train: TrainConfig { steps: config.train.steps, batch_shapes: config.train.batch_shapes, seed: self.seed },
        }
    }

    fn start(&self) -> Result<Training> {
        let last = self.path("last");
        let training = if self.folder.path(&last).exists() {
            let resumed = Training::resume(&self.folder.read(&last)?, self.backend);
            let resumed = resumed.with_context(|| format!("resuming from {}", self.folder.path(&last).display()))?;
            ensure!(
                *resumed.settings() == self.settings(),
                "{last} was written with other settings; choose another --out"
            );
            resumed
        } else {
            Training::new(&self.config.net, &self.settings(), self.backend)?
        };
        Ok(training.with_threads(self.threads)?)
    }

    fn update(&self, training: &mut Training, train: &[TrainShape]) -> Result<()> {
        let begun = Instant::now();
        let batch = training.load(train)?;
        let report = training.step(&batch)?;
        self.folder.log(&StepLine {
            event: "step",
            supervision: self.supervision,
            seed: self.seed,
            step: report.step,
            loss: report.loss.total,
            pull: report.loss.pull,
            push: report.loss.push,
            proto_ce: report.loss.ce,
            learning_rate: report.learning_rate,
            grad_norm: report.grad_norm,
            seconds: begun.elapsed().as_secs_f64(),
        })
    }

    /// Scores the validation shapes against the supervision itself, and keeps the best checkpoint.
    fn validate(&self, training: &Training, valid: &[&Shape]) -> Result<Best> {
        let eval = &self.config.eval;
        let scores: Vec<f64> = valid
            .par_iter()
            .map(|shape| {
                let tokens = net::tokenize(&shape.sample, self.config.tokens.test_tokens)?;
                let embeddings = training.model().embed(&tokens)?;
                let scored = score_against(shape, self.supervision, &tokens, &embeddings, eval.clusterers[0], eval)?;
                Ok(scored.scores.miou)
            })
            .collect::<Result<_>>()?;
        let miou = scores.iter().sum::<f64>() / scores.len() as f64;
        let (step, n_shapes) = (training.n_steps_done(), scores.len());
        let line = ValidLine { event: "valid", supervision: self.supervision, seed: self.seed, step, miou, n_shapes };
        self.folder.log(&line)?;
        let former = self.best()?;
        match former {
            Some(best) if miou <= best.miou => Ok(best),
            _ => {
                let best = Best { step, miou };
                self.folder.write(&self.path("best"), &training.checkpoint()?)?;
                self.folder.write_json(&self.path("best.json"), &best)?;
                Ok(best)
            }
        }
    }

    fn best(&self) -> Result<Option<Best>> {
        let path = self.path("best.json");
        if !self.folder.path(&path).exists() {
            return Ok(None);
        }
        Ok(Some(serde_json::from_str(&self.folder.read_text(&path)?)?))
    }

    /// Writes the weights of the checkpoint that is evaluated as `model.safetensors`.
    fn write_weights(&self, training: &Training) -> Result<()> {
        let best = self.path("best");
        let weights = match self.config.train.keep {
            Keep::Best if self.folder.path(&best).exists() => {
                Training::resume(&self.folder.read(&best)?, self.backend)?.model().to_safetensors()?
            }
            _ => training.model().to_safetensors()?,
        };
        self.folder.write(&weights_path(self.supervision, self.seed), &weights)
    }
}
