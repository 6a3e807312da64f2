//! Computes distances and products of rows, in an order of additions that is the same on every machine.

/// Sums run in this many lanes, so that the compiler may use vector registers without changing the result.
const LANES: usize = 16;

/// Adds `term(a, b)` over the entries of two rows.
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
