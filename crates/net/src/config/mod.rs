//! Defines the settings of a backbone and of its training. They are typed, unknown keys are refused, and `check` checks them
//! once.
//!
//! `Default` repeats `configs/base.toml` for callers without a config file. A test of the program compares both. No key of a
//! config file has a default here.

mod augment;
mod loss;
mod optim;
#[cfg(test)]
mod tests;
mod tokens;
mod training;

pub use augment::AugmentConfig;
pub use loss::{Hinge, LossConfig, LossWeight, Pull};
pub use optim::{OptimConfig, ScheduleConfig};
pub use tokens::{TokenConfig, TrainTokens, Voxels};
pub use training::{NoFault, TrainConfig, TrainSettings};

use serde::{Deserialize, Serialize};

/// A value that cannot be used.
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

/// The implementation of tensor operations that a network uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
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
