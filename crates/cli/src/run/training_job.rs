//! Describes one training of a run: its inputs, the identity of its data, and its results.

use super::execution::Execution;
use super::folder::RunFolder;
use super::shapes::ShapeIdentity;
use super::training_args::TrainingProcessArgs;
use super::validation::Validation;
use crate::config::Config;
use anyhow::Result;
use partprobe_net::{ShapeKeys, TrainConfig, TrainSettings};
use serde::{Deserialize, Serialize};

/// The inputs of a training, except its shapes.
pub(crate) struct TrainingJob<'a> {
    pub(crate) folder: &'a RunFolder,
    pub(crate) config: &'a Config,
    pub(crate) supervision: &'a str,
    pub(crate) seed: u64,
    pub(crate) data: &'a TrainingData,
    pub(crate) execution: &'a Execution,
    pub(crate) args: &'a TrainingProcessArgs,
}

/// The identity of the shapes of a training.
#[derive(Clone, Debug)]
pub(crate) struct TrainingData {
    pub(crate) train: ShapeKeys,
    pub(crate) valid: ShapeKeys,
    /// The test shapes of the run, with their ids.
    pub(crate) test: Vec<(String, ShapeIdentity)>,
    /// A hash of the shapes' ids and carriers, in their order.
    pub(crate) digest: String,
}

/// The training settings of a config for a seed and a number of shapes.
pub(crate) fn train_settings(config: &Config, n_shapes: usize, seed: u64) -> TrainSettings {
    TrainSettings {
        loss: config.loss.clone(),
        optim: config.optim.clone(),
        augment: config.augment.clone(),
        tokens: config.tokens.clone(),
        train: TrainConfig {
            steps: config.train.n_steps(n_shapes),
            batch_shapes: config.train.batch_shapes,
            accumulate: config.train.accumulate,
            seed,
            freeze: config.train.freeze.clone(),
            fault: config.train.fault,
        },
    }
}

/// `training.json`: the record of a finished training.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct TrainingRecord {
    pub(super) format_version: u32,
    /// The number of updates that were made.
    pub(super) steps: usize,
    /// Whether patience ended it before its last step.
    pub(super) stopped_early: bool,
    /// The best validation.
    pub(super) best: Option<Validation>,
    /// Tensors that no gradient has reached. A correct training has none.
    pub(crate) untouched_tensors: Vec<String>,
    /// SHA-256 of the evaluated weights, in hexadecimal. It is `None` if an earlier version trained them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) weights_sha256: Option<String>,
}

impl TrainingRecord {
    /// The record of a finished training. Returns `None` if it is not finished.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn read(folder: &RunFolder, supervision: &str, seed: u64) -> Result<Option<Self>> {
        let path = format!("checkpoints/{supervision}-{seed}/training.json");
        if !folder.path(&path).exists() {
            return Ok(None);
        }
        folder
            .read_json(
                &path,
                "put back a copy of the file, or train again in a new run folder",
            )
            .map(Some)
    }
}

impl TrainingJob<'_> {
    /// The path of a file of this training, relative to the run folder.
    pub(super) fn path(&self, file: &str) -> String {
        format!("checkpoints/{}-{}/{file}", self.supervision, self.seed)
    }
}

/// The keys of shapes, in the form of files of weights.
pub(crate) fn keys_of<'a>(shapes: impl IntoIterator<Item = &'a ShapeIdentity>) -> ShapeKeys {
    ShapeKeys::of(
        shapes
            .into_iter()
            .map(|shape| (shape.source_sha256.as_str(), shape.mesh_hash.as_str())),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;
    use partprobe_net::NetConfig;

    #[test]
    fn the_defaults_of_the_network_and_its_training_are_those_of_base_toml() {
        let base = load("base", &[]).unwrap().config;
        assert_eq!(base.net, NetConfig::default());
        assert_eq!(train_settings(&base, 100, 0), TrainSettings::default());
    }
}
