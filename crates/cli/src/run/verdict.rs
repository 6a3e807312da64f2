//! Scores single trainings of a run, for a verdict before all of them are done.

use super::evaluation::{Embedder, ScoredModel, evaluate};
use super::scoring_context::{Boundaries, ScoringContext};
use super::shapes::n_labels;
use super::stages::Run;
use crate::config::Config;
use crate::usage::UsageError;
use anyhow::{Result, bail, ensure};
use partprobe_eval::{KBin, MIOU, ScoreRow, VerdictError, VerdictSettings};
use std::collections::{BTreeMap, BTreeSet};

/// The settings of a verdict: it compares mIoU by the first clusterer, against every reference of the config.
pub(crate) fn verdict_settings(config: &Config, compared: [String; 2]) -> VerdictSettings {
    VerdictSettings {
        compared,
        references: config.references(),
        clusterer: config.eval.clusterers[0].name().to_owned(),
        metric: MIOU,
        seed_deviation: 0.0,
        bootstrap: config.eval.bootstrap(),
    }
}

impl Run<'_> {
    /// Refuses a split whose test shapes come from too few files or repositories for an interval.
    ///
    /// # Errors
    /// If there are too few.
    pub(crate) fn ensure_test_groups(&self) -> Result<()> {
        let reference = &self.config.references()[0];
        let test = self.data.test()?;
        let mut groups: BTreeSet<&str> = BTreeSet::new();
        for shape in test {
            // Only these shapes are in the mean that a verdict compares.
            if KBin::of(n_labels(shape.labels_by(reference)?)).is_in_mean() {
                groups.insert(&shape.group);
            }
        }
        let (found, needed) = (groups.len(), self.config.eval.bootstrap().least_groups);
        let few = VerdictError::FewGroups { found, needed };
        ensure!(
            found >= needed,
            UsageError(format!("{few}{}", self.sufficient_groups(found, needed)))
        );
        Ok(())
    }

    /// Refuses two sources that label all shapes alike, because their backbones are then the same.
    ///
    /// # Errors
    /// If they do.
    pub(crate) fn ensure_different_labels(&self, [first, second]: [&str; 2]) -> Result<()> {
        let shapes = &self.data.shapes;
        for shape in shapes.values() {
            if !is_same_partition(shape.labels_by(first)?, shape.labels_by(second)?) {
                return Ok(());
            }
        }
        bail!(UsageError(format!(
            "`{first}` and `{second}` label all {} shapes alike, so there is nothing to compare",
            shapes.len()
        )))
    }

    /// A text about the number of files that is enough for this number of test groups. It is empty if no group was found.
    fn sufficient_groups(&self, found: usize, needed: usize) -> String {
        let shapes = self.data.shapes.values();
        let all: BTreeSet<&str> = shapes.map(|shape| shape.group.as_str()).collect();
        if found == 0 {
            return String::new();
        }
        format!(
            ". With this split, about {} of them are enough, and there are {}; `--set 'split={{ train = 0.5, valid = 0.1, test = \
             0.4 }}'` tests more of them",
            (all.len() * needed).div_ceil(found),
            all.len()
        )
    }

    /// The points of the held-out shapes near boundaries of reference parts, which all trainings share.
    ///
    /// # Errors
    /// If a shape was not labeled by a reference.
    pub(crate) fn boundaries(&self) -> Result<Boundaries> {
        Boundaries::of_shapes(&self.data.test()?, &self.config.references())
    }

    /// Scores one trained backbone on the held-out shapes.
    ///
    /// # Errors
    /// If it has seen a held-out shape, or does not belong to this run.
    pub(crate) fn score_trained(
        &self,
        supervision: &str,
        seed: u64,
        boundaries: &Boundaries,
    ) -> Result<Vec<ScoreRow>> {
        let test = self.data.test()?;
        let model = self.held_out(&test).model(supervision, seed)?;
        let scored = ScoredModel {
            supervision,
            seed,
            embedder: Embedder::Network(&model),
        };
        let context = ScoringContext {
            config: self.config,
            references: self.config.references(),
            boundaries,
            folder: None,
        };
        evaluate(&context, &scored, &test, &self.execution.progress)
    }
}

/// Whether two lists of labels divide the points alike, by whatever numbers. Points without a label must be the same.
fn is_same_partition(first: &[i32], second: &[i32]) -> bool {
    let is_function = |from: &[i32], to: &[i32]| {
        let mut image = BTreeMap::new();
        from.iter()
            .zip(to)
            .all(|(from, to)| image.entry(*from).or_insert(*to) == to && (*from < 0) == (*to < 0))
    };
    first.len() == second.len() && is_function(first, second) && is_function(second, first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partitions_are_compared_without_their_numbers() {
        for (second, is_same) in [
            ([3, 3, 1, -1], true),
            ([0, 0, 1, -1], true),
            ([0, 1, 1, -1], false),
            ([0, 0, 0, -1], false),
            ([0, 0, 1, 2], false),
        ] {
            assert_eq!(
                is_same_partition(&[0, 0, 5, -1], &second),
                is_same,
                "{second:?}"
            );
        }
    }
}
