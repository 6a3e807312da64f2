//! The record of one fit: a JSON file in the run folder, by which a resumed run finds what is done.

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

/// What became of a fit.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Outcome {
    /// The scores of the last iterate, by the names of their metrics.
    Scores(BTreeMap<String, f64>),
    /// The shape cannot be fitted.
    Failed {
        /// Why.
        reason: String,
    },
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

    /// A score; `None` if the fit failed or has no such score.
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

/// A line per fit; a cell without a score is empty.
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
