//! Writes the output of a running training: lines of `log.jsonl`, curves, and the progress line.

use super::folder::RunFolder;
use super::tensorboard::EventFile;
use super::validation::Validation;
use crate::counted::counted;
use crate::progress::Progress;
use anyhow::Result;
use indicatif::ProgressBar;
use partprobe_eval::METRICS;
use partprobe_net::StepReport;
use serde::Serialize;
use std::time::Duration;

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
    n_without_loss: usize,
    /// Seconds of the update, including its waiting.
    seconds: f64,
    /// Seconds that it waited for its shapes.
    wait_seconds: f64,
}

/// A line of `log.jsonl` for one validation.
#[derive(Serialize)]
struct ValidLine<'a> {
    event: &'static str,
    supervision: &'a str,
    seed: u64,
    #[serde(flatten)]
    validation: &'a Validation,
    n_shapes: usize,
    seconds: f64,
}

/// A line of `log.jsonl` for the time of a training.
#[derive(Serialize)]
struct EndLine<'a> {
    event: &'static str,
    supervision: &'a str,
    seed: u64,
    step: usize,
    shapes: usize,
    seconds: f64,
    wait_share: f64,
    loading_seconds: f64,
    validation_seconds: f64,
}

/// The mean of each main metric after its heading, in the order of the list.
fn means_text(validation: &Validation) -> String {
    let main = METRICS.iter().filter(|metric| !metric.is_secondary());
    let each = main.filter_map(|metric| {
        let mean = validation.scores.get(metric.name)?;
        Some(format!("{} {mean:.3}", metric.heading))
    });
    each.collect::<Vec<_>>().join(", ")
}

/// The time of an update.
#[derive(Clone, Copy)]
pub(super) struct StepTime {
    pub(super) total: Duration,
    /// The part of this time until its shapes were loaded.
    pub(super) waiting: Duration,
}

/// Writes the log of one training in one process.
pub(super) struct TrainingLog<'a> {
    folder: &'a RunFolder,
    progress: &'a Progress,
    supervision: &'a str,
    seed: u64,
    bar: ProgressBar,
    curves: EventFile,
    updating: Duration,
    waiting: Duration,
    validating: Duration,
    n_updates: usize,
    n_shapes: usize,
    last_validation: String,
}

/// The points of an update on the curves.
fn points_of_step(report: &StepReport, time: StepTime) -> [(&'static str, f64); 8] {
    let seconds = time.total.as_secs_f64().max(1e-9);
    [
        ("train/loss", report.loss.total),
        ("train/pull", report.loss.pull),
        ("train/push", report.loss.push),
        ("train/proto_ce", report.loss.ce),
        ("train/learning_rate", report.learning_rate),
        ("train/grad_norm", report.grad_norm),
        (
            "speed/shapes_per_second",
            report.shapes.len() as f64 / seconds,
        ),
        ("speed/wait_share", time.waiting.as_secs_f64() / seconds),
    ]
}

impl<'a> TrainingLog<'a> {
    /// Begins to record after `n_done` of `n_steps` steps.
    ///
    /// # Errors
    /// If the event file cannot be made.
    pub(super) fn open(
        folder: &'a RunFolder,
        progress: &'a Progress,
        (supervision, seed): (&'a str, u64),
        (n_done, n_steps): (usize, usize),
    ) -> Result<Self> {
        let bar = progress.bar(&format!("train {supervision} seed {seed}"), n_steps);
        bar.set_position(n_done as u64);
        Ok(Self {
            folder,
            progress,
            supervision,
            seed,
            bar,
            curves: EventFile::open(
                folder,
                &format!("tensorboard/{supervision}-{seed}"),
                n_done + 1,
            )?,
            updating: Duration::ZERO,
            waiting: Duration::ZERO,
            validating: Duration::ZERO,
            n_updates: 0,
            n_shapes: 0,
            last_validation: String::new(),
        })
    }

    /// Records an update.
    ///
    /// # Errors
    /// If a line cannot be written.
    pub(super) fn step(&mut self, report: &StepReport, time: StepTime) -> Result<()> {
        self.updating += time.total;
        self.waiting += time.waiting;
        self.n_updates += 1;
        self.n_shapes += report.shapes.len();
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
            n_without_loss: report.n_without_loss,
            seconds: time.total.as_secs_f64(),
            wait_seconds: time.waiting.as_secs_f64(),
        })?;
        self.curves
            .draw(report.step, &points_of_step(report, time))?;
        self.bar.set_position(report.step as u64);
        self.bar.set_message(format!(
            "train {} seed {}: loss {:.3}, {:.1} shapes/s{}",
            self.supervision,
            self.seed,
            report.loss.total,
            self.shapes_per_second(),
            self.last_validation
        ));
        Ok(())
    }

    /// Records a validation, with the best one so far.
    ///
    /// # Errors
    /// If a line cannot be written.
    pub(super) fn validation(
        &mut self,
        validation: &Validation,
        best: &Validation,
        n_shapes: usize,
        time: Duration,
    ) -> Result<()> {
        self.validating += time;
        self.folder.log(&ValidLine {
            event: "valid",
            supervision: self.supervision,
            seed: self.seed,
            validation,
            n_shapes,
            seconds: time.as_secs_f64(),
        })?;
        let tags: Vec<(String, f64)> = validation
            .scores
            .iter()
            .map(|(name, &mean)| (format!("valid/{name}"), mean))
            .collect();
        let points: Vec<(&str, f64)> = tags
            .iter()
            .map(|(tag, mean)| (tag.as_str(), *mean))
            .collect();
        self.curves.draw(validation.step, &points)?;
        self.last_validation = format!(
            ", validation {:.3}, best {:.3} at {}",
            validation.score, best.score, best.step
        );
        if self.bar.is_hidden() {
            self.progress.note(&format!(
                "{} seed {}: step {}, validation {}, {:.1} shapes/s{}",
                self.supervision,
                self.seed,
                validation.step,
                means_text(validation),
                self.shapes_per_second(),
                self.time_left(validation.step)
            ));
        }
        Ok(())
    }

    /// Records the time that this process has needed for the training.
    ///
    /// # Errors
    /// If the line cannot be written.
    pub(super) fn end(&self, step: usize, loading_seconds: f64, is_finished: bool) -> Result<()> {
        let seconds = self.updating.as_secs_f64();
        let wait_share = self.waiting.as_secs_f64() / seconds.max(1e-9);
        self.folder.log(&EndLine {
            event: if is_finished { "end" } else { "stop" },
            supervision: self.supervision,
            seed: self.seed,
            step,
            shapes: self.n_shapes,
            seconds,
            wait_share,
            loading_seconds,
            validation_seconds: self.validating.as_secs_f64(),
        })?;
        self.progress.note(&format!(
            "{} seed {}: {} in {seconds:.1} s of updates ({:.1} shapes/s), of which {:.1} % waiting for shapes; \
             loading took {loading_seconds:.1} s, validation {:.1} s",
            self.supervision,
            self.seed,
            counted(self.n_shapes, "shape", "shapes"),
            self.shapes_per_second(),
            100.0 * wait_share,
            self.validating.as_secs_f64()
        ));
        Ok(())
    }

    fn shapes_per_second(&self) -> f64 {
        self.n_shapes as f64 / self.updating.as_secs_f64().max(1e-9)
    }

    /// The time that the remaining steps take at the current speed, including validations.
    fn time_left(&self, step: usize) -> String {
        let n_left = (self.bar.length().unwrap_or(0) as usize).saturating_sub(step);
        let seconds = (self.updating + self.validating).as_secs_f64()
            / self.n_updates.max(1) as f64
            * n_left as f64;
        if n_left == 0 {
            String::new()
        } else {
            format!(", {} left", rounded_time(seconds))
        }
    }
}

/// An estimated time, rounded to the digits that are meaningful.
fn rounded_time(seconds: f64) -> String {
    match seconds {
        ..1.0 => "less than a second".to_owned(),
        ..90.0 => format!("about {seconds:.0} s"),
        ..5400.0 => format!("about {:.0} min", seconds / 60.0),
        _ => format!("about {:.1} h", seconds / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimated_times_have_their_unit() {
        for (seconds, text) in [
            (0.2, "less than a second"),
            (1.4, "about 1 s"),
            (75.0, "about 75 s"),
            (150.0, "about 2 min"),
            (7200.0, "about 2.0 h"),
        ] {
            assert_eq!(rounded_time(seconds), text);
        }
    }
}
