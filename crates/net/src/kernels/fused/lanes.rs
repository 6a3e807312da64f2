//! Computes sums and exponentials of rows in lanes.
//!
//! Sums run in 16 lanes on every processor, and fused products are written explicitly. So the result does not depend on the width
//! of the processor's vectors.

/// Number of accumulators of a sum, and of columns of a tile.
pub(super) const LANES: usize = 16;

/// The sum of `term` over two rows of equal length.
#[inline(always)]
pub(super) fn lane_sum(a: &[f32], b: &[f32], term: impl Fn(f32, f32) -> f32) -> f32 {
    let (a_lanes, a_rest) = a.as_chunks::<LANES>();
    let (b_lanes, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0f32; LANES];
    for (x, y) in a_lanes.iter().zip(b_lanes) {
        for lane in 0..LANES {
            sums[lane] += term(x[lane], y[lane]);
        }
    }
    let mut rest = 0.0;
    for (&x, &y) in a_rest.iter().zip(b_rest) {
        rest += term(x, y);
    }
    // The halves are added to each other. If the lanes were added one after the other, each sum would wait for the previous one.
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            sums[lane] += sums[lane + width];
        }
        width /= 2;
    }
    sums[0] + rest
}

/// The largest number of a row, or −∞ for an empty row.
#[inline(always)]
pub(super) fn lane_max(row: &[f32]) -> f32 {
    let (lanes, rest) = row.as_chunks::<LANES>();
    let mut highest = [f32::NEG_INFINITY; LANES];
    for chunk in lanes {
        for lane in 0..LANES {
            highest[lane] = if highest[lane] < chunk[lane] {
                chunk[lane]
            } else {
                highest[lane]
            };
        }
    }
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            let other = highest[lane + width];
            highest[lane] = if highest[lane] < other {
                other
            } else {
                highest[lane]
            };
        }
        width /= 2;
    }
    let mut most = highest[0];
    for &x in rest {
        most = if most < x { x } else { most };
    }
    most
}

/// Copies a row. Short rows are copied without a function call, unlike in `copy_from_slice`.
#[inline(always)]
pub(super) fn copy_row(row: &[f32], target: &mut [f32]) {
    let (lanes, rest) = row.as_chunks::<LANES>();
    let (target_lanes, target_rest) = target.as_chunks_mut::<LANES>();
    for (target, lane) in target_lanes.iter_mut().zip(lanes) {
        *target = *lane;
    }
    for (target, x) in target_rest.iter_mut().zip(rest) {
        *target = *x;
    }
}

/// e^x for x in −87..=0, accurate to about 2 ulp and without a function call: 2^n times a polynomial of the rest.
#[inline(always)]
pub(super) fn exp_of_negative(x: f32) -> f32 {
    /// Adding this number rounds to a whole number, which is then in the lowest bits.
    const ROUND: f32 = 12_582_912.0;
    /// ln 2 as the sum of two numbers. The first one is exact with few bits.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = if x < -87.0 { -87.0 } else { x };
    let shifted = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = n.mul_add(-LN_2[1], n.mul_add(-LN_2[0], x));
    // The Taylor series up to r⁷. |r| is at most ln(2)/2.
    let series: f32 = 1.0 / 5040.0;
    let series = series.mul_add(r, 1.0 / 720.0);
    let series = series.mul_add(r, 1.0 / 120.0);
    let series = series.mul_add(r, 1.0 / 24.0);
    let series = series.mul_add(r, 1.0 / 6.0);
    let series = series.mul_add(r, 0.5);
    let series = series.mul_add(r, 1.0).mul_add(r, 1.0);
    let exponent = shifted.to_bits() << 23;
    f32::from_bits(series.to_bits().wrapping_add(exponent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_right_to_its_last_bits() {
        for step in 0..=8700 {
            let x = -(step as f32) / 100.0;
            let exact = f64::from(x).exp();
            assert!(
                (f64::from(exp_of_negative(x)) / exact - 1.0).abs() < 4e-7,
                "{x}"
            );
        }
        assert!(exp_of_negative(-1000.0) < 1e-37);
        assert!(exp_of_negative(f32::NAN).is_nan());
    }

    #[test]
    fn sums_count_every_number_once() {
        for n in [0, 1, 15, 16, 17, 48, 100] {
            let ones = vec![1.0; n];
            assert_eq!(lane_sum(&ones, &ones, |x, y| x + y), 2.0 * n as f32);
        }
    }

    #[test]
    fn the_maximum_is_found_at_any_place() {
        for (n, at) in [(1, 0), (16, 15), (17, 16), (40, 3)] {
            let row: Vec<f32> = (0..n)
                .map(|i| if i == at { 2.0 } else { -(i as f32) })
                .collect();
            assert_eq!(lane_max(&row), 2.0);
        }
        assert_eq!(lane_max(&[]), f32::NEG_INFINITY);
    }
}
