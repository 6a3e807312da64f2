//! Defines the tables of a config that say how a backbone is trained.

use super::{ConfigError, ensure, is_positive};
use serde::{Deserialize, Serialize};

/// Weights, margins and temperature of the `cosdisc` loss.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LossConfig {
    /// Weight of the pull of each embedding towards the center of its part.
    pub pull_weight: f64,
    /// Weight of the push between the centers of different parts.
    pub push_weight: f64,
    /// Weight of the prototype cross-entropy.
    pub proto_ce_weight: f64,
    /// An embedding whose cosine with its center exceeds 1 − `pull_margin` is not pulled.
    pub pull_margin: f64,
    /// Two centers whose cosine is below `push_margin` are not pushed.
    pub push_margin: f64,
    /// Temperature of the prototype cross-entropy.
    pub temperature: f64,
    /// How pull and push grow beyond their margins.
    pub hinge: Hinge,
    /// What counts alike in pull and cross-entropy.
    pub weight: LossWeight,
}

/// How pull and push grow beyond their margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hinge {
    /// In proportion to what is missing.
    Linear,
    /// With the square of it: far ones move first, near ones hardly.
    Squared,
}

/// What counts alike in pull and cross-entropy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossWeight {
    /// Each part, however small.
    Part,
    /// Each token, so that a large part outweighs a small one.
    Point,
}

impl LossConfig {
    /// Refuses weights below 0 and margins that no cosine can reach.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let weights = [
            ("loss.pull_weight", self.pull_weight),
            ("loss.push_weight", self.push_weight),
            ("loss.proto_ce_weight", self.proto_ce_weight),
        ];
        for (key, weight) in weights {
            ensure(
                weight >= 0.0 && weight.is_finite(),
                key,
                "must be 0 or positive",
            )?;
        }
        ensure(
            weights.iter().any(|(_, weight)| *weight > 0.0),
            "loss",
            "needs at least one weight above 0",
        )?;
        ensure(
            (0.0..=2.0).contains(&self.pull_margin),
            "loss.pull_margin",
            "must be from 0 to 2",
        )?;
        ensure(
            (-1.0..=1.0).contains(&self.push_margin),
            "loss.push_margin",
            "must be from -1 to 1",
        )?;
        ensure(
            self.temperature >= 1e-3 && self.temperature.is_finite(),
            "loss.temperature",
            "must be at least 0.001",
        )
    }
}

/// AdamW, its learning-rate schedule, and the clipping of the gradient.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OptimConfig {
    /// The highest learning rate of the schedule.
    pub learning_rate: f64,
    /// Decoupled weight decay; biases and norms do not decay.
    pub weight_decay: f64,
    /// The learning rate of the blocks (xCPE, attention, perceptron), in learning rates of the rest.
    pub block_lr_factor: f64,
    /// The gradient of a step is scaled down to this Euclidean norm over all parameters.
    pub clip_norm: f64,
    /// How the learning rate changes over the steps.
    pub schedule: ScheduleConfig,
}

/// How the learning rate changes; in TOML `schedule = { type = "one-cycle", … }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ScheduleConfig {
    /// Half a cosine up from `learning_rate / div`, then half a cosine down to `learning_rate / div / final_div`.
    OneCycle {
        /// Share of the steps that go up.
        warmup_fraction: f64,
        /// The first learning rate is the highest one divided by this.
        div: f64,
        /// The last learning rate is the first one divided by this.
        final_div: f64,
    },
    /// A straight line up from 0, then half a cosine down to `learning_rate × final_fraction`.
    Cosine {
        /// Share of the steps that go up.
        warmup_fraction: f64,
        /// The last learning rate, in highest ones.
        final_fraction: f64,
    },
    /// The same learning rate at each step.
    Constant,
}

impl OptimConfig {
    /// Refuses rates below 0 and schedules without an end. A learning rate of 0 is allowed: it trains nothing.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure(
            self.learning_rate >= 0.0 && self.learning_rate.is_finite(),
            "optim.learning_rate",
            "must be 0 or positive",
        )?;
        ensure(
            (0.0..=1.0).contains(&self.weight_decay),
            "optim.weight_decay",
            "must be from 0 to 1",
        )?;
        ensure(
            is_positive(self.clip_norm),
            "optim.clip_norm",
            "must be positive",
        )?;
        ensure(
            self.block_lr_factor >= 0.0 && self.block_lr_factor.is_finite(),
            "optim.block_lr_factor",
            "must be 0 or positive",
        )?;
        self.schedule.check()
    }
}

impl ScheduleConfig {
    fn check(&self) -> Result<(), ConfigError> {
        let check_warmup = |share| {
            ensure(
                (0.0..1.0).contains(share),
                "optim.schedule.warmup_fraction",
                "must be from 0 to below 1",
            )
        };
        match self {
            Self::OneCycle {
                warmup_fraction,
                div,
                final_div,
            } => {
                check_warmup(warmup_fraction)?;
                ensure(is_positive(*div), "optim.schedule.div", "must be positive")?;
                ensure(
                    is_positive(*final_div),
                    "optim.schedule.final_div",
                    "must be positive",
                )
            }
            Self::Cosine {
                warmup_fraction,
                final_fraction,
            } => {
                check_warmup(warmup_fraction)?;
                ensure(
                    (0.0..=1.0).contains(final_fraction),
                    "optim.schedule.final_fraction",
                    "must be from 0 to 1",
                )
            }
            Self::Constant => Ok(()),
        }
    }
}

/// The random changes that a shape gets each time it is trained on.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AugmentConfig {
    /// Turn by one of the 24 rotations that map the axes onto each other.
    pub axis_rotations: bool,
    /// Probability of a uniformly random rotation as well.
    pub free_rotation_probability: f64,
    /// Probability of a reflection.
    pub reflect_probability: f64,
    /// Range of the factor that scales the unit sphere.
    pub scale: [f64; 2],
    /// Standard deviation of the noise on a token's position, in unit-sphere units; normals keep theirs.
    pub jitter_sigma: f64,
    /// The noise is cut off at this size.
    pub jitter_clip: f64,
}

impl AugmentConfig {
    /// Refuses probabilities outside 0..=1 and scales that turn a shape inside out.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        let unit = 0.0..=1.0;
        ensure(
            unit.contains(&self.free_rotation_probability),
            "augment.free_rotation_probability",
            "must be from 0 to 1",
        )?;
        ensure(
            unit.contains(&self.reflect_probability),
            "augment.reflect_probability",
            "must be from 0 to 1",
        )?;
        let [low, high] = self.scale;
        ensure(
            is_positive(low) && low <= high && high.is_finite(),
            "augment.scale",
            "must be two positive numbers, the lower first",
        )?;
        ensure(
            unit.contains(&self.jitter_sigma),
            "augment.jitter_sigma",
            "must be from 0 to 1",
        )?;
        ensure(
            unit.contains(&self.jitter_clip),
            "augment.jitter_clip",
            "must be from 0 to 1",
        )
    }
}

/// Which points share a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Voxels {
    /// Those of one cell whose normals have one dominant axis.
    NormalKeyed,
    /// All of one cell, as in PTv3: the two sides of a thin plate share tokens.
    Plain,
}

/// How many tokens a shape is cut into.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TokenConfig {
    /// About so many tokens a shape in training.
    pub train_tokens: usize,
    /// About so many tokens a shape at test time.
    pub test_tokens: usize,
    /// Which points share a token.
    pub voxels: Voxels,
}

impl TokenConfig {
    /// Refuses token counts with which nothing can be told apart.
    ///
    /// # Errors
    /// If a count is below 8.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure(
            self.train_tokens >= 8,
            "tokens.train_tokens",
            "must be at least 8",
        )?;
        ensure(
            self.test_tokens >= 8,
            "tokens.test_tokens",
            "must be at least 8",
        )
    }
}

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
    /// Always [`NoDefect::None`]; checkpoints hold the key.
    #[serde(default, rename = "sabotage")]
    pub defect: NoDefect,
}

impl TrainConfig {
    /// Shapes of an update.
    #[must_use]
    pub fn update_shapes(&self) -> usize {
        self.batch_shapes.saturating_mul(self.accumulate)
    }
}

/// The one value that is left of a former setting: earlier versions could build a defect into a training by it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NoDefect {
    /// A sound training.
    #[default]
    None,
}

/// Everything that a training depends on, beside the network and the shapes.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
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

#[cfg(test)]
mod tests {
    use super::*;

    fn loss() -> LossConfig {
        LossConfig {
            pull_weight: 1.0,
            push_weight: 1.0,
            proto_ce_weight: 1.0,
            pull_margin: 0.1,
            push_margin: 0.3,
            temperature: 0.1,
            hinge: Hinge::Linear,
            weight: LossWeight::Part,
        }
    }

    fn optim() -> OptimConfig {
        let schedule = ScheduleConfig::OneCycle {
            warmup_fraction: 0.05,
            div: 10.0,
            final_div: 1000.0,
        };
        OptimConfig {
            learning_rate: 1e-3,
            weight_decay: 0.02,
            block_lr_factor: 1.0,
            clip_norm: 3.0,
            schedule,
        }
    }

    fn augment() -> AugmentConfig {
        AugmentConfig {
            axis_rotations: true,
            free_rotation_probability: 0.5,
            reflect_probability: 0.5,
            scale: [0.8, 1.2],
            jitter_sigma: 0.005,
            jitter_clip: 0.02,
        }
    }

    #[track_caller]
    fn check(result: Result<(), ConfigError>, key: Option<&str>) {
        assert_eq!(result.err().map(|error| error.key), key);
    }

    #[test]
    fn a_loss_without_weights_or_with_an_unreachable_margin_is_refused() {
        check(loss().check(), None);
        check(
            LossConfig {
                push_weight: -1.0,
                ..loss()
            }
            .check(),
            Some("loss.push_weight"),
        );
        check(
            LossConfig {
                pull_margin: f64::NAN,
                ..loss()
            }
            .check(),
            Some("loss.pull_margin"),
        );
        check(
            LossConfig {
                push_margin: 1.5,
                ..loss()
            }
            .check(),
            Some("loss.push_margin"),
        );
        check(
            LossConfig {
                temperature: 0.0,
                ..loss()
            }
            .check(),
            Some("loss.temperature"),
        );
        let nothing = LossConfig {
            pull_weight: 0.0,
            push_weight: 0.0,
            proto_ce_weight: 0.0,
            ..loss()
        };
        check(nothing.check(), Some("loss"));
    }

    #[test]
    fn optimizer_and_augmentation_ranges_hold() {
        check(optim().check(), None);
        check(
            OptimConfig {
                learning_rate: 0.0,
                ..optim()
            }
            .check(),
            None,
        );
        check(
            OptimConfig {
                learning_rate: f64::INFINITY,
                ..optim()
            }
            .check(),
            Some("optim.learning_rate"),
        );
        check(
            OptimConfig {
                clip_norm: 0.0,
                ..optim()
            }
            .check(),
            Some("optim.clip_norm"),
        );
        let endless = ScheduleConfig::OneCycle {
            warmup_fraction: 1.0,
            div: 10.0,
            final_div: 1000.0,
        };
        check(
            OptimConfig {
                schedule: endless,
                ..optim()
            }
            .check(),
            Some("optim.schedule.warmup_fraction"),
        );
        let cosine = |warmup_fraction, final_fraction| OptimConfig {
            schedule: ScheduleConfig::Cosine {
                warmup_fraction,
                final_fraction,
            },
            ..optim()
        };
        check(cosine(0.0, 0.0).check(), None);
        check(
            cosine(-0.1, 0.0).check(),
            Some("optim.schedule.warmup_fraction"),
        );
        check(
            cosine(0.1, 1.5).check(),
            Some("optim.schedule.final_fraction"),
        );
        check(
            OptimConfig {
                block_lr_factor: f64::NAN,
                ..optim()
            }
            .check(),
            Some("optim.block_lr_factor"),
        );
        check(augment().check(), None);
        check(
            AugmentConfig {
                scale: [1.2, 0.8],
                ..augment()
            }
            .check(),
            Some("augment.scale"),
        );
        check(
            AugmentConfig {
                reflect_probability: 1.1,
                ..augment()
            }
            .check(),
            Some("augment.reflect_probability"),
        );
    }

    #[test]
    fn lengths_of_nothing_are_refused() {
        check(
            TokenConfig {
                train_tokens: 7,
                test_tokens: 8,
                voxels: Voxels::Plain,
            }
            .check(),
            Some("tokens.train_tokens"),
        );
        let settings = |steps, batch_shapes, accumulate| TrainSettings {
            loss: loss(),
            optim: optim(),
            augment: augment(),
            tokens: TokenConfig {
                train_tokens: 512,
                test_tokens: 1024,
                voxels: Voxels::NormalKeyed,
            },
            train: TrainConfig {
                steps,
                batch_shapes,
                accumulate,
                seed: 0,
                defect: NoDefect::None,
            },
        };
        check(settings(1, 2, 3).check(), None);
        check(settings(0, 2, 1).check(), Some("train.steps"));
        check(settings(1, 0, 1).check(), Some("train.batch_shapes"));
        check(settings(1, 2, 0).check(), Some("train.accumulate"));
    }
}
