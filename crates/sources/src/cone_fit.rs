//! Fits a cone to points by least squares, starting from an approximate cone.
//!
//! Points and an approximate cone go in, and the cone that is nearest to all points comes out. A cone through three facets of a
//! mesh is only approximate: if the sides of the facets are not lines through the tip, their planes miss it, and the tip of a
//! slender cone is far away. The method is the Gauss–Newton method. Its residuals are the distances across the axis.

use crate::basis::across;
use crate::primitive_fit::Primitive;
use partprobe_carrier::{Point, dot, norm, subtract};

/// Number of steps. Each step divides the error of a good start by more than ten.
const STEPS: usize = 4;

/// Number of fitted parameters: two shifts and two tilts of the axis, the radius, and its slope.
const N: usize = 6;

/// A cone during the fit.
struct Fit {
    /// A point of the axis near the points, and the direction of the axis.
    center: Point,
    axis: Point,
    /// The radius at the center, and how fast it grows along the axis.
    radius: f64,
    slope: f64,
}

/// The cone that is nearest to the points. Returns `None` if the points do not determine a cone, or if the primitive is not a
/// cone.
pub(crate) fn refitted_cone(primitive: &Primitive, points: &[Point]) -> Option<Primitive> {
    let mut fit = Fit::of(primitive, points)?;
    for _ in 0..STEPS {
        fit = fit.improved(points)?;
    }
    fit.cone()
}

impl Fit {
    fn of(primitive: &Primitive, points: &[Point]) -> Option<Self> {
        let Primitive::Cone {
            apex,
            axis,
            sine,
            cosine,
        } = *primitive
        else {
            return None;
        };
        let heights = points.iter().map(|&point| dot(axis, subtract(point, apex)));
        let height = heights.sum::<f64>() / points.len() as f64;
        let slope = sine / cosine;
        Some(Self {
            center: along(apex, axis, height),
            axis,
            radius: slope * height,
            slope,
        })
    }

    /// One step: the parameters that would be right if distances were linear in them.
    fn improved(&self, points: &[Point]) -> Option<Self> {
        let [u, v] = across(self.axis);
        let mut matrix = [[0.0; N]; N];
        let mut right = [0.0; N];
        for &point in points {
            let offset = subtract(point, self.center);
            let height = dot(offset, self.axis);
            let radial = subtract(offset, self.axis.map(|x| x * height));
            let distance = norm(radial);
            if distance <= 0.0 {
                continue;
            }
            let residual = distance - self.radius - self.slope * height;
            let [x, y] = [dot(radial, u), dot(radial, v)];
            let tilt = height / distance + self.slope;
            let row = [
                -x / distance,
                -y / distance,
                -tilt * x,
                -tilt * y,
                -1.0,
                -height,
            ];
            for (i, a) in row.into_iter().enumerate() {
                right[i] -= a * residual;
                for (j, b) in row.into_iter().enumerate() {
                    matrix[i][j] += a * b;
                }
            }
        }
        let [a, b, c, d, radius, slope] = solution(matrix, right)?;
        let tilted = along(along(self.axis, u, c), v, d);
        let length = norm(tilted);
        Some(Self {
            center: along(along(self.center, u, a), v, b),
            axis: tilted.map(|x| x / length),
            radius: self.radius + radius,
            slope: self.slope + slope,
        })
    }

    fn cone(&self) -> Option<Primitive> {
        let height = self.radius / self.slope;
        let sign = self.slope.signum();
        let slope = self.slope.abs();
        let hypotenuse = (1.0 + slope * slope).sqrt();
        let apex = along(self.center, self.axis, -height);
        let is_finite = apex.iter().chain(&self.axis).all(|x| x.is_finite());
        (is_finite && self.radius > 0.0).then(|| Primitive::Cone {
            apex,
            axis: self.axis.map(|x| x * sign),
            sine: slope / hypotenuse,
            cosine: 1.0 / hypotenuse,
        })
    }
}

fn along(from: Point, direction: Point, distance: f64) -> Point {
    [0, 1, 2].map(|axis| from[axis] + distance * direction[axis])
}

/// The solution of a linear system by elimination, with the largest pivot of each column.
fn solution(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    for column in 0..N {
        let larger = |best: usize, row: usize| {
            if matrix[row][column].abs() > matrix[best][column].abs() {
                row
            } else {
                best
            }
        };
        let pivot = (column + 1..N).fold(column, larger);
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        if matrix[column][column] == 0.0 || !matrix[column][column].is_finite() {
            return None;
        }
        let pivots = matrix[column];
        for row in column + 1..N {
            let factor = matrix[row][column] / pivots[column];
            for (value, pivot) in matrix[row].iter_mut().zip(pivots).skip(column) {
                *value -= factor * pivot;
            }
            right[row] -= factor * right[column];
        }
    }
    let mut found = [0.0; N];
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|at| matrix[row][at] * found[at]).sum();
        found[row] = (right[row] - known) / matrix[row][row];
    }
    found.iter().all(|x| x.is_finite()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_near_start_ends_at_the_cone(
            half_angle_deg in 2.1f64..60.0,
            lean in 0.0f64..3.0,
            n in 12usize..60,
            off in -0.02f64..0.02,
        ) {
            let (sine, cosine) = half_angle_deg.to_radians().sin_cos();
            let axis = [lean.sin(), 0.0, lean.cos()];
            let apex = [3.0, -2.0, 5.0];
            let cone = Primitive::Cone { apex, axis, sine, cosine };
            let [u, v] = across(axis);
            let far = 1.0 / sine;
            let points: Vec<Point> = (0..n)
                .map(|number| {
                    let (s, c) = (2.4 * number as f64).sin_cos();
                    let height = (far + (number % 5) as f64 * 0.4) * cosine;
                    let radius = height * sine / cosine;
                    along(along(along(apex, axis, height), u, radius * c), v, radius * s)
                })
                .collect();

            let tilted = along(axis, u, off);
            let length = norm(tilted);
            let start = Primitive::Cone {
                apex: along(apex, v, off),
                axis: tilted.map(|x| x / length),
                sine,
                cosine,
            };
            let found = refitted_cone(&start, &points).unwrap();
            for &point in &points {
                prop_assert!(cone.distance(point) < 1e-9);
                prop_assert!(found.distance(point) < 1e-6, "{found:?}");
            }
        }
    }

    #[test]
    fn points_that_define_no_cone_give_none() {
        let cone = Primitive::Cone {
            apex: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            sine: 0.6,
            cosine: 0.8,
        };
        assert_eq!(refitted_cone(&cone, &[[0.6, 0.0, 0.8]; 9]), None);
        assert_eq!(refitted_cone(&cone, &[]), None);
        let sphere = Primitive::Sphere {
            center: [0.0; 3],
            radius: 1.0,
        };
        assert_eq!(refitted_cone(&sphere, &[[1.0, 0.0, 0.0]; 9]), None);
    }
}
