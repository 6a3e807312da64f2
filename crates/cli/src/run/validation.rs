//! The validations of a training: what they scored, which was the best, and whether to go on.
//!
//! The history stands in a file and is cut back to the checkpoint when a training is resumed, so that a training that
//! was killed stops at the same step as one that was not.

use super::folder::RunFolder;
use anyhow::Result;
use serde::{Deserialize, Serialize};

/// The scores of one validation, means over its shapes.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub(super) struct Validation {
    pub(super) step: usize,
    /// By the first clusterer with oracle K.
    pub(super) miou: f64,
    /// By the nearest true center.
    pub(super) gtc_miou: f64,
    pub(super) gtc_accuracy: f64,
    /// The one that decides.
    pub(super) score: f64,
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
    /// If the file is there and cannot be read.
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

    /// Adds a validation; whether it is the best so far.
    pub(super) fn add(&mut self, validation: Validation) -> bool {
        self.validations.push(validation);
        self.best() == Some(&validation)
    }

    /// The validation with the highest score, the first of a tie.
    pub(super) fn best(&self) -> Option<&Validation> {
        self.validations
            .iter()
            .reduce(|best, next| if next.score > best.score { next } else { best })
    }

    /// Whether the last `patience` validations brought no new best; never for a patience of 0.
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
            miou: score,
            gtc_miou: 0.0,
            gtc_accuracy: 0.0,
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
