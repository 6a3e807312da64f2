//! Computes sine, cosine, exponential and logistic functions of many numbers, without a call per number.

/// Adding this number rounds to a whole number, which is then in the lowest bits.
const ROUND: f32 = 12_582_912.0;

/// Sine and cosine to about 2 ulp of 1, for arguments up to 10⁴.
///
/// The argument is reduced to a quarter turn around 0 (Cody and Waite, "Software manual for the elementary functions", 1980),
/// where Taylor's series are short.
#[inline(always)]
pub(crate) fn sine_and_cosine(x: f32) -> [f32; 2] {
    /// π/2 in three parts, of which the first two are exact in few bits.
    const HALF_PI: [f32; 3] = [1.570_312_5, 4.837_513e-4, 7.549_789_5e-8];
    let shifted = x.mul_add(std::f32::consts::FRAC_2_PI, ROUND);
    let n = shifted - ROUND;
    let r = n.mul_add(-HALF_PI[0], x);
    let r = n.mul_add(-HALF_PI[1], r);
    let r = n.mul_add(-HALF_PI[2], r);

    let rr = r * r;
    let s = rr.mul_add(2.755_731_9e-6, -1.984_127e-4);
    let s = s.mul_add(rr, 8.333_333e-3);
    let s = s.mul_add(rr, -1.666_666_7e-1);
    let sine = (s * rr).mul_add(r, r);
    let c = rr.mul_add(-2.755_732e-7, 2.480_158_7e-5);
    let c = c.mul_add(rr, -1.388_888_9e-3);
    let c = c.mul_add(rr, 4.166_666_8e-2);
    let c = c.mul_add(rr, -0.5);
    let cosine = c.mul_add(rr, 1.0);

    let quarter = shifted.to_bits();
    let is_odd = quarter & 1 == 1;
    let [s, c] = if is_odd {
        [cosine, sine]
    } else {
        [sine, cosine]
    };
    let sign_of_sine = (quarter & 2) << 30;
    let sign_of_cosine = (quarter.wrapping_add(1) & 2) << 30;
    [
        f32::from_bits(s.to_bits() ^ sign_of_sine),
        f32::from_bits(c.to_bits() ^ sign_of_cosine),
    ]
}

/// e^x for x in −87..=0 to about 2 ulp: 2^n times a polynomial of the rest.
#[inline(always)]
pub(crate) fn exp_of_negative(x: f32) -> f32 {
    /// ln 2 in two parts, of which the first one is exact in few bits.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    let x = if x < -87.0 { -87.0 } else { x };
    let shifted = x.mul_add(std::f32::consts::LOG2_E, ROUND);
    let n = shifted - ROUND;
    let r = n.mul_add(-LN_2[1], n.mul_add(-LN_2[0], x));
    let series = r.mul_add(1.0 / 5040.0, 1.0 / 720.0);
    let series = series.mul_add(r, 1.0 / 120.0);
    let series = series.mul_add(r, 1.0 / 24.0);
    let series = series.mul_add(r, 1.0 / 6.0);
    let series = series.mul_add(r, 0.5);
    let series = series.mul_add(r, 1.0).mul_add(r, 1.0);
    f32::from_bits(series.to_bits().wrapping_add(shifted.to_bits() << 23))
}

/// 1/(1 + e^−x) and ln(1 + e^x).
#[inline(always)]
pub(crate) fn sigmoid_and_softplus(x: f32) -> [f32; 2] {
    let e = exp_of_negative(-x.abs());
    let smaller = e / (1.0 + e);
    let sigmoid = if x < 0.0 { smaller } else { 1.0 - smaller };
    // ln(1 + e) = 2·artanh(e / (2 + e)), whose argument is at most 1/3.
    let t = e / (2.0 + e);
    let tt = t * t;
    let series = tt.mul_add(1.0 / 13.0, 1.0 / 11.0);
    let series = series.mul_add(tt, 1.0 / 9.0);
    let series = series.mul_add(tt, 1.0 / 7.0);
    let series = series.mul_add(tt, 1.0 / 5.0);
    let series = series.mul_add(tt, 1.0 / 3.0);
    let series = series.mul_add(tt, 1.0);
    let positive = if x > 0.0 { x } else { 0.0 };
    [sigmoid, (2.0 * t).mul_add(series, positive)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_right_to_their_last_bits() {
        for step in -200_000..=200_000 {
            let x = step as f32 * 0.003;
            let [sine, cosine] = sine_and_cosine(x);
            let exact = f64::from(x);
            assert!((f64::from(sine) - exact.sin()).abs() < 3e-7, "{x}: {sine}");
            assert!(
                (f64::from(cosine) - exact.cos()).abs() < 3e-7,
                "{x}: {cosine}"
            );
        }
        assert!(sine_and_cosine(f32::NAN)[0].is_nan());
    }

    #[test]
    fn exponentials_and_logarithms_are_right() {
        for step in -8_000..=8_000 {
            let x = step as f32 * 0.01;
            let exact = f64::from(x);
            if x <= 0.0 {
                assert!(
                    (f64::from(exp_of_negative(x)) / exact.exp() - 1.0).abs() < 4e-7,
                    "{x}"
                );
            }
            let [sigmoid, softplus] = sigmoid_and_softplus(x);
            let expected = 1.0 / (1.0 + (-exact).exp());
            assert!(
                (f64::from(sigmoid) - expected).abs() < 2e-7,
                "{x}: {sigmoid}"
            );
            let expected = exact.max(0.0) + (-exact.abs()).exp().ln_1p();
            assert!(
                (f64::from(softplus) - expected).abs() < 3e-7 * (1.0 + expected),
                "{x}: {softplus}"
            );
        }
    }
}
