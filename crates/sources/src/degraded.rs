//! Computes the inputs of the degraded sources: the STEP-Parts label of each face, and random choices.
//!
//! A degraded source draws its random numbers by seed, shape and kind of damage, and never by the dose. A higher dose
//! therefore adds damage to that of a lower one, and the agreement with STEP-Parts can only fall.

use partprobe_carrier::{Carrier, Partition, Rng};
use rand::Rng as _;

/// The STEP-Parts of the faces, after small parts were absorbed.
pub(crate) fn step_parts(carrier: &Carrier) -> Partition {
    Partition::from_keys(carrier.part_of_face())
}

/// A random number from 0 to `n` - 1, or 0 if `n` is 0.
pub(crate) fn below(rng: &mut Rng, n: usize) -> usize {
    // The bias is only n in 2⁶⁴.
    (rng.next_u64() % (n.max(1) as u64)) as usize
}

/// Puts the items into a random order.
pub(crate) fn shuffle<T>(items: &mut [T], rng: &mut Rng) {
    for end in (1..items.len()).rev() {
        items.swap(end, below(rng, end + 1));
    }
}
