//! Tests boundaries of one face that touch each other without a common vertex, in plates with holes and in their prisms.

use super::*;

/// A closed outline, counter-clockwise.
#[derive(Clone, Debug)]
enum Outline {
    /// Center, radius, and the angle at which the circle's vertex lies.
    Circle([f64; 2], f64, f64),
    Polygon(Vec<[f64; 2]>),
}

use Outline::{Circle, Polygon};

const HEIGHT: f64 = 3.0;

impl Outline {
    fn area(&self) -> f64 {
        match self {
            Circle(_, radius, _) => PI * radius * radius,
            Polygon(corners) => {
                let next = corners.iter().cycle().skip(1);
                corners
                    .iter()
                    .zip(next)
                    .map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0]))
                    .sum()
            }
        }
    }

    fn corners(&self) -> Vec<[f64; 2]> {
        match self {
            Circle([x, y], radius, turn) => {
                vec![[x + radius * turn.cos(), y + radius * turn.sin()]]
            }
            Polygon(corners) => corners.clone(),
        }
    }

    fn scaled(&self, by: f64) -> Self {
        let point = |[x, y]: [f64; 2]| [x * by, y * by];
        match self {
            Circle(center, radius, turn) => Circle(point(*center), radius * by, *turn),
            Polygon(corners) => Polygon(corners.iter().copied().map(point).collect()),
        }
    }
}

fn regular(n: usize, radius: f64, turn: f64) -> Outline {
    let angle = |i: usize| turn + TAU * i as f64 / n as f64;
    Polygon(
        (0..n)
            .map(|i| [radius * angle(i).cos(), radius * angle(i).sin()])
            .collect(),
    )
}

fn square(half: f64) -> Outline {
    Polygon(vec![
        [-half, -half],
        [half, -half],
        [half, half],
        [-half, half],
    ])
}

/// A prism over the first outline without the others: bottom, top, then the walls of each outline.
fn prism(outlines: &[Outline], height: f64) -> Brep {
    let levels = [0.0, height];
    let corners: Vec<Vec<[f64; 2]>> = outlines.iter().map(Outline::corners).collect();
    let points = |z: f64| corners.iter().flatten().map(move |&[x, y]| [x, y, z]);
    let points: Vec<Point> = levels.into_iter().flat_map(points).collect();
    let n_corners = (points.len() / 2) as u32;
    let mut brep = shape(&points);
    let mut first = 0;
    let mut walls = Vec::new();
    let mut loops = [Vec::new(), Vec::new()];
    for (outline, corners) in outlines.iter().zip(&corners) {
        let n = corners.len() as u32;
        let first_edge = brep.edges.len() as i32;
        for (level, z) in (0..).zip(levels) {
            for i in 0..n {
                let [from, to] = [i, (i + 1) % n].map(|i| level * n_corners + first + i);
                brep = match *outline {
                    Circle([x, y], radius, turn) => {
                        let (sin, cos) = turn.sin_cos();
                        let frame = Frame {
                            origin: [x, y, z],
                            x: [cos, sin, 0.0],
                            y: [-sin, cos, 0.0],
                            z: UP.z,
                        };
                        brep.arc(from, to, frame, radius)
                    }
                    Polygon(_) => brep.line(from, to),
                };
            }
        }
        for i in 0..n {
            brep = brep.line(first + i, n_corners + first + i);
        }
        let edge = |kind: i32, i: u32| first_edge + kind * n as i32 + (i % n) as i32 + 1;
        for level in [0, 1] {
            loops[level as usize].push((0..n).map(|i| edge(level, i)).collect::<Vec<_>>());
        }
        for i in 0..n {
            let surface = match *outline {
                Circle([x, y], radius, _) => Surface::Cylinder {
                    frame: Frame {
                        origin: [x, y, 0.0],
                        ..UP
                    },
                    radius,
                },
                Polygon(_) => {
                    let [a, b] = [i, (i + 1) % n].map(|i| corners[i as usize]);
                    let normal = [b[1] - a[1], a[0] - b[0], 0.0];
                    Surface::Plane(Frame::new([a[0], a[1], 0.0], Some(normal), None))
                }
            };
            let is_outer = first == 0;
            let walk = [edge(0, i), edge(2, i + 1), -edge(1, i), -edge(2, i)];
            walls.push((surface, is_outer, walk));
        }
        first += n;
    }
    let backwards = |walk: &[i32]| walk.iter().rev().map(|edge| -edge).collect::<Vec<_>>();
    for (level, sense) in [(0, false), (1, true)] {
        // Seen from outside, the outer loop and the holes have the face on their left.
        let reversed = |(i, walk): (usize, &Vec<i32>)| {
            if (i == 0) == sense {
                walk.clone()
            } else {
                backwards(walk)
            }
        };
        let loops: Vec<Vec<i32>> = loops[level].iter().enumerate().map(reversed).collect();
        let loops: Vec<&[i32]> = loops.iter().map(Vec::as_slice).collect();
        brep = brep.face(plane_at(levels[level]), sense, &loops);
    }
    for (surface, is_outer, walk) in walls {
        let walk = if is_outer {
            walk.to_vec()
        } else {
            backwards(&walk)
        };
        brep = brep.face(surface, is_outer, &[&walk]);
    }
    brep
}

/// Checks the area and the mesh of both ends, and that the solid is closed and has the right volume.
#[track_caller]
fn check(outlines: &[Outline]) {
    for scale in [1.0, 1e-3, 100.0] {
        let outlines: Vec<Outline> = outlines
            .iter()
            .map(|outline| outline.scaled(scale))
            .collect();
        let holes: f64 = outlines[1..].iter().map(Outline::area).sum();
        let area = outlines[0].area() - holes;
        let tessellation = mesh_of(&prism(&outlines, HEIGHT * scale));
        assert_eq!(tessellation.lost, [], "{outlines:?}");
        let triangles = tessellation.mesh.triangle_areas();
        for face in 0..2_u32 {
            let found = tessellation.areas[face as usize];
            assert!(
                (found - area).abs() <= 1e-4 * area,
                "{outlines:?}: area {found}, expected {area}"
            );
            let of_face = triangles
                .iter()
                .zip(&tessellation.mesh.tri_face)
                .filter(|(_, of)| **of == face);
            let found: f64 = of_face.map(|(area, _)| area).sum();
            assert!(
                (found - area).abs() <= 0.08 * area,
                "{outlines:?}: mesh {found}, expected {area}"
            );
        }
        let solid = solid_of(&tessellation);
        let volume = area * HEIGHT * scale;
        assert!(solid.watertight, "{outlines:?}: the mesh is open");
        let exact = tessellation.solid_volumes[0];
        assert!(
            (exact - volume).abs() <= 1e-3 * volume,
            "{outlines:?}: volume {exact}, expected {volume}"
        );
    }
}

#[test]
fn corners_of_a_hole_lie_on_the_rim_or_near_it() {
    for gap in [0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-7, -1e-7, 1e-5, 1e-4] {
        for (n, turn) in [(3, 0.5), (4, 0.25 * PI), (7, 1.1)] {
            check(&[
                Circle([0.0; 2], 10.0, 0.0),
                regular(n, 10.0 * (1.0 - gap), turn),
            ]);
        }
    }
    // A corner at the rim's own vertex, and corners a rounding error away from it.
    for radius in [10.0, 10.0 * (1.0 + 1e-15), 10.0 * (1.0 - 3e-16)] {
        check(&[Circle([0.0; 2], 10.0, 0.0), regular(4, radius, 0.0)]);
    }
}

#[test]
fn round_holes_touch_a_rim_or_nearly_fill_it() {
    for radius in [1.0, 5.0, 9.0, 9.9] {
        for turn in [0.0, 0.7] {
            let center = 10.0 - radius;
            check(&[
                Circle([0.0; 2], 10.0, 0.0),
                Circle([center * 0.8, center * 0.6], radius, turn),
            ]);
        }
    }
    check(&[Circle([0.0; 2], 10.0, 0.3), Circle([0.0; 2], 9.9999, 1.0)]);
    check(&[square(10.0), Circle([0.0; 2], 10.0, 0.4)]);
    // The whole hole lies between the rim and its chord.
    check(&[
        Circle([0.0; 2], 10.0, 0.0),
        Circle([9.98 * 0.1_f64.cos(), 9.98 * 0.1_f64.sin()], 0.005, 1.0),
    ]);
}

#[test]
fn holes_touch_straight_edges_and_each_other() {
    for gap in [0.0, 1e-12, -1e-12, 1e-9, -1e-9] {
        let corners = vec![
            [3.3, gap - 10.0],
            [10.0 - gap, 1.7],
            [-2.2, 10.0 - gap],
            [gap - 10.0, 0.9],
        ];
        check(&[square(10.0), Polygon(corners)]);
    }
    let wedge = |tip: [f64; 2]| Polygon(vec![tip, [4.0, -2.0], [4.0, 4.0]]);
    check(&[
        square(10.0),
        Polygon(vec![[-5.0, -5.0], [0.0, -5.0], [0.0, 5.0], [-5.0, 5.0]]),
        wedge([0.0, 1.0]),
    ]);
    let on_circle = [3.0 * 0.4_f64.cos() - 3.0, 3.0 * 0.4_f64.sin()];
    check(&[
        square(10.0),
        Circle([-3.0, 0.0], 3.0, 0.5),
        wedge(on_circle),
    ]);
    check(&[
        square(10.0),
        Circle([-3.0, 0.0], 3.0, 0.5),
        Circle([2.0, 0.0], 2.0, 1.5),
    ]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn any_inscribed_polygon_is_a_hole(n in 3_usize..9, turn in 0.0_f64..TAU, vertex in 0.0_f64..TAU, digits in 3_i32..14) {
        for gap in [10.0_f64.powi(-digits), 0.0] {
            let outlines = [Circle([0.0; 2], 10.0, vertex), regular(n, 10.0 * (1.0 - gap), turn)];
            let tessellation = mesh_of(&prism(&outlines, HEIGHT));
            let area = outlines[0].area() - outlines[1].area();
            prop_assert!((tessellation.areas[0] - area).abs() <= 1e-4 * area, "{} of {}", tessellation.areas[0], area);
            prop_assert!(solid_of(&tessellation).watertight);
        }
    }
}

/// A ring that is much thinner than the sag of its chords.
#[test]
fn a_ring_of_next_to_no_width_keeps_its_area() {
    for minor in [1e-3, 1e-4, 1e-5] {
        let major = 7.13;
        let ring = shape(&[[major, 0.0, minor], [0.0, major - minor, 0.0]]).circle(0, major, minor);
        let frame = Frame {
            x: UP.y,
            y: [-1.0, 0.0, 0.0],
            ..UP
        };
        let ring = ring.arc(1, 1, frame, major - minor).face(
            Surface::Torus {
                frame: UP,
                major,
                minor,
            },
            true,
            &[&[1], &[-2]],
        );
        let expected = TAU * minor * (FRAC_PI_2 * major - minor);
        let mesh = mesh_of(&ring);
        let found: f64 = mesh.mesh.triangle_areas().iter().sum();
        assert!(
            (mesh.areas[0] - expected).abs() < 1e-3 * expected,
            "{} of {expected}",
            mesh.areas[0]
        );
        assert!(
            (found - expected).abs() < 0.15 * expected,
            "{minor}: mesh {found} of {expected}"
        );
    }
}

/// The wall of a cylinder of radius 5 and height 10 with holes. Each hole is given by two angles and two heights.
fn pierced_cylinder(holes: &[[f64; 4]]) -> Brep {
    const RADIUS: f64 = 5.0;
    let point = |angle: f64, z: f64| [RADIUS * angle.cos(), RADIUS * angle.sin(), z];
    let corners = |&[a, b, low, high]: &[f64; 4]| {
        [point(a, low), point(b, low), point(b, high), point(a, high)]
    };
    let rims = [point(0.0, 0.0), point(0.0, 10.0)];
    let points: Vec<Point> = rims
        .into_iter()
        .chain(holes.iter().flat_map(corners))
        .collect();
    let mut brep = shape(&points)
        .circle(0, RADIUS, 0.0)
        .circle(1, RADIUS, 10.0)
        .line(0, 1);
    let mut loops = vec![vec![1, 3, -2, -3]];
    for (i, &[_, _, low, high]) in (0..).zip(holes) {
        let first = 2 + 4 * i;
        let level = |z: f64| Frame {
            origin: [0.0, 0.0, z],
            ..UP
        };
        brep = brep
            .arc(first, first + 1, level(low), RADIUS)
            .line(first + 1, first + 2);
        brep = brep
            .arc(first + 3, first + 2, level(high), RADIUS)
            .line(first + 3, first);
        let edge = brep.edges.len() as i32 - 3;
        loops.push(vec![-(edge + 3), edge + 2, -(edge + 1), -edge]);
    }
    let loops: Vec<&[i32]> = loops.iter().map(Vec::as_slice).collect();
    brep.face(
        Surface::Cylinder {
            frame: UP,
            radius: RADIUS,
        },
        true,
        &loops,
    )
}

/// Holes that touch a rim along an arc, or both rims, or each other along a straight line.
#[test]
fn holes_of_a_cylinder_touch_its_rims_and_each_other() {
    for gap in [0.0, 1e-6, 1e-5, 1e-4, 1e-3] {
        let patterns: [&[[f64; 4]]; 5] = [
            &[[1.0, 2.0, gap, 10.0 - gap]],
            &[[1.0, 2.0, gap, 5.0]],
            &[[1.0, 2.0, gap, 5.0], [2.0 + gap / 5.0, 3.0, 2.0, 7.0]],
            &[[1.0, 2.0, gap, 5.0], [3.0, 6.0, 5.0, 10.0 - gap]],
            &[
                [0.5, 2.5, gap, 4.0],
                [0.7, 1.9, 4.0 + gap, 9.0],
                [3.0, 3.5, 1.0, 10.0 - gap],
            ],
        ];
        for holes in patterns {
            let cut: f64 = holes
                .iter()
                .map(|[a, b, low, high]| 5.0 * (b - a) * (high - low))
                .sum();
            let expected = 100.0 * PI - cut;
            let tessellation = mesh_of(&pierced_cylinder(holes));
            let [area, mesh] = [
                tessellation.areas[0],
                tessellation.mesh.triangle_areas().iter().sum(),
            ];
            assert_eq!(tessellation.lost, [], "{holes:?}");
            assert!(
                (area - expected).abs() <= 1e-4 * expected,
                "{holes:?}: area {area}, expected {expected}"
            );
            assert!(
                (mesh - expected).abs() <= 0.02 * expected,
                "{holes:?}: mesh {mesh}, expected {expected}"
            );
        }
    }
}
