//! Defines the table `[optim]`: AdamW, its learning-rate schedule, and the clipping of the gradient.

use super::{ConfigError, ensure, is_positive};
use serde::{Deserialize, Serialize};

/// AdamW, its learning-rate schedule, and the clipping of the gradient.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct OptimConfig {
    /// The highest learning rate of the schedule.
    pub learning_rate: f64,
    /// Decoupled weight decay. Biases and norms do not decay.
    pub weight_decay: f64,
    /// The learning rate of the blocks (xCPE, attention, perceptron), as a multiple of the learning rate of the other layers.
    pub block_lr_factor: f64,
    /// The gradient of a step is scaled down to this Euclidean norm over all parameters.
    pub clip_norm: f64,
    /// How the learning rate changes over the steps.
    pub schedule: ScheduleConfig,
}

impl Default for OptimConfig {
    /// A learning rate of 0.001 with one cycle, and gradients with a norm of at most 3.
    fn default() -> Self {
        Self {
            learning_rate: 1e-3,
            weight_decay: 0.02,
            block_lr_factor: 1.0,
            clip_norm: 3.0,
            schedule: ScheduleConfig::default(),
        }
    }
}

/// How the learning rate changes; in TOML `schedule = { type = "one-cycle", … }`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ScheduleConfig {
    /// Half a cosine up from `learning_rate / div`, then half a cosine down to `learning_rate / div / final_div`.
    OneCycle {
        /// Fraction of the steps that go up.
        warmup_fraction: f64,
        /// The first learning rate is the highest one divided by this.
        div: f64,
        /// The last learning rate is the first one divided by this.
        final_div: f64,
    },
    /// A straight line up from 0, then half a cosine down to `learning_rate × final_fraction`.
    Cosine {
        /// Fraction of the steps that go up.
        warmup_fraction: f64,
        /// The last learning rate, as a fraction of the highest one.
        final_fraction: f64,
    },
    /// The same learning rate at each step.
    Constant,
    /// A straight line up, a constant learning rate, and a straight line down at the end. The lengths of the lines are given in
    /// steps, so a training without a line down can be made longer.
    Trapezoid {
        /// Steps that go up.
        warmup_steps: usize,
        /// Steps at the end that go down towards 0.
        cooldown_steps: usize,
    },
}

impl Default for ScheduleConfig {
    /// One cycle: a rise over a twentieth of the updates, then a fall to a thousandth of the first rate.
    fn default() -> Self {
        Self::OneCycle {
            warmup_fraction: 0.05,
            div: 10.0,
            final_div: 1000.0,
        }
    }
}

impl OptimConfig {
    /// Refuses rates below 0 and schedules without an end. A learning rate of 0 is allowed. Then nothing is trained.
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
    /// Refuses lines up and down that are longer than the training: the highest rate would never be reached.
    ///
    /// # Errors
    /// If a trapezoid has no room in this number of updates.
    pub fn ensure_fits(&self, n_steps: usize) -> Result<(), ConfigError> {
        let Self::Trapezoid {
            warmup_steps,
            cooldown_steps,
        } = self
        else {
            return Ok(());
        };
        ensure(
            warmup_steps.saturating_add(*cooldown_steps) <= n_steps,
            "optim.schedule",
            "must leave room: warmup_steps and cooldown_steps are together more than all updates of the training",
        )
    }

    fn check(&self) -> Result<(), ConfigError> {
        let check_warmup = |fraction| {
            ensure(
                (0.0..1.0).contains(fraction),
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
            Self::Constant | Self::Trapezoid { .. } => Ok(()),
        }
    }
}
