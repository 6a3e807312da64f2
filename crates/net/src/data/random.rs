//! Random numbers in [0, 1) from a keyed generator.

use partprobe_carrier::Rng;
use rand::Rng as _;

/// A number in [0, 1) with 53 random bits.
pub(crate) fn unit_interval(rng: &mut Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}
