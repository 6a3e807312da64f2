//! Defines the settings that every backbone with serialized attention has: patches, curves, and paths that training drops.

use crate::config::{ConfigError, ensure};
use crate::data::curve::Curve;
use crate::data::hierarchy::{CurveOrders, fixed_orders, shuffled_orders};
use partprobe_carrier::Rng;

/// The settings of a config, as far as they serialize shapes.
#[derive(Clone, Copy)]
pub(crate) struct Serialization<'a> {
    /// How many levels of tokens there are.
    pub(crate) n_levels: usize,
    /// Tokens in a patch.
    pub(crate) patch: usize,
    /// The curves, in the order in which the blocks of a stage take turns.
    pub(crate) orders: &'a [Curve],
    /// Whether training shuffles the curves on each level.
    pub(crate) shuffle_orders: bool,
    /// Highest probability of leaving out a branch of a block.
    pub(crate) drop_path: f64,
}

impl Serialization<'_> {
    /// Refuses settings that no network can have.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub(crate) fn check(self) -> Result<(), ConfigError> {
        ensure(
            (2..=65_536).contains(&self.patch),
            "net.backbone.patch",
            "must be from 2 to 65536",
        )?;
        ensure(
            (0.0..1.0).contains(&self.drop_path),
            "net.backbone.drop_path",
            "must be from 0 to below 1",
        )?;
        let is_new = |(idx, curve)| !self.orders[..idx].contains(curve);
        ensure(
            !self.orders.is_empty() && self.orders.iter().enumerate().all(is_new),
            "net.backbone.orders",
            "must name at least one of z, z-trans, hilbert, hilbert-trans, each once",
        )
    }

    /// The curves of each level at test time.
    pub(crate) fn test_orders(self) -> CurveOrders {
        fixed_orders(self.n_levels, self.orders)
    }

    /// The curves of each level for one training step.
    pub(crate) fn training_orders(self, rng: &mut Rng) -> CurveOrders {
        // Drawn in any case, so that the switch changes no other random number.
        let shuffled = shuffled_orders(self.n_levels, self.orders, rng);
        if self.shuffle_orders {
            shuffled
        } else {
            self.test_orders()
        }
    }
}
