//! Constructs B-spline surfaces after a check of their data, and evaluates them.
//!
//! Rational surfaces are evaluated in homogeneous coordinates, as in *The NURBS Book*, section 4.4 and algorithm A4.3.

use super::bspline_basis::{
    BsplineError, MAX_DEGREE, basis, check_knots, check_poles, coincide, distinct_knots, into_range,
};
use super::bspline_curve::{position, projected_slope};
use super::types::BsplineSurface;
use partprobe_shape::{Point, bounding_diagonal, distance};

/// Number of points at which two sides of a surface are compared.
const SIDE_SAMPLES: usize = 9;

impl BsplineSurface {
    /// Makes a surface of homogeneous poles (v varies fastest) and written-out knots, and finds whether it closes. Each array
    /// holds the value for u, then for v.
    ///
    /// # Errors
    /// If the degrees, the counts, the knots or the weights do not make a B-spline.
    pub fn new(
        degree: [usize; 2],
        [knots_u, knots_v]: [Vec<f64>; 2],
        [n_u, n_v]: [usize; 2],
        poles: Vec<[f64; 4]>,
    ) -> Result<Self, BsplineError> {
        check_knots(degree[0], n_u, &knots_u)?;
        check_knots(degree[1], n_v, &knots_v)?;
        if n_u.checked_mul(n_v) != Some(poles.len()) {
            return Err(BsplineError::PoleCount {
                poles: poles.len(),
                degree: degree[0],
            });
        }
        check_poles(&poles)?;
        let [degree_u, degree_v] = degree;
        let mut surface = Self {
            degree_u,
            degree_v,
            knots_u,
            knots_v,
            n_u,
            n_v,
            poles,
            closed_u: false,
            closed_v: false,
        };
        let positions: Vec<Point> = surface.poles.iter().map(|&pole| position(pole)).collect();
        let size = bounding_diagonal(&positions);
        let [(u0, u1), (v0, v1)] = surface.range();
        surface.closed_u = surface.sides_meet(
            |f| ([u0, v0 + f * (v1 - v0)], [u1, v0 + f * (v1 - v0)]),
            size,
        );
        surface.closed_v = surface.sides_meet(
            |f| ([u0 + f * (u1 - u0), v0], [u0 + f * (u1 - u0), v1]),
            size,
        );
        Ok(surface)
    }

    /// The parameters between which the surface runs, for u and v.
    #[must_use]
    pub fn range(&self) -> [(f64, f64); 2] {
        [
            (self.knots_u[self.degree_u], self.knots_u[self.n_u]),
            (self.knots_v[self.degree_v], self.knots_v[self.n_v]),
        ]
    }

    /// The distinct knots of the range, for u and v.
    pub(crate) fn breaks(&self) -> [Vec<f64>; 2] {
        [
            distinct_knots(&self.knots_u, self.degree_u, self.n_u),
            distinct_knots(&self.knots_v, self.degree_v, self.n_v),
        ]
    }

    fn sides_meet(&self, sides: impl Fn(f64) -> ([f64; 2], [f64; 2]), size: f64) -> bool {
        (0..SIDE_SAMPLES).all(|i| {
            let (a, b) = sides(i as f64 / (SIDE_SAMPLES - 1) as f64);
            coincide(
                distance(
                    self.derivatives(a[0], a[1]).0,
                    self.derivatives(b[0], b[1]).0,
                ),
                size,
            )
        })
    }

    /// Point, ∂u and ∂v at (u, v), which are wrapped or clamped into the range.
    pub(crate) fn derivatives(&self, u: f64, v: f64) -> (Point, Point, Point) {
        match [self.degree_u, self.degree_v] {
            [3, 3] => self.evaluate::<4>([3, 3], [u, v]),
            [2, 2] => self.evaluate::<3>([2, 2], [u, v]),
            [3, 1] => self.evaluate::<4>([3, 1], [u, v]),
            [1, 3] => self.evaluate::<4>([1, 3], [u, v]),
            [1, 1] => self.evaluate::<2>([1, 1], [u, v]),
            degree @ [..4, ..4] => self.evaluate::<4>(degree, [u, v]),
            degree @ [..8, ..8] => self.evaluate::<8>(degree, [u, v]),
            degree => self.evaluate::<{ MAX_DEGREE + 1 }>(degree, [u, v]),
        }
    }

    #[inline(always)]
    fn evaluate<const N: usize>(
        &self,
        [degree_u, degree_v]: [usize; 2],
        [u, v]: [f64; 2],
    ) -> (Point, Point, Point) {
        let [range_u, range_v] = self.range();
        let in_u = basis::<N>(
            &self.knots_u,
            degree_u,
            self.n_u,
            into_range(u, range_u, self.closed_u),
        );
        let in_v = basis::<N>(
            &self.knots_v,
            degree_v,
            self.n_v,
            into_range(v, range_v, self.closed_v),
        );
        let (mut value, mut slope_u, mut slope_v) = ([0.0; 4], [0.0; 4], [0.0; 4]);
        for i in 0..=degree_u {
            let first = (in_u.first + i) * self.n_v + in_v.first;
            let (mut row, mut row_slope) = ([0.0; 4], [0.0; 4]);
            for (j, pole) in self.poles[first..=first + degree_v].iter().enumerate() {
                for axis in 0..4 {
                    row[axis] += in_v.value[j] * pole[axis];
                    row_slope[axis] += in_v.slope[j] * pole[axis];
                }
            }
            for axis in 0..4 {
                value[axis] += in_u.value[i] * row[axis];
                slope_u[axis] += in_u.slope[i] * row[axis];
                slope_v[axis] += in_u.value[i] * row_slope[axis];
            }
        }
        let point = position(value);
        (
            point,
            projected_slope(point, slope_u, value[3]),
            projected_slope(point, slope_v, value[3]),
        )
    }
}
