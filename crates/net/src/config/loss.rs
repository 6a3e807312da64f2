//! Defines the table `[loss]`: weights, margins and temperature of the `cosdisc` loss.

use super::{ConfigError, ensure};
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
    /// An embedding that is nearer to its center than this distance is not pulled. [`Pull`] defines the distance.
    pub pull_margin: f64,
    /// Two centers whose cosine is below `push_margin` are not pushed.
    pub push_margin: f64,
    /// Temperature of the prototype cross-entropy.
    pub temperature: f64,
    /// The distance of an embedding from the center of its part.
    #[serde(default, skip_serializing_if = "Pull::is_default")]
    pub pull: Pull,
    /// How pull and push grow beyond their margins.
    pub hinge: Hinge,
    /// The items that have equal weight in pull and cross-entropy.
    pub weight: LossWeight,
}

impl Default for LossConfig {
    /// The weights, margins and temperature of the shipped configs, weighted by point.
    fn default() -> Self {
        Self {
            pull_weight: 2.0,
            push_weight: 1.0,
            proto_ce_weight: 1.0,
            pull_margin: 0.0,
            push_margin: 0.3,
            temperature: 0.1,
            pull: Pull::Cosine,
            hinge: Hinge::Linear,
            weight: LossWeight::Point,
        }
    }
}

/// The distance of an embedding from the center of its part, in the pull.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Pull {
    /// 1 − cosine, as in the paper. Its slope vanishes at the center, so parts do not become narrow.
    #[default]
    Cosine,
    /// The chord √(2 − 2·cosine), the distance that k-means measures. It pulls equally strongly near the center and far from it.
    Chord,
}

impl Pull {
    /// Whether this is the distance of the paper. Settings that were stored before this choice existed do not contain it.
    fn is_default(&self) -> bool {
        *self == Self::Cosine
    }
}

/// How pull and push grow beyond their margins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Hinge {
    /// In proportion to the excess.
    Linear,
    /// With the square of the excess. Embeddings with a large excess move first, and those with a small one hardly move.
    Squared,
}

/// The items that have equal weight in pull and cross-entropy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossWeight {
    /// Each part, independently of its size.
    Part,
    /// Each token, so a large part has more weight than a small one.
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
