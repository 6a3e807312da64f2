//! Defines the settings that every backbone with serialized attention has: patches, curves, and the probability of dropped paths.

use super::backbone::BackboneSettings;
use super::stages::Stages;
use crate::config::{ConfigError, ensure};
use crate::data::curve::Curve;
use crate::data::hierarchy::{CurveOrders, fixed_orders, shuffled_orders};
use crate::model::layers::NormKind;
use partprobe_carrier::Rng;
use serde::{Deserialize, Serialize};

/// The settings of a config that concern the serialization of shapes.
#[derive(Clone, Copy)]
pub(crate) struct Serialization<'a> {
    /// The number of levels of tokens.
    pub(crate) n_levels: usize,
    /// Number of tokens in a patch.
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
        // The curves are drawn in any case, so that this setting does not change other random numbers.
        let shuffled = shuffled_orders(self.n_levels, self.orders, rng);
        if self.shuffle_orders {
            shuffled
        } else {
            self.test_orders()
        }
    }
}

/// The named sizes of a backbone. The default is the smallest one.
pub trait SizePreset: Copy + Default + 'static {
    /// Every size, beginning with the smallest.
    const SIZES: &'static [Self];

    /// The name that a config file uses.
    fn size_name(self) -> &'static str;

    /// Depths and widths.
    fn size_stages(self) -> Stages;
}

/// The settings of a backbone with serialized attention and without further settings.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields, default)]
#[serde(bound(deserialize = "P: SizePreset + Deserialize<'de>"))]
pub struct SerializedConfig<P> {
    /// Depths and widths of the stages.
    pub preset: P,
    /// Number of tokens in a patch of the serialized attention.
    pub patch: usize,
    /// The norm of stem, pooling and unpooling; blocks always have LayerNorm.
    pub norm: NormKind,
    /// Highest probability with which training leaves out a branch of a block. It is drawn for each token.
    pub drop_path: f64,
    /// The curves that serialize a shape, in the order in which the blocks of a stage take turns.
    pub orders: Vec<Curve>,
    /// Whether training shuffles the curves on each level, independently for each shape and step.
    pub shuffle_orders: bool,
}

impl<P: SizePreset> Default for SerializedConfig<P> {
    /// The smallest size, with all curves.
    fn default() -> Self {
        Self {
            preset: P::default(),
            patch: 128,
            norm: NormKind::Layer,
            drop_path: 0.0,
            orders: Curve::ALL.to_vec(),
            shuffle_orders: true,
        }
    }
}

impl<P: SizePreset> SerializedConfig<P> {
    fn serialization(&self) -> Serialization<'_> {
        Serialization {
            n_levels: self.stages().n_levels(),
            patch: self.patch,
            orders: &self.orders,
            shuffle_orders: self.shuffle_orders,
            drop_path: self.drop_path,
        }
    }
}

impl<P: SizePreset> BackboneSettings for SerializedConfig<P> {
    fn check(&self) -> Result<(), ConfigError> {
        self.serialization().check()
    }

    fn stages(&self) -> Stages {
        self.preset.size_stages()
    }

    fn named_sizes(&self) -> Vec<(&'static str, Self)> {
        let with_preset = |&preset: &P| Self {
            preset,
            ..self.clone()
        };
        P::SIZES
            .iter()
            .map(|preset| (preset.size_name(), with_preset(preset)))
            .collect()
    }

    fn runs_batch_as_one(&self) -> bool {
        self.norm == NormKind::Batch
    }

    fn test_orders(&self) -> CurveOrders {
        self.serialization().test_orders()
    }

    fn training_orders(&self, rng: &mut Rng) -> CurveOrders {
        self.serialization().training_orders(rng)
    }
}
