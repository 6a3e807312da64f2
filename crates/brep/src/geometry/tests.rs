//! Tests laws of curves and surfaces: projection undoes evaluation, and derivatives agree with differences.

use super::*;
use crate::model::{BrepEdge, Vertex};
use partprobe_shape::{Point, cross, distance, dot, norm, subtract};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

fn tilted() -> Frame {
    Frame::new(
        [1.0, -2.0, 3.0],
        Some([0.3, -0.4, 1.0]),
        Some([1.0, 0.5, 0.0]),
    )
}

fn wavy_curve() -> Curve {
    let poles = [
        [0.0, 0.0, 0.0],
        [1.0, 2.0, 0.5],
        [3.0, -1.0, 1.0],
        [4.0, 1.0, -0.5],
        [6.0, 0.0, 0.0],
    ];
    let poles = poles.map(|[x, y, z]| [x, y, z, 1.0]).to_vec();
    Curve::Bspline(
        BsplineCurve::new(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0], poles).unwrap(),
    )
}

fn wavy_surface() -> Surface {
    let height = |i: usize, j: usize| 0.3 * ((i * 7 + j * 5) % 4) as f64;
    let pole = |i: usize, j: usize| [i as f64, j as f64, height(i, j), 1.0];
    let poles = (0..5)
        .flat_map(|i| (0..4).map(move |j| pole(i, j)))
        .collect();
    let knots_u = vec![0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 2.0];
    let knots_v = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0];
    Surface::Bspline(Box::new(
        BsplineSurface::new([3, 3], [knots_u, knots_v], [5, 4], poles).unwrap(),
    ))
}

/// Two thirds of a cylinder and, bent over from it without a kink, an arc of a torus.
fn composite() -> Surface {
    let patch = |surface: Surface, start: [f64; 2], end: [f64; 2]| SurfacePatch {
        surface,
        start,
        end,
        face_type: partprobe_shape::FaceType::Other,
    };
    let frame = tilted();
    let wall = patch(
        Surface::Cylinder { frame, radius: 2.0 },
        [0.5, -1.0],
        [4.5, 0.0],
    );
    let bend = patch(
        Surface::Torus {
            frame,
            major: 1.2,
            minor: 0.8,
        },
        [0.5, 0.0],
        [4.5, 1.0],
    );
    Surface::Composite(Box::new(
        CompositeSurface::new([1, 2], vec![wall, bend]).unwrap(),
    ))
}

/// Every kind of surface, with a rectangle of parameters in which it is regular.
fn surfaces() -> Vec<(Surface, [[f64; 2]; 2])> {
    let turn = [-3.0, 3.0];
    let profile = Box::new(Curve::Ellipse {
        frame: tilted(),
        rx: 2.0,
        ry: 1.0,
    });
    let meridian = Box::new(Curve::Line {
        origin: [2.0, 0.0, 0.0],
        direction: [0.5, 0.0, 1.0],
    });
    let up = Frame::new([0.0; 3], None, None);
    vec![
        (Surface::Plane(tilted()), [[-5.0, 5.0]; 2]),
        (
            Surface::Cylinder {
                frame: tilted(),
                radius: 2.0,
            },
            [turn, [-5.0, 5.0]],
        ),
        (
            Surface::Cone {
                frame: tilted(),
                radius: 2.0,
                slope: 0.5,
            },
            [turn, [-3.0, 5.0]],
        ),
        (
            Surface::Sphere {
                frame: tilted(),
                radius: 2.0,
            },
            [turn, [-1.5, 1.5]],
        ),
        (
            Surface::Torus {
                frame: tilted(),
                major: 3.0,
                minor: 1.0,
            },
            [turn, turn],
        ),
        (wavy_surface(), [[0.0, 2.0], [0.0, 1.0]]),
        (
            Surface::Extrusion {
                curve: profile,
                direction: [0.2, 0.1, 1.0],
            },
            [turn, [-5.0, 5.0]],
        ),
        (
            Surface::Revolution {
                axis: up,
                curve: meridian,
            },
            [turn, [-1.0, 5.0]],
        ),
        (
            Surface::Offset {
                basis: Box::new(wavy_surface()),
                distance: 0.05,
            },
            [[0.1, 1.9], [0.1, 0.9]],
        ),
        (composite(), [[0.0, 1.0], [0.0, 2.0]]),
    ]
}

fn curves() -> Vec<(Curve, [f64; 2])> {
    let frame = tilted();
    let line = Curve::Line {
        origin: [1.0, 2.0, 3.0],
        direction: [2.0, 0.0, 1.0],
    };
    let segment = |start: f64, end: f64| CompositeSegment {
        curve: line.clone(),
        start,
        end,
    };
    let composite = Curve::Composite(vec![segment(0.0, 2.0), segment(2.0, 3.0)]);
    vec![
        (line, [-5.0, 5.0]),
        (
            Curve::Ellipse {
                frame,
                rx: 2.0,
                ry: 2.0,
            },
            [-3.0, 3.0],
        ),
        (
            Curve::Ellipse {
                frame,
                rx: 2.0,
                ry: 1.0,
            },
            [0.1, 6.0],
        ),
        (Curve::Parabola { frame, focal: 0.5 }, [-3.0, 3.0]),
        (
            Curve::Hyperbola {
                frame,
                a: 1.0,
                b: 2.0,
            },
            [-1.5, 1.5],
        ),
        (wavy_curve(), [0.0, 2.0]),
        (
            Curve::Polyline(vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0]]),
            [0.0, 2.0],
        ),
        (composite, [0.0, 2.0]),
        (
            Curve::Offset {
                basis: Box::new(wavy_curve()),
                distance: 0.1,
                reference: [0.0, 0.0, 1.0],
            },
            [0.1, 1.9],
        ),
        (
            on_surface(
                Surface::Cylinder { frame, radius: 2.0 },
                [0.3, 0.0],
                [-1.0, 0.0],
                [0.5, 2.0],
            ),
            [0.0, 3.0],
        ),
        (
            on_surface(
                Surface::Cylinder { frame, radius: 2.0 },
                [0.3, 0.1],
                [1.0, -0.4],
                [1.0, 1.0],
            ),
            [-9.0, 25.0],
        ),
        (
            on_surface(wavy_surface(), [0.1, 0.2], [1.5, 0.5], [1.0, 1.0]),
            [0.0, 1.2],
        ),
    ]
}

/// A line of a surface's parameter plane.
fn on_surface(surface: Surface, from: [f64; 2], direction: [f64; 2], scale: [f64; 2]) -> Curve {
    let [origin, direction] = [from, direction].map(|[x, y]| [x, y, 0.0]);
    let curve = Curve::Line { origin, direction };
    Curve::OnSurface(Box::new(SurfaceCurve {
        surface: Arc::new(surface),
        curve,
        scale,
    }))
}

fn within([low, high]: [f64; 2], f: f64) -> f64 {
    low + f * (high - low)
}

proptest! {
    #[test]
    fn projection_to_a_surface_undoes_evaluation(f in 0.0_f64..1.0, g in 0.0_f64..1.0) {
        for (surface, [u, v]) in surfaces() {
            let point = surface.point(within(u, f), within(v, g));
            for seed in [None, Some([within(u, f) + 0.01, within(v, g) - 0.01])] {
                let found = surface.project(point, seed);
                prop_assert!(found.distance < 1e-8, "{surface:?} {seed:?} {found:?}");
                prop_assert!(distance(surface.point(found.uv[0], found.uv[1]), point) < 1e-8);
            }
        }
    }

    #[test]
    fn projection_to_a_curve_undoes_evaluation(f in 0.0_f64..1.0) {
        for (curve, range) in curves() {
            let point = curve.point(within(range, f));
            let found = curve.point(curve.project(point));
            prop_assert!(distance(found, point) < 1e-7, "{curve:?} {}", distance(found, point));
        }
    }

    #[test]
    fn tangents_agree_with_finite_differences(f in 0.02_f64..0.98, g in 0.02_f64..0.98) {
        for (surface, [u, v]) in surfaces() {
            let (u, v, h) = (within(u, f), within(v, g), 1e-5);
            let (_, du, dv) = surface.derivatives(u, v);
            let slope = |a: Point, b: Point| subtract(a, b).map(|x| x / (2.0 * h));
            let along_u = slope(surface.point(u + h, v), surface.point(u - h, v));
            let along_v = slope(surface.point(u, v + h), surface.point(u, v - h));
            prop_assert!(distance(along_u, du) < 1e-3 * (1.0 + norm(du)), "{surface:?}");
            prop_assert!(distance(along_v, dv) < 1e-3 * (1.0 + norm(dv)), "{surface:?}");
            let normal = surface.unit_normal(u, v).unwrap();
            let expected = cross(du, dv);
            prop_assert!((dot(normal, expected) - norm(expected)).abs() < 1e-4 * norm(expected), "{surface:?}");
        }
    }

    #[test]
    fn a_moved_surface_has_the_moved_points(f in 0.0_f64..1.0, g in 0.0_f64..1.0) {
        let turned = tilted();
        let rigid = Transform { rotation: [turned.x, turned.y, turned.z], translation: [5.0, 6.0, 7.0] };
        for (surface, [u, v]) in surfaces() {
            let (u, v) = (within(u, f), within(v, g));
            prop_assert!(distance(surface.transformed(&rigid).point(u, v), rigid.point(surface.point(u, v))) < 1e-9);
        }
        for (curve, range) in curves() {
            let t = within(range, f);
            prop_assert!(distance(curve.transformed(&rigid).point(t), rigid.point(curve.point(t))) < 1e-9);
        }
    }
}

#[test]
fn degenerate_points_have_no_normal_but_a_limit() {
    let cone = Surface::Cone {
        frame: tilted(),
        radius: 1.0,
        slope: -0.5,
    };
    assert_eq!(cone.unit_normal(0.3, 2.0), None);
    let limit = cone.limit_normal([0.3, 2.0], [0.3, 1.0]).unwrap();
    assert!(distance(limit, cone.unit_normal(0.3, 0.0).unwrap()) < 1e-9);
    let sphere = Surface::Sphere {
        frame: tilted(),
        radius: 1.0,
    };
    assert!(distance(sphere.unit_normal(1.0, FRAC_PI_2).unwrap(), tilted().z) < 1e-12);
}

fn edge(curve: Curve, ends: [u32; 2], same_sense: bool) -> BrepEdge {
    BrepEdge {
        step_id: 0,
        start: ends[0],
        end: ends[1],
        curve: Arc::new(curve),
        same_sense,
    }
}

#[track_caller]
fn check_trim(edge: &BrepEdge, points: [Point; 2], expected: (f64, f64), length: f64) {
    let vertices = points.map(|point| Vertex { step_id: 0, point });
    let (t0, t1) = trim(edge, &vertices);
    assert!(
        (t0 - expected.0).abs() < 1e-9 && (t1 - expected.1).abs() < 1e-9,
        "({t0}, {t1}), expected {expected:?}"
    );
    let measured = edge_length(edge, &vertices);
    assert!(
        (measured - length).abs() < 1e-6 * length,
        "length {measured}, expected {length}"
    );
}

#[test]
fn ends_of_edges_follow_their_senses() {
    let up = Frame::new([0.0; 3], None, None);
    let circle = || Curve::Ellipse {
        frame: up,
        rx: 2.0,
        ry: 2.0,
    };
    let (east, north) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    check_trim(
        &edge(circle(), [0, 1], true),
        [east, north],
        (0.0, FRAC_PI_2),
        PI,
    );
    check_trim(
        &edge(circle(), [0, 1], false),
        [east, north],
        (0.0, -1.5 * PI),
        3.0 * PI,
    );
    check_trim(
        &edge(circle(), [1, 0], true),
        [east, north],
        (FRAC_PI_2, TAU),
        3.0 * PI,
    );
    check_trim(
        &edge(circle(), [0, 0], true),
        [east, north],
        (0.0, TAU),
        4.0 * PI,
    );
    check_trim(
        &edge(circle(), [0, 0], false),
        [east, north],
        (0.0, -TAU),
        4.0 * PI,
    );
    let line = || Curve::Line {
        origin: [0.0; 3],
        direction: [2.0, 0.0, 0.0],
    };
    check_trim(
        &edge(line(), [0, 1], true),
        [[0.0; 3], east],
        (0.0, 1.0),
        2.0,
    );
    check_trim(
        &edge(line(), [1, 0], false),
        [[0.0; 3], east],
        (1.0, 0.0),
        2.0,
    );
    let ellipse = Curve::Ellipse {
        frame: up,
        rx: 2.0,
        ry: 1.0,
    };
    check_trim(
        &edge(ellipse, [0, 0], true),
        [east, north],
        (0.0, TAU),
        9.688_448_220_547_675,
    );
}

#[test]
fn unspecified_axes_are_chosen() {
    for (z, x) in [
        (None, None),
        (Some([0.0; 3]), None),
        (Some([0.0, 0.0, 2.0]), Some([0.0, 0.0, 1.0])),
        (Some([1.0, 0.0, 0.0]), None),
    ] {
        let frame = Frame::new([0.0; 3], z, x);
        let products = [
            dot(frame.x, frame.y),
            dot(frame.y, frame.z),
            dot(frame.z, frame.x),
        ];
        assert!(products.iter().all(|product| product.abs() < 1e-12));
        assert!(distance(cross(frame.x, frame.y), frame.z) < 1e-12);
    }
}

/// A circle around a point of the axis covers its sphere twice. Every point must be found on the same one of the two sheets.
#[test]
fn a_revolved_circle_is_a_sphere_with_one_normal() {
    let axis = Frame::new([1.0, 2.0, 3.0], Some([0.3, -0.5, 0.8]), None);
    for towards in [axis.x, axis.x.map(|coordinate| -coordinate), axis.y] {
        let circle = Curve::Ellipse {
            frame: Frame::new(axis.origin, Some(cross(towards, axis.z)), Some(towards)),
            rx: 2.0,
            ry: 2.0,
        };
        let surface = Surface::Revolution {
            axis,
            curve: Box::new(circle),
        };
        let points = (0..12).flat_map(|turn| {
            (-4..=4).map(move |rise| (f64::from(turn) * 0.5, f64::from(rise) * 0.35))
        });
        // Points of edges lie off the surface by an edge's tolerance, to either side.
        for ((turn, rise), radius) in
            points.flat_map(|point| [2.0, 2.0 + 1e-6, 2.0 - 1e-6].map(|radius| (point, radius)))
        {
            let (reach, height) = (radius * rise.cos(), radius * rise.sin());
            let point = axis.point(reach * turn.cos(), reach * turn.sin(), height);
            let found = surface.project(point, None);
            let normal = surface.unit_normal(found.uv[0], found.uv[1]).unwrap();
            assert!(found.distance < (radius - 2.0).abs() + 1e-9);
            let outward = dot(normal, subtract(point, axis.origin)) / radius;
            assert!((outward - 1.0).abs() < 1e-9, "{turn} {rise}: {outward}");
        }
    }
}

#[test]
fn a_knot_as_multiple_as_the_degree_may_be_a_kink() {
    let cases: [(&[f64], usize, bool); 5] = [
        (&[0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], 2, true),
        (&[0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0], 2, false),
        (&[0.0, 0.0, 0.0, 2.0, 2.0, 2.0], 2, false),
        (&[0.0, 0.0, 1.0, 2.0, 2.0], 1, true),
        (&[0.0, 0.0, 2.0, 2.0], 1, false),
    ];
    for (knots, degree, expected) in cases {
        assert_eq!(
            super::bspline_basis::jumps_at_a_knot(knots, degree),
            expected,
            "{knots:?}"
        );
    }
}
