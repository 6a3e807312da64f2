//! Defines the record of one fit: a JSON file in the run folder. A resumed run finds finished fits by it.

use super::fit::Fit;
use super::metrics::METRICS;
use crate::run::RunFolder;
use anyhow::Result;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// One shape, fitted with the labels of one source and one seed.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FitRecord {
    pub(super) shape: String,
    pub(super) arm: String,
    pub(super) seed: u64,
    pub(super) outcome: Outcome,
}

/// The result of a fit.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Outcome {
    /// The scores of the last iterate, by the names of their metrics.
    Scores(BTreeMap<String, f64>),
    /// The shape cannot be fitted.
    Failed {
        /// The reason.
        reason: String,
    },
}

/// Scores are rounded to twelve decimals. A longer number may change its last digit when it is read again, and a resumed run would then
/// have other tables than one that was not interrupted.
const DECIMALS: f64 = 1e12;

impl Outcome {
    /// The scores, rounded such that they can be written and read without a change.
    pub(super) fn of_scores<'a>(scores: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let rounded =
            |(name, score): (&str, f64)| (name.to_owned(), (score * DECIMALS).round() / DECIMALS);
        Self::Scores(scores.into_iter().map(rounded).collect())
    }
}

impl FitRecord {
    /// The record of a fit, if it is done.
    ///
    /// # Errors
    /// If its file is damaged.
    pub(super) fn read(folder: &RunFolder, fit: &Fit) -> Result<Option<Self>> {
        let path = path_of(&fit.shape, &fit.arm, fit.seed);
        if !folder.path(&path).is_file() {
            return Ok(None);
        }
        let advice = "remove the file, and resume the run";
        folder.read_json(&path, advice).map(Some)
    }

    /// Writes the record.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn write(&self, folder: &RunFolder) -> Result<()> {
        folder.write_json(&path_of(&self.shape, &self.arm, self.seed), self)
    }

    /// A score. Returns `None` if the fit failed or has no such score.
    pub(super) fn score(&self, metric: &str) -> Option<f64> {
        match &self.outcome {
            Outcome::Scores(scores) => scores.get(metric).copied(),
            Outcome::Failed { .. } => None,
        }
    }
}

fn path_of(shape: &str, arm: &str, seed: u64) -> String {
    format!("fits/{shape}/{arm}-{seed}.json")
}

/// One line per fit. A cell without a score is empty.
pub(super) fn csv(records: &[FitRecord]) -> String {
    let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
    let mut text = format!("shape,supervision,seed,{},failed\n", names.join(","));
    for record in records {
        let scores: Vec<String> = names
            .iter()
            .map(|name| {
                record
                    .score(name)
                    .map_or_else(String::new, |score| format!("{score:.6}"))
            })
            .collect();
        let reason = match &record.outcome {
            Outcome::Failed { reason } => reason.replace(['"', '\n'], " "),
            Outcome::Scores(_) => String::new(),
        };
        text += &format!(
            "{},{},{},{},\"{reason}\"\n",
            record.shape,
            record.arm,
            record.seed,
            scores.join(",")
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn scores_round_trip(score in -1000.0_f64..1000.0) {
            let outcome = Outcome::of_scores([("cdl1", score)]);
            let text = serde_json::to_string(&outcome).unwrap();
            prop_assert_eq!(serde_json::from_str::<Outcome>(&text).unwrap(), outcome);
        }
    }
}
