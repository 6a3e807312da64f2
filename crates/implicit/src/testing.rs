//! Makes numbers for tests.

use partprobe_carrier::{keyed_rng, unit_interval};

/// Numbers from −1 to 1, repeatable.
pub(crate) fn numbers(n: usize, key: &str) -> Vec<f32> {
    let rng = &mut keyed_rng(3, &[key]);
    (0..n)
        .map(|_| (2.0 * unit_interval(rng) - 1.0) as f32)
        .collect()
}
