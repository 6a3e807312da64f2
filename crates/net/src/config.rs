//! The settings of a backbone and of its training: typed, without defaults (those stand in `configs/base.toml`),
//! unknown keys refused, and checked once by `check`.

mod training;

pub use training::{
    AugmentConfig, Hinge, LossConfig, LossWeight, OptimConfig, Sabotage, ScheduleConfig, TokenConfig, TrainConfig,
    TrainSettings,
};

use serde::{Deserialize, Serialize};

/// A value that no stage can work with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{key} {problem}")]
pub struct ConfigError {
    /// The key as a config file writes it, with its table.
    pub key: &'static str,
    /// What the value must be.
    pub problem: &'static str,
}

fn ensure(holds: bool, key: &'static str, problem: &'static str) -> Result<(), ConfigError> {
    if holds { Ok(()) } else { Err(ConfigError { key, problem }) }
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

/// A backbone and the embedding head above it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NetConfig {
    /// The network that gives each token its features.
    pub backbone: BackboneConfig,
    /// Length of an embedding (paper: 128).
    pub embedding_dim: usize,
}

/// The choice of a backbone; in TOML `backbone = { type = "ptv3", preset = "micro", patch = 128 }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum BackboneConfig {
    /// Point Transformer V3.
    Ptv3 {
        /// Depths and widths of the stages.
        preset: Preset,
        /// Tokens in a patch of the serialised attention.
        patch: usize,
    },
    /// A shared perceptron with one global maximum: the baseline without neighbourhoods.
    Pointnet {
        /// Widths of the layers before the maximum; the last one is the length of the global feature.
        widths: Vec<usize>,
    },
}

/// The named sizes of PTv3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Three stages, half a million parameters: trains on a CPU.
    Micro,
}

impl NetConfig {
    /// Refuses sizes that no network can have.
    ///
    /// # Errors
    /// If a size is 0 or a patch holds no more than one token.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure((1..=4096).contains(&self.embedding_dim), "net.embedding_dim", "must lie in 1..=4096")?;
        match &self.backbone {
            BackboneConfig::Ptv3 { patch, .. } => {
                ensure((2..=65_536).contains(patch), "net.backbone.patch", "must lie in 2..=65536")
            }
            BackboneConfig::Pointnet { widths } => ensure(
                !widths.is_empty() && widths.iter().all(|width| (1..=4096).contains(width)),
                "net.backbone.widths",
                "must hold at least one width, each in 1..=4096",
            ),
        }
    }
}

/// The implementation of tensor operations that a network runs on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// burn-flex, the fast CPU backend.
    #[default]
    Flex,
    /// burn-ndarray: slower, an independent cross-check.
    Ndarray,
    /// A GPU by way of Vulkan, Metal, DirectX or WebGPU, on burn's own operations.
    #[cfg(feature = "wgpu")]
    Wgpu,
    /// An NVIDIA GPU, on burn's own operations.
    #[cfg(feature = "cuda")]
    Cuda,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(result: Result<(), ConfigError>, key: Option<&str>) {
        assert_eq!(result.err().map(|error| error.key), key);
    }

    #[test]
    fn sizes_of_nothing_are_refused() {
        let ptv3 = |patch, embedding_dim| NetConfig {
            backbone: BackboneConfig::Ptv3 { preset: Preset::Micro, patch },
            embedding_dim,
        };
        check(ptv3(128, 128).check(), None);
        check(ptv3(1, 128).check(), Some("net.backbone.patch"));
        check(ptv3(128, 0).check(), Some("net.embedding_dim"));
        let pointnet = NetConfig { backbone: BackboneConfig::Pointnet { widths: vec![] }, embedding_dim: 128 };
        check(pointnet.check(), Some("net.backbone.widths"));
    }
}
