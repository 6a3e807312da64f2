//! Evaluates clamped uniform B-splines of degree three over the unit interval, their derivatives and their integrals.

/// The degree of every spline here.
pub(crate) const DEGREE: usize = 3;

/// The knots of a spline with this number of control points. A multiple knot is repeated.
pub(crate) fn knots(n_points: usize) -> Vec<f64> {
    let n_spans = n_points - DEGREE;
    (0..n_points + DEGREE + 1)
        .map(|i| i.saturating_sub(DEGREE).min(n_spans) as f64 / n_spans as f64)
        .collect()
}

/// The distinct knots with their multiplicities.
pub(crate) fn multiplicities(n_points: usize) -> Vec<(f64, usize)> {
    let n_spans = n_points - DEGREE;
    let at_end = |i| {
        if i == 0 || i == n_spans {
            DEGREE + 1
        } else {
            1
        }
    };
    (0..=n_spans)
        .map(|i| (i as f64 / n_spans as f64, at_end(i)))
        .collect()
}

/// The Greville abscissae: with these control values, the spline is the identity.
pub(crate) fn greville(n_points: usize) -> Vec<f64> {
    let knots = knots(n_points);
    (0..n_points)
        .map(|i| knots[i + 1..=i + DEGREE].iter().sum::<f64>() / DEGREE as f64)
        .collect()
}

/// The integral of each basis function over the unit interval.
pub(crate) fn basis_integrals(n_points: usize) -> Vec<f64> {
    let knots = knots(n_points);
    (0..n_points)
        .map(|i| (knots[i + DEGREE + 1] - knots[i]) / (DEGREE + 1) as f64)
        .collect()
}

/// The values of all basis functions of this degree at `t`.
fn basis_of_degree(knots: &[f64], n_points: usize, degree: usize, t: f64) -> Vec<f64> {
    let last_span = n_points - 1;
    let span = (DEGREE..last_span)
        .find(|&i| t < knots[i + 1])
        .unwrap_or(last_span);
    let mut values = vec![0.0; knots.len() - 1];
    values[span] = 1.0;
    for k in 1..=degree {
        for i in 0..values.len() - k {
            let share = |from: usize, weight: f64| {
                let width = knots[from + k] - knots[from];
                if width > 0.0 { weight / width } else { 0.0 }
            };
            values[i] = share(i, t - knots[i]) * values[i]
                + share(i + 1, knots[i + k + 1] - t) * values[i + 1];
        }
    }
    values
}

/// The values of the basis functions at `t`, one for each control point.
pub(crate) fn basis(n_points: usize, t: f64) -> Vec<f64> {
    let mut values = basis_of_degree(&knots(n_points), n_points, DEGREE, t);
    values.truncate(n_points);
    values
}

/// The derivatives of the basis functions at `t`, one for each control point.
pub(crate) fn basis_slopes(n_points: usize, t: f64) -> Vec<f64> {
    let knots = knots(n_points);
    let lower = basis_of_degree(&knots, n_points, DEGREE - 1, t);
    let share = |i: usize| {
        let width = knots[i + DEGREE] - knots[i];
        if width > 0.0 {
            DEGREE as f64 * lower[i] / width
        } else {
            0.0
        }
    };
    (0..n_points).map(|i| share(i) - share(i + 1)).collect()
}

/// The point of the spline at `t`.
pub(crate) fn point<const N: usize>(controls: &[[f64; N]], t: f64) -> [f64; N] {
    blend(controls, &basis(controls.len(), t))
}

/// The derivative of the spline at `t`.
pub(crate) fn slope<const N: usize>(controls: &[[f64; N]], t: f64) -> [f64; N] {
    blend(controls, &basis_slopes(controls.len(), t))
}

/// The parameter of the spline's point that is nearest to `target`. The target must be on the spline or close to it.
pub(crate) fn nearest<const N: usize>(controls: &[[f64; N]], target: [f64; N]) -> f64 {
    let distance = |t: f64| {
        point(controls, t)
            .iter()
            .zip(target)
            .map(|(a, b)| (a - b) * (a - b))
            .sum::<f64>()
    };
    let n = 32 * controls.len();
    let at = |i: usize| i as f64 / n as f64;
    let best = (0..=n)
        .min_by(|&a, &b| distance(at(a)).total_cmp(&distance(at(b))))
        .unwrap_or(0);
    let (mut low, mut high) = (at(best.saturating_sub(1)), at((best + 1).min(n)));
    for _ in 0..60 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) {
            high = b
        } else {
            low = a
        }
    }
    0.5 * (low + high)
}

fn blend<const N: usize>(controls: &[[f64; N]], weights: &[f64]) -> [f64; N] {
    let mut sum = [0.0; N];
    for (control, weight) in controls.iter().zip(weights) {
        for (value, coordinate) in sum.iter_mut().zip(control) {
            *value += weight * coordinate;
        }
    }
    sum
}

/// Positions and weights of the eight-point Gauss rule on the unit interval.
const GAUSS: [(f64, f64); 8] = [
    (0.01985507175123186, 0.05061426814518813),
    (0.10166676129318664, 0.11119051722668724),
    (0.2372337950418355, 0.15685332293894366),
    (0.4082826787521751, 0.181341891689181),
    (0.591717321247825, 0.181341891689181),
    (0.7627662049581645, 0.15685332293894366),
    (0.8983332387068134, 0.11119051722668724),
    (0.9801449282487682, 0.05061426814518813),
];

/// The integral of `f` over the unit interval, split into equal pieces. It is exact if `f` is a polynomial of degree 15 or
/// less on each piece.
pub(crate) fn integral(n_pieces: usize, f: impl Fn(f64) -> f64) -> f64 {
    let width = 1.0 / n_pieces as f64;
    let piece = |i: usize| {
        GAUSS
            .iter()
            .map(|(t, weight)| weight * f((i as f64 + t) * width))
            .sum::<f64>()
    };
    (0..n_pieces).map(piece).sum::<f64>() * width
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_functions_sum_to_one_and_their_slopes_to_zero() {
        for n in 4..9 {
            for t in [0.0, 0.3, 0.5, 0.99, 1.0] {
                assert!((basis(n, t).iter().sum::<f64>() - 1.0).abs() < 1e-14);
                assert!(basis_slopes(n, t).iter().sum::<f64>().abs() < 1e-12);
            }
            assert!((basis_integrals(n).iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn greville_abscissae_give_the_identity() {
        for n in 4..9 {
            let controls: Vec<[f64; 1]> = greville(n).into_iter().map(|x| [x]).collect();
            for t in [0.0, 0.2, 0.7, 1.0] {
                assert!((point(&controls, t)[0] - t).abs() < 1e-14);
                assert!((slope(&controls, t)[0] - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn the_nearest_point_of_a_point_on_the_spline_is_itself() {
        let controls = [[0.0, 0.0], [1.0, 2.0], [3.0, 1.0], [4.0, -1.0], [5.0, 0.5]];
        for t in [0.0, 0.1, 0.5, 0.83, 1.0] {
            assert!((nearest(&controls, point(&controls, t)) - t).abs() < 1e-6);
        }
    }

    #[test]
    fn integrals_of_polynomials_are_exact() {
        assert!((integral(3, |t| t * t) - 1.0 / 3.0).abs() < 1e-14);
        assert!((integral(1, |t| 12.0 * t.powi(11)) - 1.0).abs() < 1e-12);
    }
}
