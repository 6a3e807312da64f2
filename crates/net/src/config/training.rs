//! Defines the length and the seed of a training, and joins all tables that decide it.

use super::{AugmentConfig, ConfigError, LossConfig, OptimConfig, TokenConfig, ensure};
use serde::{Deserialize, Serialize};

/// The length of a training and its seed.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// Updates of the weights.
    pub steps: usize,
    /// Shapes that are computed together.
    pub batch_shapes: usize,
    /// Batches whose gradients make one update; it is the mean over all of their shapes.
    pub accumulate: usize,
    /// Seed of the initial weights, the order of the shapes, the serialization and the augmentation.
    pub seed: u64,
    /// The parts of the network that keep their weights: beginnings of parameter names, for example `encoder.0`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub freeze: Vec<String>,
    /// Always [`NoFault::None`]; checkpoints hold the key.
    #[serde(default, rename = "sabotage")]
    pub fault: NoFault,
}

impl Default for TrainConfig {
    /// 800 updates of four shapes each, with the seed 0.
    fn default() -> Self {
        Self {
            steps: 800,
            batch_shapes: 4,
            accumulate: 1,
            seed: 0,
            freeze: Vec::new(),
            fault: NoFault::None,
        }
    }
}

impl TrainConfig {
    /// Whether a parameter keeps its weights. The word `backbone` at the beginning of its name may be left out.
    #[must_use]
    pub fn freezes(&self, parameter: &str) -> bool {
        let below = parameter.strip_prefix("backbone.").unwrap_or(parameter);
        let is_of = |part: &str, name: &str| {
            name.strip_prefix(part)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let frozen = |part: &String| is_of(part, parameter) || is_of(part, below);
        self.freeze.iter().any(frozen)
    }

    /// Shapes of an update.
    #[must_use]
    pub fn update_shapes(&self) -> usize {
        self.batch_shapes.saturating_mul(self.accumulate)
    }
}

/// The one value that is left of a former setting: earlier versions could build a fault into a training by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoFault {
    /// A sound training.
    #[default]
    None,
}

/// Everything that a training depends on, apart from the network and the shapes.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TrainSettings {
    /// The objective.
    pub loss: LossConfig,
    /// The optimizer.
    pub optim: OptimConfig,
    /// The augmentation.
    pub augment: AugmentConfig,
    /// Sizes of the token sets.
    pub tokens: TokenConfig,
    /// Length and seed.
    pub train: TrainConfig,
}

impl TrainSettings {
    /// Checks each table and that there is something to do.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.loss.check()?;
        self.optim.check()?;
        self.augment.check()?;
        self.tokens.check()?;
        ensure(self.train.steps > 0, "train.steps", "must be positive")?;
        self.optim.schedule.ensure_fits(self.train.steps)?;
        let in_reach = 1..=1_000_000;
        ensure(
            in_reach.contains(&self.train.batch_shapes),
            "train.batch_shapes",
            "must be from 1 to 1000000",
        )?;
        ensure(
            in_reach.contains(&self.train.accumulate),
            "train.accumulate",
            "must be from 1 to 1000000",
        )
    }
}
