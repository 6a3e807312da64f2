//! Stores the validations of a training: their scores, the best one, and whether the training continues.
//!
//! The history is in a file and is truncated to the checkpoint when a training is resumed, so a training that was killed stops at
//! the same step as one that was not.

use super::folder::RunFolder;
use anyhow::Result;
use partprobe_eval::{METRICS, Metric};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Means are rounded to twelve decimals. A longer number may change its last digit when it is read from the history of a resumed
/// training.
const DECIMALS: f64 = 1e12;

/// The scores of one validation, means over its shapes. Clusters are those of the first clusterer with oracle K.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(super) struct Validation {
    pub(super) step: usize,
    /// The mean of each metric by its name. A file of another version may have other metrics.
    #[serde(flatten)]
    pub(super) scores: BTreeMap<String, f64>,
    /// The mean of `train.valid_metric`, which determines the best validation.
    pub(super) score: f64,
}

impl Validation {
    /// The means over the shapes that have a value. `decides` is the metric that determines the best validation.
    pub(super) fn mean(step: usize, shapes: &[BTreeMap<Metric, f64>], decides: Metric) -> Self {
        let mut scores = BTreeMap::new();
        for metric in METRICS {
            if let Some(mean) = mean_of(shapes, metric) {
                scores.insert(metric.name.to_owned(), mean);
            }
        }
        Self {
            step,
            score: scores.get(decides.name).copied().unwrap_or(f64::NAN),
            scores,
        }
    }
}

fn mean_of(shapes: &[BTreeMap<Metric, f64>], metric: &Metric) -> Option<f64> {
    let values: Vec<f64> = shapes
        .iter()
        .filter_map(|scores| scores.get(metric).copied())
        .collect();
    if values.is_empty() {
        return None;
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    Some((mean * DECIMALS).round() / DECIMALS)
}

/// Every validation so far, in the order of the steps.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
pub(super) struct History {
    validations: Vec<Validation>,
}

impl History {
    /// Reads the history of the first `n_steps_done` steps.
    ///
    /// # Errors
    /// If the file exists and cannot be read.
    pub(super) fn read(folder: &RunFolder, path: &str, n_steps_done: usize) -> Result<Self> {
        if !folder.path(path).exists() {
            return Ok(Self::default());
        }
        let advice = "put back a copy of the file, or train again in a new run folder";
        let mut history: Self = folder.read_json(path, advice)?;
        history
            .validations
            .retain(|validation| validation.step <= n_steps_done);
        Ok(history)
    }

    /// Keeps the validations at multiples of `valid_every`. With 0, no validation is due before the end.
    pub(super) fn keep_multiples_of(&mut self, valid_every: usize) {
        self.validations
            .retain(|validation| valid_every > 0 && validation.step.is_multiple_of(valid_every));
    }

    /// Adds a validation. Returns whether it is the best so far.
    pub(super) fn add(&mut self, validation: Validation) -> bool {
        let step = validation.step;
        self.validations.push(validation);
        self.best().is_some_and(|best| best.step == step)
    }

    /// The validation with the highest score. In a tie, it is the first one.
    pub(super) fn best(&self) -> Option<&Validation> {
        self.validations
            .iter()
            .reduce(|best, next| if next.score > best.score { next } else { best })
    }

    /// Whether the last `patience` validations were not better than the best one. It is always false for a patience of 0.
    pub(super) fn is_out_of_patience(&self, patience: usize) -> bool {
        let best = self.best().map_or(0, |best| best.step);
        patience > 0
            && self
                .validations
                .iter()
                .filter(|validation| validation.step > best)
                .count()
                >= patience
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn history(scores: &[f64]) -> History {
        let validation = |(step, &score)| Validation {
            step,
            scores: BTreeMap::from([("miou".to_owned(), score)]),
            score,
        };
        History {
            validations: (1..).zip(scores).map(validation).collect(),
        }
    }

    #[track_caller]
    fn check(scores: &[f64], best_step: usize, patience: usize, stops: bool) {
        let history = history(scores);
        assert_eq!(history.best().unwrap().step, best_step);
        assert_eq!(history.is_out_of_patience(patience), stops);
    }

    #[test]
    fn patience_counts_from_the_best_and_ties_are_no_progress() {
        check(&[0.1, 0.3, 0.2], 2, 2, false);
        check(&[0.1, 0.3, 0.2, 0.3], 2, 2, true);
        check(&[0.1, 0.3, 0.2, 0.4], 4, 1, false);
        check(&[0.3, 0.2, 0.1, 0.1], 1, 0, false);
        assert!(!History::default().is_out_of_patience(1));
    }

    #[test]
    fn a_resumed_history_ends_at_the_checkpoint() {
        let root = tempfile::tempdir().unwrap();
        let folder = RunFolder::open(&root.path().join("run"), "", false).unwrap();
        folder
            .write_json("history.json", &history(&[0.1, 0.3, 0.2]))
            .unwrap();
        assert_eq!(
            History::read(&folder, "history.json", 2).unwrap(),
            history(&[0.1, 0.3])
        );
        assert_eq!(
            History::read(&folder, "none.json", 2).unwrap(),
            History::default()
        );
        folder.write("history.json", b"{").unwrap();
        assert!(History::read(&folder, "history.json", 2).is_err());
    }
}
