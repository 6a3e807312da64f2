//! Finds the poles of a surface: the parameters at which all values of the other parameter give one point, for example an apex
//! or the end of a meridian on its axis.

use crate::geometry::{Curve, Frame, Surface};
use partprobe_shape::{Point, distance, dot, norm};

/// Number of points that are compared along an end of the surface.
const SAMPLES: usize = 5;
/// These points count as one if they agree within this fraction of the shape's size.
const MEETS: f64 = 1e-6;

/// The values of the parameter `along` at which the surface comes to a point: at its lower end and at its upper end. `size` is
/// the diagonal of the shape.
pub(crate) fn poles(surface: &Surface, along: usize, size: f64) -> [Option<f64>; 2] {
    let none = [None; 2];
    match surface {
        _ if surface.period()[along].is_some() => none,
        Surface::Revolution { axis, curve }
            if along == 1 && matches!(**curve, Curve::Line { .. }) =>
        {
            // A straight meridian has no ends. It meets the axis at most once.
            [crossing(axis, curve, size); 2]
        }
        Surface::Sphere { .. } | Surface::Cone { .. } | Surface::Torus { .. } => {
            surface.range()[along].map_or(none, |(low, high)| {
                [low, high].map(|end| Some(end).filter(|end| end.is_finite()))
            })
        }
        _ => surface.range()[along].map_or(none, |(low, high)| {
            [low, high].map(|end| Some(end).filter(|&end| is_point(surface, along, end, size)))
        }),
    }
}

/// Whether a direction of the surface has no border, because it is periodic or comes to a point at both ends.
pub(crate) fn closes(surface: &Surface, axis: usize, size: f64) -> bool {
    surface.period()[axis].is_some() || poles(surface, axis, size).iter().all(Option::is_some)
}

/// Whether an end of the surface is a single point.
fn is_point(surface: &Surface, along: usize, end: f64, size: f64) -> bool {
    let Some((low, high)) = surface.range()[1 - along].filter(|_| end.is_finite()) else {
        return false;
    };
    let point = |i: usize| {
        let around = low + (high - low) * i as f64 / SAMPLES as f64;
        if along == 0 {
            surface.point(end, around)
        } else {
            surface.point(around, end)
        }
    };
    let first: Point = point(0);
    (1..SAMPLES).all(|i| distance(first, point(i)) <= MEETS * size)
}

/// The parameter at which a straight line meets an axis. Returns `None` if it does not.
fn crossing(axis: &Frame, curve: &Curve, size: f64) -> Option<f64> {
    let (origin, direction) = curve.derivative(0.0);
    let ([x, y, _], dx, dy) = (
        axis.local(origin),
        dot(direction, axis.x),
        dot(direction, axis.y),
    );
    let widens = dx * dx + dy * dy;
    if widens <= 1e-24 * norm(direction) * norm(direction) {
        return None;
    }
    let nearest = -(x * dx + y * dy) / widens;
    let gap = libm::hypot(x + nearest * dx, y + nearest * dy);
    (gap <= MEETS * size).then_some(nearest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{BsplineCurve, BsplineSurface};

    const UP: Frame = Frame {
        origin: [0.0; 3],
        x: [1.0, 0.0, 0.0],
        y: [0.0, 1.0, 0.0],
        z: [0.0, 0.0, 1.0],
    };

    fn revolved(curve: Curve) -> Surface {
        Surface::Revolution {
            axis: UP,
            curve: Box::new(curve),
        }
    }

    fn line(origin: Point, direction: Point) -> Surface {
        revolved(Curve::Line { origin, direction })
    }

    fn spline(first: f64, last: f64) -> Surface {
        let poles = [
            [first, 0.0, 0.0, 1.0],
            [4.0, 0.0, 2.0, 1.0],
            [last, 0.0, 5.0, 1.0],
        ]
        .to_vec();
        let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        revolved(Curve::Bspline(BsplineCurve::new(2, knots, poles).unwrap()))
    }

    /// A fan of squares around the origin. Its parameter v runs outward.
    fn fan() -> Surface {
        let around = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 0.0]];
        let poles = around
            .iter()
            .flat_map(|&[x, y]| [[0.0, 0.0, 1.0, 1.0], [x, y, 0.0, 1.0]])
            .collect();
        let knots_u = vec![0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0];
        let surface =
            BsplineSurface::new([1, 1], [knots_u, vec![0.0, 0.0, 1.0, 1.0]], [5, 2], poles);
        Surface::Bspline(Box::new(surface.unwrap()))
    }

    #[track_caller]
    fn check(surface: &Surface, expected: [Option<f64>; 2]) {
        assert_eq!(poles(surface, 1, 10.0), expected);
        assert_eq!(
            closes(surface, 1, 10.0),
            expected[0].is_some() && expected[1].is_some()
        );
        assert!(closes(surface, 0, 10.0));
    }

    #[test]
    fn surfaces_end_in_poles_and_in_borders() {
        check(
            &Surface::Cylinder {
                frame: UP,
                radius: 2.0,
            },
            [None, None],
        );
        check(
            &Surface::Cone {
                frame: UP,
                radius: 2.0,
                slope: -0.5,
            },
            [None, Some(4.0)],
        );
        check(
            &Surface::Cone {
                frame: UP,
                radius: 2.0,
                slope: 0.5,
            },
            [Some(-4.0), None],
        );
        check(&spline(1.0, 2.0), [None, None]);
        check(&spline(0.0, 2.0), [Some(0.0), None]);
        check(&spline(1.0, 0.0), [None, Some(1.0)]);
        check(&spline(0.0, 0.0), [Some(0.0), Some(1.0)]);
        check(&fan(), [Some(0.0), None]);
    }

    #[test]
    fn a_straight_meridian_comes_to_the_axis_once() {
        let at = |surface: &Surface| poles(surface, 1, 10.0);
        assert_eq!(at(&line([3.0, 0.0, 0.0], [-1.0, 0.0, 2.0])), [Some(3.0); 2]);
        assert_eq!(at(&line([3.0, 0.0, 0.0], [-1.0, 0.0, 0.0])), [Some(3.0); 2]);
        assert_eq!(at(&line([3.0, 0.0, 0.0], [0.0, 0.0, 1.0])), [None; 2]);
        // A line that misses the axis makes a hyperboloid.
        assert_eq!(at(&line([3.0, 1.0, 0.0], [-1.0, 0.0, 2.0])), [None; 2]);
    }
}
