//! Adds noise to the positions of tokens, for training.

use super::tokens::Tokens;
use crate::config::AugmentConfig;
use partprobe_carrier::{Rng, unit_interval};

/// Moves each token's position by normal noise, cut off at `jitter_clip`. Noise on single points would average out.
pub(crate) fn jitter(tokens: &mut Tokens, config: &AugmentConfig, rng: &mut Rng) {
    if config.jitter_sigma == 0.0 {
        return;
    }
    let clip = config.jitter_clip;
    for coordinate in tokens.positions.iter_mut().flatten() {
        *coordinate += (config.jitter_sigma * standard_normal(rng)).clamp(-clip, clip) as f32;
    }
}

/// A number of the standard normal distribution.
pub(crate) fn standard_normal(rng: &mut Rng) -> f64 {
    let [u, v] = [(); 2].map(|()| unit_interval(rng));
    // The Box–Muller transform. 1 − u is never 0.
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
