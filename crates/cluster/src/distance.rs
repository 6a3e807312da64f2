//! Computes distances and products of rows, in an order of additions that is the same on every machine.

use crate::points::{LANES, Lane};

/// Adds `term(a, b)` over the entries of two rows. The sums run in lanes, so that the compiler may use vector registers without
/// changing the result.
#[inline(always)]
fn sum_over_entries(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let ((a_blocks, a_rest), (b_blocks, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a_blocks.iter().zip(b_blocks) {
        for lane in 0..LANES {
            sums[lane] += term(a[lane], b[lane]);
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(&a, &b)| term(a, b)).sum();
    sums.iter().sum::<f32>() + rest
}

/// The squared Euclidean distance. It is exactly 0 for equal rows, and does not depend on the order of the rows, bit by bit.
#[inline(always)]
pub(crate) fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    sum_over_entries(a, b, |a, b| (a - b) * (a - b))
}

/// The squared distances of a block of rows to several rows, bit by bit those of [`squared_distance`]. They take less time than
/// one after the other, because a block of rows is added at once.
///
/// `block` has one number of each of its rows per entry.
#[inline(always)]
pub(crate) fn squared_distances<const N: usize>(block: &[Lane], others: [&[f32]; N]) -> [Lane; N] {
    let (entries, rest) = block.as_chunks::<LANES>();
    let mut chunks = [&[[0.0; LANES]; 0][..]; N];
    let mut rests = [&[0.0; 0][..]; N];
    for n in 0..N {
        let (chunks_of_other, rest_of_other) = others[n].as_chunks::<LANES>();
        // Slices of known length need no check in the loop.
        chunks[n] = &chunks_of_other[..entries.len()];
        rests[n] = &rest_of_other[..rest.len()];
    }

    let mut totals = [[0.0; LANES]; N];
    for lane in 0..LANES {
        let mut sums = [[0.0; LANES]; N];
        for (at, entries) in entries.iter().enumerate() {
            for n in 0..N {
                add_squared_differences(&mut sums[n], &entries[lane], chunks[n][at][lane]);
            }
        }
        add_lanes(&mut totals, &sums);
    }
    let mut sums = [[0.0; LANES]; N];
    for (at, entries) in rest.iter().enumerate() {
        for n in 0..N {
            add_squared_differences(&mut sums[n], entries, rests[n][at]);
        }
    }
    add_lanes(&mut totals, &sums);
    totals
}

#[inline(always)]
fn add_squared_differences(sums: &mut Lane, entries: &Lane, other: f32) {
    for row in 0..LANES {
        let difference = entries[row] - other;
        sums[row] += difference * difference;
    }
}

#[inline(always)]
fn add_lanes<const N: usize>(totals: &mut [Lane; N], sums: &[Lane; N]) {
    for n in 0..N {
        for row in 0..LANES {
            totals[n][row] += sums[n][row];
        }
    }
}

/// The scalar product. It does not depend on the order of the rows, bit by bit.
#[inline(always)]
pub(crate) fn product(a: &[f32], b: &[f32]) -> f32 {
    sum_over_entries(a, b, |a, b| a * b)
}

/// The norm, in double precision.
pub(crate) fn norm(row: &[f32]) -> f64 {
    row.iter()
        .map(|&x| f64::from(x) * f64::from(x))
        .sum::<f64>()
        .sqrt()
}

/// The rows' values, each row divided by its norm. A row of norm 0 does not change.
pub(crate) fn unit_rows(values: &[f32], dim: usize) -> Vec<f32> {
    let mut unit = Vec::with_capacity(values.len());
    for row in values.chunks_exact(dim) {
        let norm = norm(row);
        unit.extend(row.iter().map(|&x| {
            if norm > 0.0 {
                (f64::from(x) / norm) as f32
            } else {
                x
            }
        }));
    }
    unit
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn all_lanes_and_the_remainder_are_summed(pairs in proptest::collection::vec((-2.0f32..2.0, -2.0f32..2.0), 0..70)) {
            let (a, b): (Vec<f32>, Vec<f32>) = pairs.into_iter().unzip();
            let exact = |term: fn(f64, f64) -> f64| -> f64 {
                a.iter().zip(&b).map(|(&a, &b)| term(f64::from(a), f64::from(b))).sum()
            };
            prop_assert!((f64::from(squared_distance(&a, &b)) - exact(|a, b| (a - b) * (a - b))).abs() < 1e-3);
            prop_assert!((f64::from(product(&a, &b)) - exact(|a, b| a * b)).abs() < 1e-3);
            prop_assert_eq!(squared_distance(&a, &b), squared_distance(&b, &a));
            prop_assert_eq!(squared_distance(&a, &a), 0.0);

            // A block in which the third row is b, and the others are a.
            let entry = |(&a, &b): (&f32, &f32)| std::array::from_fn(|row| if row == 2 { b } else { a });
            let block: Vec<Lane> = a.iter().zip(&b).map(entry).collect();
            let [to_a, to_b] = squared_distances(&block, [&a, &b]);
            let distance = squared_distance(&a, &b);
            prop_assert_eq!(to_a, std::array::from_fn(|row| if row == 2 { distance } else { 0.0 }));
            prop_assert_eq!(to_b, std::array::from_fn(|row| if row == 2 { 0.0 } else { distance }));
        }
    }

    #[test]
    fn unit_rows_have_norm_one_and_zero_stays() {
        assert_eq!(
            unit_rows(&[3.0, 4.0, 0.0, 0.0, 0.0, -3e30], 2),
            [0.6, 0.8, 0.0, 0.0, 0.0, -1.0]
        );
    }
}
