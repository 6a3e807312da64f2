//! Draws random numbers that depend on a key and on nothing else.

use rand::{Rng as _, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};

/// The generator that every seeded step uses.
pub type Rng = ChaCha8Rng;

/// The generator for one purpose on one shape: the same key gives the same numbers on any machine.
///
/// `key` names the purpose and the shape, for example `["sample", shape_id]`. The length of an entry counts, so `["ab", "c"]` and
/// `["a", "bc"]` differ.
#[must_use]
pub fn keyed_rng(seed: u64, key: &[&str]) -> Rng {
    let mut hash = Sha256::new();
    hash.update(seed.to_le_bytes());
    for word in key {
        hash.update((word.len() as u64).to_le_bytes());
        hash.update(word.as_bytes());
    }
    Rng::from_seed(hash.finalize().into())
}

/// A uniform random number in [0, 1) with 53 random bits.
#[must_use]
pub fn unit_interval(rng: &mut Rng) -> f64 {
    (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_separate_streams() {
        let draw = |seed, key: &[&str]| keyed_rng(seed, key).next_u64();
        assert_eq!(draw(1, &["a", "b"]), draw(1, &["a", "b"]));
        assert_ne!(draw(1, &["a", "b"]), draw(2, &["a", "b"]));
        assert_ne!(draw(1, &["ab", "c"]), draw(1, &["a", "bc"]));
    }
}
