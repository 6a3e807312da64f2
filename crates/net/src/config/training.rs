//! Defines the length and the seed of a training, and joins all tables that determine it.

use super::{AugmentConfig, ConfigError, LossConfig, OptimConfig, TokenConfig, ensure};
use serde::{Deserialize, Serialize};

/// The length of a training and its seed.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TrainConfig {
    /// Number of updates of the weights.
    pub steps: usize,
    /// Number of shapes per batch.
    pub batch_shapes: usize,
    /// Number of batches per update. The gradient of an update is the mean over all of their shapes.
    pub accumulate: usize,
    /// Seed of the initial weights, the order of the shapes, the serialization and the augmentation.
    pub seed: u64,
    /// The sections of the network whose weights do not change, given by beginnings of parameter names, for example `encoder.0`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub freeze: Vec<String>,
    /// Always [`NoFault::None`]. Checkpoints contain the key.
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

    /// The number of shapes per update.
    #[must_use]
    pub fn update_shapes(&self) -> usize {
        self.batch_shapes.saturating_mul(self.accumulate)
    }
}

/// The only remaining value of a former setting, by which earlier versions could inject a fault into a training.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoFault {
    /// A training without a fault.
    #[default]
    None,
}

/// All settings of a training except those of the network and the shapes.
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
    /// Checks each table, and that there is at least one update and one shape per batch.
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
