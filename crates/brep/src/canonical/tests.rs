//! Tests primitives written as B-splines and sweeps, and surfaces that are nearly primitives.

use super::primitive_type;
use crate::geometry::{BsplineCurve, BsplineSurface, Curve, Frame, Surface, Transform};
use partprobe_shape::{FaceType, Point};
use proptest::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2;

/// A quarter of a circle around z from (1, 0) to (0, 1), as a rational curve of degree two: (x, y, weight).
const QUARTER: [[f64; 3]; 3] = [[1.0, 0.0, 1.0], [1.0, 1.0, FRAC_1_SQRT_2], [0.0, 1.0, 1.0]];

fn knots(degree: usize) -> Vec<f64> {
    [vec![0.0; degree + 1], vec![1.0; degree + 1]].concat()
}

/// A meridian of (distance from the axis, height, weight) poles, revolved by a quarter turn.
fn revolved(meridian: &[[f64; 3]]) -> Surface {
    let degree = meridian.len() - 1;
    let poles = QUARTER.iter().flat_map(|[x, y, turn_weight]| {
        meridian.iter().map(move |[out, up, weight]| {
            let w = turn_weight * weight;
            [x * out * w, y * out * w, up * w, w]
        })
    });
    let poles = poles.collect();
    let surface = BsplineSurface::new(
        [2, degree],
        [knots(2), knots(degree)],
        [3, degree + 1],
        poles,
    );
    Surface::Bspline(Box::new(surface.unwrap()))
}

/// A quarter arc from (out, up) = center + (r, 0) to center + (0, r).
fn arc(center: [f64; 2], r: f64) -> Vec<[f64; 3]> {
    QUARTER
        .iter()
        .map(|[x, y, weight]| [center[0] + r * x, center[1] + r * y, *weight])
        .collect()
}

/// A cubic surface with five by five poles. One pole is lifted out of the plane.
fn sheet(lift: f64) -> Surface {
    let knots = || vec![0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0];
    let poles = (0..25)
        .map(|i| {
            [
                f64::from(i / 5),
                f64::from(i % 5),
                if i == 12 { lift } else { 0.0 },
                1.0,
            ]
        })
        .collect();
    Surface::Bspline(Box::new(
        BsplineSurface::new([3, 3], [knots(), knots()], [5, 5], poles).unwrap(),
    ))
}

fn spline_curve(points: &[Point]) -> Curve {
    let poles = points.iter().map(|&[x, y, z]| [x, y, z, 1.0]).collect();
    Curve::Bspline(BsplineCurve::new(points.len() - 1, knots(points.len() - 1), poles).unwrap())
}

fn at_origin() -> Frame {
    Frame::new([0.0; 3], None, None)
}

#[track_caller]
fn check(surface: &Surface, expected: Option<FaceType>) {
    assert_eq!(primitive_type(surface, 1e-5), expected, "{surface:?}");
}

/// The five primitives as rational B-splines.
fn splines() -> [(Surface, FaceType); 6] {
    [
        (sheet(0.0), FaceType::Plane),
        (
            revolved(&[[2.0, 0.0, 1.0], [2.0, 5.0, 1.0]]),
            FaceType::Cylinder,
        ),
        (
            revolved(&[[2.0, 0.0, 1.0], [1.0, 3.0, 1.0]]),
            FaceType::Cone,
        ),
        (
            revolved(&[[3.0, 1.0, 1.0], [0.0, 4.0, 1.0]]),
            FaceType::Cone,
        ),
        (revolved(&arc([0.0, 1.0], 2.0)), FaceType::Sphere),
        (revolved(&arc([5.0, 1.0], 2.0)), FaceType::Torus),
    ]
}

#[test]
fn primitives_written_as_splines_are_recognized() {
    splines()
        .iter()
        .for_each(|(surface, expected)| check(surface, Some(*expected)));
}

#[test]
fn a_surface_that_is_nearly_a_primitive_is_not_one() {
    check(&sheet(1e-6), Some(FaceType::Plane));
    check(&sheet(1e-3), None);
    check(&sheet(1.0), None);
    // A barrel, an ellipsoid, and a tube that is not round.
    check(
        &revolved(&[[2.0, 0.0, 1.0], [2.001, 2.0, 1.0], [2.0, 5.0, 1.0]]),
        None,
    );
    check(
        &revolved(
            &arc([0.0, 0.0], 2.0)
                .iter()
                .map(|[x, y, w]| [*x, 1.001 * y, *w])
                .collect::<Vec<_>>(),
        ),
        None,
    );
    check(
        &revolved(
            &arc([5.0, 0.0], 2.0)
                .iter()
                .map(|[x, y, _]| [*x, *y, 1.0])
                .collect::<Vec<_>>(),
        ),
        None,
    );
}

#[test]
fn sweeps_are_what_they_sweep() {
    let line = |origin: Point, direction: Point| Curve::Line { origin, direction };
    let revolved = |curve: Curve| Surface::Revolution {
        axis: at_origin(),
        curve: Box::new(curve),
    };
    let up = [0.0, 0.0, 1.0];
    check(
        &revolved(line([2.0, 0.0, 0.0], up)),
        Some(FaceType::Cylinder),
    );
    check(
        &revolved(line([2.0, 0.0, 1.0], [1.0, 1.0, 0.0])),
        Some(FaceType::Plane),
    );
    check(
        &revolved(line([2.0, 0.0, 0.0], [1.0, 0.0, 1.0])),
        Some(FaceType::Cone),
    );
    check(&revolved(line([2.0, 0.0, 0.0], [0.0, 1.0, 1.0])), None);
    let circle = |x: f64| {
        let frame = Frame::new([x, 0.0, 0.0], Some([0.0, 1.0, 0.0]), None);
        Curve::Ellipse {
            frame,
            rx: 1.0,
            ry: 1.0,
        }
    };
    check(&revolved(circle(0.0)), Some(FaceType::Sphere));
    check(&revolved(circle(3.0)), Some(FaceType::Torus));
    check(
        &revolved(Curve::Ellipse {
            frame: at_origin(),
            rx: 1.0,
            ry: 1.0,
        }),
        None,
    );
    check(
        &revolved(spline_curve(&[[1.0, 0.0, 0.0], [2.0, 0.0, 1.0]])),
        Some(FaceType::Cone),
    );
    check(
        &revolved(spline_curve(&[
            [1.0, 0.0, 0.0],
            [3.0, 0.0, 1.0],
            [1.0, 0.0, 2.0],
        ])),
        None,
    );
    let extruded = |curve: Curve| Surface::Extrusion {
        curve: Box::new(curve),
        direction: up,
    };
    check(
        &extruded(line([0.0; 3], [1.0, 0.0, 0.0])),
        Some(FaceType::Plane),
    );
    check(
        &extruded(Curve::Ellipse {
            frame: at_origin(),
            rx: 2.0,
            ry: 2.0,
        }),
        Some(FaceType::Cylinder),
    );
    check(
        &extruded(Curve::Ellipse {
            frame: at_origin(),
            rx: 2.0,
            ry: 2.1,
        }),
        None,
    );
    check(
        &extruded(spline_curve(&[[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 1.0]])),
        Some(FaceType::Plane),
    );
    check(
        &extruded(spline_curve(&[[0.0; 3], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0]])),
        None,
    );
    let offset = Surface::Offset {
        basis: Box::new(splines()[4].0.clone()),
        distance: 0.5,
    };
    check(&offset, Some(FaceType::Sphere));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn neither_point_nor_size_matters(
        which in 0usize..6, scale in 0.01f64..100.0, shift in prop::array::uniform3(-100.0f64..100.0),
        z in prop::array::uniform3(-1.0f64..1.0), x in prop::array::uniform3(-1.0f64..1.0),
    ) {
        let (surface, expected) = &splines()[which];
        let Frame { x, y, z, .. } = Frame::new([0.0; 3], Some(z), Some(x));
        let rotation = [0, 1, 2].map(|axis| [x[axis], y[axis], z[axis]].map(|coordinate| coordinate * scale));
        let moved = surface.transformed(&Transform { rotation, translation: shift.map(|coordinate| coordinate * scale) });
        prop_assert_eq!(primitive_type(&moved, 1e-6 * scale), Some(*expected));
    }
}
