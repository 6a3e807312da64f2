//! Recognizes spheres that a file writes as a revolved circle whose center lies on the axis.
//!
//! A whole circle covers its sphere twice, with opposite normals, and its parameter passes through both poles. A sphere has
//! neither of these defects.

use super::types::{Curve, Frame, Surface};
use partprobe_shape::{cross, dot, norm, subtract};

/// The circle's center lies on the axis, and the axis lies in the circle's plane, to within this fraction of the radius.
const CENTERED: f64 = 1e-7;
/// A circle that begins nearer to the axis than this fraction of its radius begins at a pole.
const AT_POLE: f64 = 1e-6;
/// The half that a circle enters at a pole is determined at this angle after the pole, in radians.
const BEHIND_POLE: f64 = 0.5;

/// The sphere, and whether the normal of the revolved surface points away from its center. Returns `None` if the surface is not a
/// sphere.
///
/// `inside` is a parameter in the half of the circle that is used. Without it, the half in which the circle begins is used.
pub(crate) fn revolved_sphere(
    axis: &Frame,
    curve: &Curve,
    inside: Option<f64>,
) -> Option<(Surface, bool)> {
    let Curve::Ellipse { frame, rx, ry } = curve else {
        return None;
    };
    let arm = subtract(frame.origin, axis.origin);
    let is_centered =
        norm(cross(arm, axis.z)) <= CENTERED * rx && dot(axis.z, frame.z).abs() <= CENTERED;
    if rx != ry || !is_centered {
        return None;
    }

    let center = Frame {
        origin: frame.origin,
        ..*axis
    };
    let reach = |t: f64| {
        let [x, y, _] = center.local(curve.point(t));
        libm::hypot(x, y)
    };
    let start = if reach(0.0) > AT_POLE * rx {
        0.0
    } else {
        BEHIND_POLE
    };
    let (point, slope) = curve.derivative(inside.unwrap_or(start));

    let [x, y, z] = center.local(point);
    let out = libm::hypot(x, y);
    let widening = (x * dot(slope, axis.x) + y * dot(slope, axis.y)) / out;
    let is_outward = out * dot(slope, axis.z) - z * widening > 0.0;
    Some((
        Surface::Sphere {
            frame: center,
            radius: *rx,
        },
        is_outward,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::Point;
    use std::f64::consts::FRAC_PI_2;

    const UP: Frame = Frame {
        origin: [0.0; 3],
        x: [1.0, 0.0, 0.0],
        y: [0.0, 1.0, 0.0],
        z: [0.0, 0.0, 1.0],
    };

    fn circle(origin: Point, z: Point, x: Point) -> Curve {
        Curve::Ellipse {
            frame: Frame::new(origin, Some(z), Some(x)),
            rx: 2.0,
            ry: 2.0,
        }
    }

    #[track_caller]
    fn check(curve: &Curve, inside: Option<f64>, expected: Option<bool>) {
        let found = revolved_sphere(&UP, curve, inside);
        assert_eq!(found.map(|(_, is_outward)| is_outward), expected);
    }

    #[test]
    fn the_half_in_which_a_circle_starts_decides_the_normal() {
        let rising = circle([0.0, 0.0, 5.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]);
        let falling = circle([0.0, 0.0, 5.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]);
        let from_pole = circle([0.0, 0.0, 5.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]);
        check(&rising, None, Some(true));
        check(&falling, None, Some(false));
        check(&from_pole, None, Some(true));
        check(&from_pole, Some(3.0 * FRAC_PI_2), Some(false));
    }

    #[test]
    fn a_revolved_circle_off_the_axis_is_not_a_sphere() {
        check(
            &circle([0.1, 0.0, 0.0], [0.0, -1.0, 0.0], [1.0, 0.0, 0.0]),
            None,
            None,
        );
        check(
            &circle([0.0; 3], [0.0, -1.0, 0.1], [1.0, 0.0, 0.0]),
            None,
            None,
        );
        check(
            &Curve::Line {
                origin: [0.0; 3],
                direction: [1.0, 0.0, 0.0],
            },
            None,
            None,
        );
    }
}
