//! Constructs B-spline curves after a check of their data, and evaluates them.
//!
//! Rational curves are evaluated in homogeneous coordinates, as in *The NURBS Book*, section 4.2 and algorithm A4.1.

use super::bspline_basis::{
    BsplineError, MAX_DEGREE, basis, check_knots, check_poles, coincide, distinct_knots, into_range,
};
use super::linear::{along, scaled};
use super::types::BsplineCurve;
use partprobe_shape::{Point, bounding_diagonal, distance};

impl BsplineCurve {
    /// Makes a curve of homogeneous poles and written-out knots, and finds whether it closes.
    ///
    /// # Errors
    /// If the degree, the counts, the knots or the weights do not make a B-spline.
    pub fn new(degree: usize, knots: Vec<f64>, poles: Vec<[f64; 4]>) -> Result<Self, BsplineError> {
        check_knots(degree, poles.len(), &knots)?;
        check_poles(&poles)?;
        let mut curve = Self {
            degree,
            knots,
            poles,
            closed: false,
        };
        let (low, high) = curve.range();
        let positions: Vec<Point> = curve.poles.iter().map(|&pole| position(pole)).collect();
        let gap = distance(curve.derivative(low).0, curve.derivative(high).0);
        curve.closed = coincide(gap, bounding_diagonal(&positions));
        Ok(curve)
    }

    /// The parameters between which the curve runs.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.poles.len()])
    }

    /// The distinct knots of the range, from end to end.
    pub(crate) fn breaks(&self) -> Vec<f64> {
        distinct_knots(&self.knots, self.degree, self.poles.len())
    }

    /// Point and derivative at `t`, which is wrapped or clamped into the range.
    pub(crate) fn derivative(&self, t: f64) -> (Point, Point) {
        match self.degree {
            1 => self.evaluate::<2>(1, t),
            2 => self.evaluate::<3>(2, t),
            3 => self.evaluate::<4>(3, t),
            degree @ ..8 => self.evaluate::<8>(degree, t),
            degree => self.evaluate::<{ MAX_DEGREE + 1 }>(degree, t),
        }
    }

    #[inline(always)]
    fn evaluate<const N: usize>(&self, degree: usize, t: f64) -> (Point, Point) {
        let t = into_range(t, self.range(), self.closed);
        let basis = basis::<N>(&self.knots, degree, self.poles.len(), t);
        let (mut value, mut slope) = ([0.0; 4], [0.0; 4]);
        for (i, pole) in self.poles[basis.first..=basis.first + degree]
            .iter()
            .enumerate()
        {
            for axis in 0..4 {
                value[axis] += basis.value[i] * pole[axis];
                slope[axis] += basis.slope[i] * pole[axis];
            }
        }
        let point = position(value);
        (point, projected_slope(point, slope, value[3]))
    }
}

/// The point in space with these homogeneous coordinates.
pub(crate) fn position(pole: [f64; 4]) -> Point {
    [pole[0] / pole[3], pole[1] / pole[3], pole[2] / pole[3]]
}

/// The derivative of the projected point, by the quotient rule.
pub(crate) fn projected_slope(point: Point, slope: [f64; 4], weight: f64) -> Point {
    scaled(
        along([slope[0], slope[1], slope[2]], point, -slope[3]),
        1.0 / weight,
    )
}
