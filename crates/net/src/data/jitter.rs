//! Adds noise to the positions of tokens, for training.

use super::tokens::Tokens;
use crate::config::AugmentConfig;
use partprobe_carrier::{Rng, unit_interval};

/// Moves each token's position by normal noise, cut off at `jitter_clip`; the points' own noise would average out.
pub(crate) fn jitter(tokens: &mut Tokens, config: &AugmentConfig, rng: &mut Rng) {
    if config.jitter_sigma == 0.0 {
        return;
    }
    let clip = config.jitter_clip;
    for coordinate in tokens.positions.iter_mut().flatten() {
        let [u, v] = [(); 2].map(|()| unit_interval(rng));
        // Box–Muller; 1 − u is never 0.
        let normal = (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos();
        *coordinate += (config.jitter_sigma * normal).clamp(-clip, clip) as f32;
    }
}
