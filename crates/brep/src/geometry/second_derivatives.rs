//! Computes second derivatives of curves and surfaces. Only curvatures need them.

use super::bspline_basis::{MAX_DEGREE, basis, into_range, second_slopes};
use super::linear::{along, scaled};
use super::types::{BsplineCurve, BsplineSurface, CompositeSegment, Curve, Frame, Surface};
use partprobe_shape::{Point, dot, subtract};

/// Largest number of functions that are not zero in one span.
const N: usize = MAX_DEGREE + 1;

/// Step of the differences if there is no closed form, as a fraction of the parameters' extent.
const STEP: f64 = 1e-4;

impl Curve {
    /// The second derivative at `t`.
    pub(crate) fn second_derivative(&self, t: f64) -> Point {
        match self {
            Self::Line { .. } | Self::Polyline(_) => [0.0; 3],
            Self::Ellipse { frame, .. } => subtract(frame.origin, self.point(t)),
            Self::Parabola { frame, focal } => scaled(frame.x, 2.0 * focal),
            Self::Hyperbola { frame, .. } => subtract(self.point(t), frame.origin),
            Self::Bspline(spline) => spline.second_derivative(t),
            Self::Composite(segments) => composite_second(segments, t),
            Self::Offset { .. } | Self::OnSurface(_) => {
                let step = STEP * self.range().map_or(1.0, |(low, high)| high - low);
                let rise = subtract(self.derivative(t + step).1, self.derivative(t - step).1);
                scaled(rise, 0.5 / step)
            }
        }
    }
}

fn composite_second(segments: &[CompositeSegment], t: f64) -> Point {
    let Some(last) = segments.len().checked_sub(1) else {
        return [0.0; 3];
    };
    let i = (t.max(0.0) as usize).min(last);
    let CompositeSegment { curve, start, end } = &segments[i];
    scaled(
        curve.second_derivative(start + (end - start) * (t - i as f64)),
        (end - start) * (end - start),
    )
}

impl BsplineCurve {
    fn second_derivative(&self, t: f64) -> Point {
        const N: usize = MAX_DEGREE + 1;
        let t = into_range(t, self.range(), self.closed);
        let (point, slope) = self.derivative(t);
        let basis = basis::<N>(&self.knots, self.degree, self.poles.len(), t);
        let second = second_slopes::<N>(&self.knots, self.degree, self.poles.len(), t);
        let poles = &self.poles[basis.first..=basis.first + self.degree];
        let sum = |weights: &[f64; N]| {
            weighted(
                poles
                    .iter()
                    .zip(weights)
                    .map(|(pole, &weight)| (*pole, weight)),
            )
        };
        let (value, first, second) = (sum(&basis.value), sum(&basis.slope), sum(&second));
        // The quotient rule, applied a second time.
        let bent = along(
            along(position(second), slope, -2.0 * first[3]),
            point,
            -second[3],
        );
        scaled(bent, 1.0 / value[3])
    }
}

impl Surface {
    /// ∂uu, ∂uv and ∂vv at (u, v).
    pub(crate) fn second_derivatives(&self, u: f64, v: f64) -> [Point; 3] {
        match self {
            Self::Plane(_) | Self::Facets(_) => [[0.0; 3]; 3],
            Self::Cylinder { frame, radius } => meridian(frame, u, *radius, 0.0, [0.0, 0.0]),
            Self::Cone {
                frame,
                radius,
                slope,
            } => meridian(frame, u, radius + v * slope, *slope, [0.0, 0.0]),
            Self::Sphere { frame, radius } => {
                let (sin, cos) = libm::sincos(v);
                meridian(
                    frame,
                    u,
                    radius * cos,
                    -radius * sin,
                    [-radius * cos, -radius * sin],
                )
            }
            Self::Torus {
                frame,
                major,
                minor,
            } => {
                let (sin, cos) = libm::sincos(v);
                meridian(
                    frame,
                    u,
                    major + minor * cos,
                    -minor * sin,
                    [-minor * cos, -minor * sin],
                )
            }
            Self::Bspline(spline) => spline.second_derivatives(u, v),
            Self::Revolution { axis, curve } => revolved(axis, curve, u, v),
            Self::Extrusion { curve, .. } => [curve.second_derivative(u), [0.0; 3], [0.0; 3]],
            Self::Offset { .. } => self.by_differences(u, v),
            Self::Composite(composite) => composite.second_derivatives(u, v),
        }
    }

    fn by_differences(&self, u: f64, v: f64) -> [Point; 3] {
        let [step_u, step_v] = self.extent().map(|extent| STEP * extent);
        let slope = |a: Point, b: Point, step: f64| scaled(subtract(a, b), 0.5 / step);
        let (right, left) = (
            self.derivatives(u + step_u, v),
            self.derivatives(u - step_u, v),
        );
        let (above, below) = (
            self.derivatives(u, v + step_v),
            self.derivatives(u, v - step_v),
        );
        [
            slope(right.1, left.1, step_u),
            slope(right.2, left.2, step_u),
            slope(above.2, below.2, step_v),
        ]
    }
}

/// The position of a meridian (distance from the axis), its slope, and its second derivative (outward, up), rotated by u.
fn meridian(frame: &Frame, u: f64, reach: f64, slope: f64, second: [f64; 2]) -> [Point; 3] {
    let (sin, cos) = libm::sincos(u);
    [
        frame.vector(-reach * cos, -reach * sin, 0.0),
        frame.vector(-slope * sin, slope * cos, 0.0),
        frame.vector(second[0] * cos, second[0] * sin, second[1]),
    ]
}

fn revolved(axis: &Frame, curve: &Curve, u: f64, v: f64) -> [Point; 3] {
    let (sin, cos) = libm::sincos(u);
    let (point, slope) = curve.derivative(v);
    let second = curve.second_derivative(v);
    let [x, y, _] = axis.local(point);
    let components = |a: Point| [dot(a, axis.x), dot(a, axis.y), dot(a, axis.z)];
    let ([dx, dy, _], [ax, ay, az]) = (components(slope), components(second));
    [
        axis.vector(y * sin - x * cos, -x * sin - y * cos, 0.0),
        axis.vector(-dx * sin - dy * cos, dx * cos - dy * sin, 0.0),
        axis.vector(ax * cos - ay * sin, ax * sin + ay * cos, az),
    ]
}

impl BsplineSurface {
    fn second_derivatives(&self, u: f64, v: f64) -> [Point; 3] {
        let [range_u, range_v] = self.range();
        let u = into_range(u, range_u, self.closed_u);
        let v = into_range(v, range_v, self.closed_v);
        let in_u = basis::<N>(&self.knots_u, self.degree_u, self.n_u, u);
        let in_v = basis::<N>(&self.knots_v, self.degree_v, self.n_v, v);
        let bend_u = second_slopes::<N>(&self.knots_u, self.degree_u, self.n_u, u);
        let bend_v = second_slopes::<N>(&self.knots_v, self.degree_v, self.n_v, v);
        let first = [in_u.first, in_v.first];
        let (point, du, dv) = self.derivatives(u, v);
        let quotient = Quotient {
            point,
            weight: self.sum(first, &in_u.value, &in_v.value)[3],
        };
        let along_u = Slope {
            tangent: du,
            weight: self.sum(first, &in_u.slope, &in_v.value)[3],
        };
        let along_v = Slope {
            tangent: dv,
            weight: self.sum(first, &in_u.value, &in_v.slope)[3],
        };
        [
            quotient.second(self.sum(first, &bend_u, &in_v.value), along_u, along_u),
            quotient.second(self.sum(first, &in_u.slope, &in_v.slope), along_u, along_v),
            quotient.second(self.sum(first, &in_u.value, &bend_v), along_v, along_v),
        ]
    }

    /// The homogeneous sum of the poles beginning at `first`, weighted by the products of functions of u and of v.
    fn sum(&self, first: [usize; 2], along_u: &[f64; N], along_v: &[f64; N]) -> [f64; 4] {
        let rows = (0..=self.degree_u).flat_map(|i| (0..=self.degree_v).map(move |j| (i, j)));
        weighted(rows.map(|(i, j)| {
            let pole = self.poles[(first[0] + i) * self.n_v + first[1] + j];
            (pole, along_u[i] * along_v[j])
        }))
    }
}

/// A point of a rational surface, and its weight, by which the homogeneous coordinates are divided.
struct Quotient {
    point: Point,
    weight: f64,
}

/// The derivatives with respect to one parameter.
#[derive(Clone, Copy)]
struct Slope {
    tangent: Point,
    /// The derivative of the weight.
    weight: f64,
}

impl Quotient {
    /// The second derivative with respect to two parameters, from that of the homogeneous coordinates.
    ///
    /// The quotient rule, applied a second time: (A'' − w'·S' − w'·S' − w''·S) / w.
    fn second(&self, second: [f64; 4], a: Slope, b: Slope) -> Point {
        let bent = along(
            along(position(second), b.tangent, -a.weight),
            a.tangent,
            -b.weight,
        );
        scaled(along(bent, self.point, -second[3]), 1.0 / self.weight)
    }
}

fn weighted(poles: impl Iterator<Item = ([f64; 4], f64)>) -> [f64; 4] {
    poles.fold([0.0; 4], |sum, (pole, weight)| {
        [0, 1, 2, 3].map(|axis| sum[axis] + weight * pole[axis])
    })
}

/// The first three homogeneous coordinates.
fn position(homogeneous: [f64; 4]) -> Point {
    [homogeneous[0], homogeneous[1], homogeneous[2]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Checks second derivatives against differences of the first ones.
    #[track_caller]
    fn check_surface(surface: &Surface, [u, v]: [f64; 2]) {
        let h = 1e-5;
        let at = |u: f64, v: f64| surface.derivatives(u, v);
        let slope = |a: Point, b: Point| scaled(subtract(a, b), 0.5 / h);
        let expected = [
            slope(at(u + h, v).1, at(u - h, v).1),
            slope(at(u + h, v).2, at(u - h, v).2),
            slope(at(u, v + h).2, at(u, v - h).2),
        ];
        for (found, expected) in surface.second_derivatives(u, v).iter().zip(expected) {
            assert!(
                partprobe_shape::distance(*found, expected)
                    < 1e-5 * (1.0 + partprobe_shape::norm(expected)),
                "{surface:?}"
            );
        }
    }

    fn frame() -> Frame {
        Frame::new(
            [1.0, 2.0, 3.0],
            Some([1.0, 2.0, -1.0]),
            Some([0.0, 1.0, 1.0]),
        )
    }

    /// A rational patch with different weights and uneven knots.
    fn patch() -> Surface {
        let poles = (0..4)
            .flat_map(|i| (0..5).map(move |j| (f64::from(i), f64::from(j))))
            .map(|(x, y)| {
                let weight = 1.0 + 0.3 * ((x * 3.0 + y) % 4.0);
                [
                    x * weight,
                    y * weight,
                    (x * y * 0.4 - x * x * 0.3) * weight,
                    weight,
                ]
            });
        let knots = [
            vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0],
            vec![0.0, 0.0, 0.0, 0.4, 0.7, 1.0, 1.0, 1.0],
        ];
        Surface::Bspline(Box::new(
            BsplineSurface::new([3, 2], knots, [4, 5], poles.collect()).unwrap(),
        ))
    }

    /// A bent profile that does not cross the axis.
    fn profile() -> Curve {
        let poles = vec![
            [2.0, 0.0, 0.0, 1.0],
            [3.0 * 0.8, 0.4, 1.0 * 0.8, 0.8],
            [2.5, 0.1, 2.0, 1.0],
        ];
        Curve::Bspline(BsplineCurve::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], poles).unwrap())
    }

    proptest! {
        #[test]
        fn second_derivatives_are_slopes_of_tangents(u in 0.05_f64..0.35, v in 0.05_f64..0.35) {
            let surfaces = [
                Surface::Plane(frame()),
                Surface::Cylinder { frame: frame(), radius: 2.0 },
                Surface::Cone { frame: frame(), radius: 2.0, slope: 0.4 },
                Surface::Sphere { frame: frame(), radius: 2.0 },
                Surface::Torus { frame: frame(), major: 3.0, minor: 1.0 },
                patch(),
                Surface::Revolution { axis: frame(), curve: Box::new(profile()) },
                Surface::Extrusion { curve: Box::new(profile()), direction: [0.3, 2.0, 1.0] },
                Surface::Extrusion {
                    curve: Box::new(Curve::Hyperbola { frame: frame(), a: 1.0, b: 2.0 }),
                    direction: [0.0, 1.0, 1.0],
                },
                Surface::Extrusion {
                    curve: Box::new(Curve::Parabola { frame: frame(), focal: 2.0 }),
                    direction: [0.0, 1.0, 1.0],
                },
            ];
            for surface in &surfaces {
                check_surface(surface, [u, v]);
            }
        }
    }
}
