//! Scores single trainings of a run, for a verdict before all of them are done.

use super::evaluation::{Embedder, ScoredModel, evaluate};
use super::scoring_context::{Boundaries, ScoringContext};
use super::stages::Run;
use crate::config::Config;
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_eval::{MIOU, ScoreRow, VerdictError, VerdictSettings};
use std::collections::BTreeSet;

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
        let test = self.data.test()?;
        let groups: BTreeSet<&str> = test.iter().map(|shape| shape.group.as_str()).collect();
        let (found, needed) = (groups.len(), self.config.eval.bootstrap().least_groups);
        ensure!(
            found >= needed,
            UsageError(VerdictError::FewGroups { found, needed }.to_string())
        );
        Ok(())
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
