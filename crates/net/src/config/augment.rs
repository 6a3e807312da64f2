//! Defines the table `[augment]`: the random changes that a shape gets each time it is trained on.

use super::{ConfigError, ensure, is_positive};
use serde::{Deserialize, Serialize};

/// The random changes that a shape gets each time it is trained on.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AugmentConfig {
    /// Whether to apply one of the 24 rotations that map the axes onto each other.
    pub axis_rotations: bool,
    /// Probability of an additional uniformly random rotation.
    pub free_rotation_probability: f64,
    /// Probability of a reflection.
    pub reflect_probability: f64,
    /// Range of the factor that scales the unit sphere.
    pub scale: [f64; 2],
    /// Standard deviation of the noise on a token's position, in unit-sphere units. Normals do not change.
    pub jitter_sigma: f64,
    /// The noise is cut off at this size.
    pub jitter_clip: f64,
}

impl Default for AugmentConfig {
    /// Rotations, reflections, scales from 0.8 to 1.2, and a little noise.
    fn default() -> Self {
        Self {
            axis_rotations: true,
            free_rotation_probability: 0.5,
            reflect_probability: 0.5,
            scale: [0.8, 1.2],
            jitter_sigma: 0.005,
            jitter_clip: 0.02,
        }
    }
}

impl AugmentConfig {
    /// Refuses probabilities outside 0..=1 and scales that are not positive.
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
