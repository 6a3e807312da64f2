//! Defines the typed settings, one table per stage. `configs/base.toml` documents each value. The texts are not repeated here.

use super::endpoint::EndpointConfig;
use super::training_tables::{
    AugmentConfig, LossConfig, NetConfig, NoFault, OptimConfig, TokenConfig,
};
use super::{ClustererName, MetricName, SourceTable};
use crate::usage::UsageError;
use anyhow::Result;
use partprobe_cluster::ClustererSettings;
use partprobe_eval::Bootstrap;
use partprobe_label::{Kernel, Unit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// All settings of a run.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Config {
    pub(crate) data: DataConfig,
    pub(crate) synth: SynthConfig,
    pub(crate) label: LabelConfig,
    pub(crate) sample: SampleConfig,
    pub(crate) select: SelectConfig,
    pub(crate) split: SplitConfig,
    pub(crate) compare: CompareConfig,
    pub(crate) net: NetConfig,
    pub(crate) tokens: TokenConfig,
    pub(crate) loss: LossConfig,
    pub(crate) optim: OptimConfig,
    pub(crate) augment: AugmentConfig,
    pub(crate) train: TrainTable,
    pub(crate) eval: EvalConfig,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) sources: BTreeMap<String, SourceTable>,
    /// Conditions under which the backbones are scored again.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) endpoints: Vec<EndpointConfig>,
    #[serde(default)]
    pub(crate) expect: BTreeMap<String, String>,
    /// If it is present, `run` fits one network per shape instead of training backbones.
    #[cfg(feature = "train")]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) implicit: Option<crate::implicit::ImplicitConfig>,
    /// A program without training reads the table and ignores it.
    #[cfg(not(feature = "train"))]
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) implicit: Option<toml::Table>,
}

/// The origin of shapes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DataConfig {
    pub(crate) source: DataSource,
    pub(crate) paths: Vec<PathBuf>,
}

/// The kinds of data.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DataSource {
    /// Parts that the program generates.
    Synth,
    /// Files, folders, lists, or a labeled data set.
    Paths,
}

/// The generated parts.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SynthConfig {
    pub(crate) n: u64,
    pub(crate) seed: u64,
    pub(crate) min_parts: u32,
    pub(crate) max_parts: u32,
}

/// What can be kept of the true surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Attribute {
    /// The outward unit normal.
    Normal,
    /// The surface's parameters.
    Uv,
    /// The principal curvatures and their directions.
    Curvature,
}

/// Partition and tessellation.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LabelConfig {
    pub(crate) unit: Unit,
    pub(crate) kernel: Kernel,
    pub(crate) emit: Vec<Emit>,
    pub(crate) instances: bool,
    pub(crate) theta_deg: f64,
    pub(crate) tau_min: u32,
    pub(crate) chord_fraction: f64,
    pub(crate) angle_rad: f64,
    /// The largest fraction of a closed solid's volume by which its triangles may change it, or 0 for no limit.
    pub(crate) volume_loss: f64,
    pub(crate) attributes: Vec<Attribute>,
    /// Data sets without further layers do not record this key, like those of earlier programs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) layers: Vec<String>,
    pub(crate) compress: bool,
    pub(crate) max_file_mb: u64,
    pub(crate) max_entities: u64,
    pub(crate) max_triangles: u64,
    pub(crate) memory_mb: u64,
    pub(crate) watchdog_s: u64,
}

/// What is written for a shape.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize, clap::ValueEnum,
)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Emit {
    /// The arrays of the faces and the graph of their edges, without a mesh.
    Labels,
    /// The mesh with all labels.
    Carrier,
    /// Sampled points with normals and labels, with the settings of `[sample]`.
    Points,
}

/// Which normals sampled points get.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum NormalConfig {
    /// The normal of the triangle.
    Triangle,
    /// The normal of the true surface.
    Analytic,
}

/// The point sample.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SampleConfig {
    pub(crate) n_points: usize,
    pub(crate) normals: NormalConfig,
    pub(crate) seed: u64,
}

/// The choice of the shapes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SelectConfig {
    pub(crate) min_parts: usize,
    pub(crate) max_parts: usize,
    pub(crate) max_shapes: usize,
}

/// The fractions of the shapes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SplitConfig {
    pub(crate) train: f64,
    pub(crate) valid: f64,
    pub(crate) test: f64,
    pub(crate) collection_separator: String,
    pub(crate) near_difference: f64,
    pub(crate) manifest: String,
    /// Runs that train on all training shapes do not record this key, like those of earlier programs.
    #[serde(default = "whole", skip_serializing_if = "is_whole")]
    pub(crate) train_share: f64,
    pub(crate) seed: u64,
}

/// The fraction that means all training shapes.
fn whole() -> f64 {
    1.0
}

#[expect(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde passes a reference"
)]
fn is_whole(share: &f64) -> bool {
    *share >= whole()
}

/// The settings of the comparison.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CompareConfig {
    pub(crate) supervision: Vec<String>,
    pub(crate) references: Vec<String>,
    /// Older runs do not have this key, and it is not written if it has the value of these runs.
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    pub(crate) score_against_supervisions: bool,
    pub(crate) primary: Vec<String>,
    pub(crate) seeds: Vec<u64>,
}

fn yes() -> bool {
    true
}

/// Which checkpoint is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Keep {
    /// The last one.
    Last,
    /// The best by the supervision's own validation score.
    Best,
}

/// The training loop.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainTable {
    pub(crate) steps: usize,
    pub(crate) epochs: usize,
    pub(crate) batch_shapes: usize,
    pub(crate) accumulate: usize,
    pub(crate) valid_every: usize,
    pub(crate) valid_every_epochs: usize,
    pub(crate) valid_metric: MetricName,
    pub(crate) patience: usize,
    pub(crate) keep: Keep,
    pub(crate) checkpoint_every: usize,
    /// The file of weights with which a training starts. `{source}` and `{seed}` are replaced by those of the training.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) init: Option<String>,
    /// The parts of the network that keep their weights.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) freeze: Vec<String>,
    /// Runs of earlier versions have this key. Now, a training with a fault is started by `--inject-fault`.
    #[serde(default, rename = "sabotage", skip_serializing)]
    pub(crate) fault: NoFault,
}

impl TrainTable {
    /// The number of updates of a training on `n_shapes` shapes.
    #[must_use]
    pub(crate) fn n_steps(&self, n_shapes: usize) -> usize {
        if self.epochs == 0 {
            self.steps
        } else {
            self.epochs.saturating_mul(self.epoch_steps(n_shapes))
        }
    }

    /// The number of updates between two validations. It is 0 if there is only the last validation.
    #[must_use]
    pub(crate) fn n_steps_between_validations(&self, n_shapes: usize) -> usize {
        match self.valid_every_epochs {
            0 => self.valid_every,
            epochs => epochs.saturating_mul(self.epoch_steps(n_shapes)),
        }
    }

    /// The number of updates that use each shape once. The last of them may also use some shapes of the next epoch.
    fn epoch_steps(&self, n_shapes: usize) -> usize {
        n_shapes
            .div_ceil(self.batch_shapes.saturating_mul(self.accumulate).max(1))
            .max(1)
    }
}

/// Clustering and statistics.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EvalConfig {
    pub(crate) clusterers: Vec<ClustererName>,
    pub(crate) restarts: usize,
    pub(crate) max_iterations: usize,
    pub(crate) tolerance: f64,
    pub(crate) bootstrap: usize,
    pub(crate) seed: u64,
    pub(crate) embeddings: bool,
}

impl EvalConfig {
    /// The settings of every clusterer.
    pub(crate) fn clusterer_settings(&self) -> ClustererSettings {
        ClustererSettings {
            restarts: self.restarts,
            max_iterations: self.max_iterations,
            tolerance: self.tolerance,
        }
    }

    /// The bootstrap of the intervals of a run.
    pub(crate) fn bootstrap(&self) -> Bootstrap {
        Bootstrap {
            draws: self.bootstrap,
            seed: self.seed,
            least_groups: Bootstrap::LEAST_GROUPS,
        }
    }
}

impl Config {
    #[cfg(feature = "train")]
    /// The preparation of shapes for the networks of this config: overrides of keys, in the form of a file of weights.
    #[must_use]
    pub(crate) fn preparation(&self) -> serde_json::Value {
        let mut keys = serde_json::json!({
            "sample.n_points": self.sample.n_points,
            "sample.normals": self.sample.normals,
            "sample.seed": self.sample.seed,
            "tokens.test_tokens": self.tokens.test_tokens,
            "tokens.voxels": self.tokens.voxels,
        });
        // Earlier versions do not know this key. They can read the weights if it is left out at its default.
        if self.tokens.test_poses > 1 {
            keys["tokens.test_poses"] = self.tokens.test_poses.into();
        }
        keys
    }

    /// The settings of `[label]` in the form of `--set`, with the normals of the true surface if `[sample]` needs them.
    ///
    /// # Errors
    /// Never for settings that were read from a config.
    #[cfg(feature = "train")]
    pub(crate) fn labeling_overrides(&self) -> Result<Vec<String>> {
        let table = serde_json::to_value(&self.label)?;
        let settings = table.as_object().into_iter().flatten();
        let mut overrides: Vec<String> = settings
            .map(|(key, value)| format!("label.{key}={value}"))
            .collect();
        if self.sample.normals == NormalConfig::Analytic {
            overrides.push("label.attributes=[\"normal\"]".to_owned());
        }
        Ok(overrides)
    }

    /// Refuses a config of the implicit probe, which trains no backbone.
    ///
    /// # Errors
    /// If the config has a table `[implicit]`. The message names the command that reads it.
    #[cfg(feature = "train")]
    pub(crate) fn ensure_point_probe(&self) -> Result<(), UsageError> {
        if self.implicit.is_none() {
            return Ok(());
        }
        let message = "this config has a table [implicit]: it fits a network to each shape and trains no backbone; \
                       `partprobe run` does all of it, and `partprobe run CONFIG --out RUN --resume` scores what is missing";
        Err(UsageError(message.to_owned()))
    }

    /// The label sources against which predictions are scored, each once: those of `compare.references`, and the supervisions
    /// after them if `compare.score_against_supervisions` is set.
    #[must_use]
    pub(crate) fn references(&self) -> Vec<String> {
        let compare = &self.compare;
        if compare.score_against_supervisions {
            self.label_sources()
        } else {
            each_once(&compare.references)
        }
    }

    /// The label sources that must label every shape of the run, each once: the references and the supervisions.
    #[must_use]
    pub(crate) fn label_sources(&self) -> Vec<String> {
        let compare = &self.compare;
        each_once(compare.references.iter().chain(&compare.supervision))
    }
}

/// The names in their order, without repetitions.
fn each_once<'a>(names: impl IntoIterator<Item = &'a String>) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::new();
    for name in names {
        if !distinct.contains(name) {
            distinct.push(name.clone());
        }
    }
    distinct
}

/// The keys of [`Config::preparation`], as overrides of a config.
#[cfg(feature = "train")]
pub(crate) fn overrides_of_preparation(preparation: &serde_json::Value) -> Vec<String> {
    let settings = preparation.as_object().into_iter().flatten();
    let prepares = |key: &str| key.starts_with("sample.") || key.starts_with("tokens.");
    settings
        .filter(|(key, _)| prepares(key))
        .map(|(key, value)| format!("{key}={value}"))
        .collect()
}

#[cfg(test)]
mod tests {
    use crate::config::load;

    #[track_caller]
    fn check(overrides: &[&str], references: &[&str], label_sources: &[&str]) {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let config = load("base", &overrides).unwrap().config;
        assert_eq!(config.references(), references);
        assert_eq!(config.label_sources(), label_sources);
    }

    #[test]
    fn supervisions_are_references_unless_the_config_says_otherwise() {
        let arms = r#"compare.supervision=["brep-face","step-parts"]"#;
        let both = ["step-parts", "brep-face"];
        check(&[arms], &both, &both);
        let alone = "compare.score_against_supervisions=false";
        check(&[arms, alone], &["step-parts"], &both);
    }

    #[test]
    fn a_run_has_a_reference() {
        let overrides = [
            "compare.score_against_supervisions=false",
            "compare.references=[]",
        ]
        .map(str::to_owned);
        let error = load("base", &overrides).unwrap_err();
        assert!(format!("{error:#}").contains("compare.references"));
    }
}
