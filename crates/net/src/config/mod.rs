//! Defines the settings of a backbone and of its training: typed, without defaults (those stand in `configs/base.toml`),
//! unknown keys refused, and checked once by `check`.

mod training;

pub use training::{
    AugmentConfig, Hinge, LossConfig, LossWeight, NoDefect, OptimConfig, ScheduleConfig,
    TokenConfig, TrainConfig, TrainSettings, Voxels,
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

pub(crate) fn ensure(
    holds: bool,
    key: &'static str,
    problem: &'static str,
) -> Result<(), ConfigError> {
    if holds {
        Ok(())
    } else {
        Err(ConfigError { key, problem })
    }
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value.is_finite()
}

/// The implementation of tensor operations that a network runs on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backend {
    /// burn-flex, the fast CPU backend.
    #[default]
    Flex,
    /// burn-ndarray: slower, an independent cross-check.
    #[cfg(feature = "ndarray")]
    Ndarray,
    /// A GPU by way of Vulkan, Metal, DirectX or WebGPU, on burn's own operations.
    #[cfg(feature = "wgpu")]
    Wgpu,
    /// An NVIDIA GPU, on burn's own operations.
    #[cfg(feature = "cuda")]
    Cuda,
}
