//! Evaluates the B-spline basis functions that do not vanish at a parameter, and their first derivatives.
//!
//! The functions follow the recurrence of Cox and de Boor: L. Piegl and W. Tiller, *The NURBS Book*, 2nd edition, Springer 1997,
//! algorithms A2.1 (knot span) and A2.2 (basis functions). The derivatives are those of equation 2.7.

/// The highest degree that is evaluated.
pub(crate) const MAX_DEGREE: usize = 30;

/// Why poles and knots do not make a B-spline.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BsplineError {
    /// The degree is outside 1..=30.
    #[error("B-spline degree {degree} is outside 1..=30")]
    Degree {
        /// The degree as given.
        degree: usize,
    },
    /// There are too few poles for the degree, or the poles do not fill the grid.
    #[error("{poles} poles are too few or don't fill the grid for degree {degree}")]
    PoleCount {
        /// Number of poles.
        poles: usize,
        /// Polynomial degree.
        degree: usize,
    },
    /// The numbers of knots and poles do not fit the degree.
    #[error("{knots} knots where poles and degree ask for {expected}")]
    KnotCount {
        /// Number of knots with multiplicities written out.
        knots: usize,
        /// Number of knots that the poles and the degree require.
        expected: usize,
    },
    /// A knot is smaller than the previous one, or all knots are equal.
    #[error("the knots decrease or span nothing")]
    KnotOrder,
    /// A pole or knot is infinite or not a number.
    #[error("a pole or knot is not finite")]
    NotFinite,
    /// A weight is zero or negative.
    #[error("a weight is not positive")]
    Weight,
}

/// The basis functions that do not vanish at a parameter, and their derivatives.
pub(crate) struct Basis<const N: usize> {
    /// Index of the pole to which the first of these functions belongs.
    pub(crate) first: usize,
    /// Values of the `degree + 1` functions.
    pub(crate) value: [f64; N],
    /// Their derivatives.
    pub(crate) slope: [f64; N],
}

/// Checks one direction of a B-spline: degree, number of poles, knots.
pub(crate) fn check_knots(
    degree: usize,
    n_poles: usize,
    knots: &[f64],
) -> Result<(), BsplineError> {
    if !(1..=MAX_DEGREE).contains(&degree) {
        return Err(BsplineError::Degree { degree });
    }
    if n_poles <= degree {
        return Err(BsplineError::PoleCount {
            poles: n_poles,
            degree,
        });
    }
    if knots.len() != n_poles + degree + 1 {
        return Err(BsplineError::KnotCount {
            knots: knots.len(),
            expected: n_poles + degree + 1,
        });
    }
    if knots.iter().any(|knot| !knot.is_finite()) {
        return Err(BsplineError::NotFinite);
    }
    if knots.windows(2).any(|pair| pair[0] > pair[1]) || knots[degree] >= knots[n_poles] {
        return Err(BsplineError::KnotOrder);
    }
    Ok(())
}

/// Checks homogeneous poles.
pub(crate) fn check_poles(poles: &[[f64; 4]]) -> Result<(), BsplineError> {
    if poles.iter().flatten().any(|x| !x.is_finite()) {
        return Err(BsplineError::NotFinite);
    }
    if poles.iter().any(|pole| pole[3] <= 0.0) {
        return Err(BsplineError::Weight);
    }
    Ok(())
}

/// The index `s` of the knot span `knots[s] ≤ t < knots[s + 1]` of positive length. Beyond the ends it is the first or the last
/// span.
fn span(knots: &[f64], degree: usize, n_poles: usize, t: f64) -> usize {
    if t >= knots[n_poles] {
        let mut s = n_poles - 1;
        while s > degree && knots[s] >= knots[s + 1] {
            s -= 1;
        }
        return s;
    }
    let above = knots[degree..=n_poles].partition_point(|&knot| knot <= t);
    let mut s = (degree + above)
        .saturating_sub(1)
        .clamp(degree, n_poles - 1);
    while s < n_poles - 1 && knots[s + 1] <= knots[s] {
        s += 1;
    }
    s
}

/// Evaluates the basis at `t` by the triangular scheme of Cox and de Boor. `N` must exceed the degree.
///
/// The function is inlined, so the loops are unrolled where the caller knows the degree. Most splines are at most cubic.
#[inline(always)]
pub(crate) fn basis<const N: usize>(
    knots: &[f64],
    degree: usize,
    n_poles: usize,
    t: f64,
) -> Basis<N> {
    let s = span(knots, degree, n_poles, t);
    let near = &knots[s + 1 - degree..=s + degree];
    let mut lower = [0.0; N];
    lower[0] = 1.0;
    for order in 1..degree {
        raise(near, degree, order, t, &mut lower);
    }
    let mut value = lower;
    raise(near, degree, degree, t, &mut value);
    Basis {
        first: s - degree,
        value,
        slope: slopes(near, degree, degree, &lower),
    }
}

/// The second derivatives of the functions of [`basis`], in the same order.
pub(crate) fn second_slopes<const N: usize>(
    knots: &[f64],
    degree: usize,
    n_poles: usize,
    t: f64,
) -> [f64; N] {
    if degree < 2 {
        return [0.0; N];
    }
    let s = span(knots, degree, n_poles, t);
    let near = &knots[s + 1 - degree..=s + degree];
    let mut lower = [0.0; N];
    lower[0] = 1.0;
    for order in 1..degree - 1 {
        raise(near, degree, order, t, &mut lower);
    }
    slopes(
        near,
        degree,
        degree,
        &slopes(near, degree, degree - 1, &lower),
    )
}

/// Computes the functions of degree `order` from those of degree `order − 1`. `near` holds `degree` knots on either side of the
/// span.
#[inline(always)]
fn raise<const N: usize>(near: &[f64], degree: usize, order: usize, t: f64, value: &mut [f64; N]) {
    let mut carry = 0.0;
    for i in 0..order {
        let (right, left) = (near[degree + i] - t, t - near[degree + i - order]);
        let share = value[i] / (right + left);
        value[i] = carry + right * share;
        carry = left * share;
    }
    value[order] = carry;
}

/// The derivatives of the functions of degree `order`, from those of degree `order − 1` (or from their derivatives,
/// which gives the next higher ones).
#[inline(always)]
fn slopes<const N: usize>(near: &[f64], degree: usize, order: usize, lower: &[f64; N]) -> [f64; N] {
    let mut slope = [0.0; N];
    let mut rise = 0.0;
    for i in 0..order {
        let fall = lower[i] / (near[degree + i] - near[degree + i - order]);
        slope[i] = order as f64 * (rise - fall);
        rise = fall;
    }
    slope[order] = order as f64 * rise;
    slope
}

/// A parameter moved into a B-spline's range. It is wrapped if the spline closes, and clamped otherwise.
pub(crate) fn into_range(t: f64, (low, high): (f64, f64), closed: bool) -> f64 {
    if t >= low && t <= high {
        t
    } else if closed {
        low + (t - low).rem_euclid(high - low)
    } else {
        t.clamp(low, high)
    }
}

/// The distinct knots of the range, including its ends.
pub(crate) fn distinct_knots(knots: &[f64], degree: usize, n_poles: usize) -> Vec<f64> {
    let mut inner = knots[degree..=n_poles].to_vec();
    inner.dedup();
    inner
}

/// Whether two points of a spline coincide, relative to the spline's size.
pub(crate) fn coincide(gap: f64, size: f64) -> bool {
    gap <= 1e-7 * size
}

/// Whether the multiplicity of a knot between the ends reaches the degree, so that the derivative may jump there.
pub(super) fn jumps_at_a_knot(knots: &[f64], degree: usize) -> bool {
    let (Some(first), Some(last)) = (
        knots.get(degree),
        knots.len().checked_sub(degree + 1).map(|end| knots[end]),
    ) else {
        return false;
    };
    knots
        .windows(degree)
        .any(|run| run[0] > *first && run[0] < last && run[0] == run[degree - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn each_refusal_has_its_cause() {
        assert_eq!(
            check_knots(0, 4, &[]),
            Err(BsplineError::Degree { degree: 0 })
        );
        assert_eq!(
            check_knots(31, 4, &[]),
            Err(BsplineError::Degree { degree: 31 })
        );
        assert_eq!(
            check_knots(3, 3, &[]),
            Err(BsplineError::PoleCount {
                poles: 3,
                degree: 3
            })
        );
        assert_eq!(
            check_knots(1, 2, &[0.0; 3]),
            Err(BsplineError::KnotCount {
                knots: 3,
                expected: 4
            })
        );
        assert_eq!(
            check_knots(1, 2, &[0.0, 0.0, 1.0, 0.5]),
            Err(BsplineError::KnotOrder)
        );
        assert_eq!(check_knots(1, 2, &[0.0; 4]), Err(BsplineError::KnotOrder));
        assert_eq!(
            check_knots(1, 2, &[0.0, 0.0, 1.0, f64::NAN]),
            Err(BsplineError::NotFinite)
        );
        assert_eq!(
            check_poles(&[[0.0, 0.0, 0.0, 0.0]]),
            Err(BsplineError::Weight)
        );
        assert_eq!(
            check_poles(&[[f64::INFINITY, 0.0, 0.0, 1.0]]),
            Err(BsplineError::NotFinite)
        );
    }

    proptest! {
        #[test]
        fn values_sum_to_one_and_slopes_to_zero(t in -0.5_f64..3.5) {
            let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0];
            let t = into_range(t, (0.0, 3.0), false);
            let basis = basis::<4>(&knots, 3, 7, t);
            prop_assert!((basis.value[..4].iter().sum::<f64>() - 1.0).abs() < 1e-12);
            prop_assert!(basis.slope[..4].iter().sum::<f64>().abs() < 1e-12);
        }

        #[test]
        fn second_slopes_are_the_slopes_of_slopes(t in 1.05_f64..1.95) {
            let knots = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0];
            let h = 1e-5;
            let second = second_slopes::<4>(&knots, 3, 7, t);
            let (before, after) = (basis::<4>(&knots, 3, 7, t - h), basis::<4>(&knots, 3, 7, t + h));
            for ((found, after), before) in second.iter().zip(after.slope).zip(before.slope) {
                prop_assert!((found - (after - before) / (2.0 * h)).abs() < 1e-6 * (1.0 + found.abs()));
            }
        }
    }
}
