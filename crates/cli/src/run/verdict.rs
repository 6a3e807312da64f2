//! Scores single trainings of a run, for a verdict before all of them are done.

use super::evaluation::{Embedder, ScoredModel, evaluate};
use super::held_out::HeldOut;
use super::scoring_place::{Boundaries, ScoringPlace};
use super::stages::Run;
use crate::config::Config;
use anyhow::Result;
use partprobe_eval::{Bootstrap, MIOU, ScoreRow, VerdictSettings};

/// What a verdict compares: mIoU by the first clusterer, with every reference of the config as a referee.
pub(crate) fn verdict_settings(config: &Config, compared: [String; 2]) -> VerdictSettings {
    VerdictSettings {
        compared,
        references: config.references(),
        clusterer: config.eval.clusterers[0].name().to_owned(),
        metric: MIOU,
        seed_deviation: 0.0,
        bootstrap: Bootstrap {
            draws: config.eval.bootstrap,
            seed: config.eval.seed,
            least_groups: Bootstrap::LEAST_GROUPS,
        },
    }
}

impl Run<'_> {
    /// Scores one trained backbone on the held-out shapes.
    ///
    /// # Errors
    /// If it has seen a held-out shape, or is not of this run.
    pub(crate) fn score_trained(&self, supervision: &str, seed: u64) -> Result<Vec<ScoreRow>> {
        let test = self.data.test()?;
        let held_out = HeldOut {
            folder: self.folder,
            config: self.config,
            n_train: test.n_train,
            test: &test.shapes,
            backend: self.execution.backend,
        };
        let model = held_out.model(supervision, seed)?;
        let scored = ScoredModel {
            supervision,
            seed,
            embedder: Embedder::Network(&model),
        };
        let references = self.config.references();
        let place = ScoringPlace {
            config: self.config,
            boundaries: Boundaries::of_shapes(&test.shapes, &references)?,
            references,
            folder: None,
        };
        evaluate(&place, &scored, &test.shapes, &self.execution.progress)
    }
}
