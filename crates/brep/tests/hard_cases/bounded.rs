//! Tests boundaries: slivers and lenses, loops that touch, edges of many faces or off their surface, splines.

use super::*;
use FaceType::{Bspline, Plane};
use fixtures::{CUBE_POLYGONS, box_corners, cuboid, cylinder};
use std::f64::consts::PI;

#[test]
fn plane_faces_that_are_hard() {
    let slab =
        |sides: Point| 2.0 * (sides[0] * sides[1] + sides[1] * sides[2] + sides[2] * sides[0]);
    let cases = [
        ("sliver", [100.0, 100.0, 1e-4]),
        ("long sliver", [1e4, 1e-3, 1.0]),
        ("cube of 1e-6", [1e-6; 3]),
        ("cube of 1e4", [1e4; 3]),
    ];
    for (name, sides) in cases {
        check(
            name,
            cuboid(sides).bytes(),
            &[(6, Plane)],
            [12, 6],
            slab(sides),
            sides.iter().product(),
        );
    }
    check_open(
        "open shell",
        partprobe_synth::fixtures::open_box([10.0; 3]),
        &[(5, Plane)],
        [8, 5],
        500.0,
    );
    check(
        "void",
        partprobe_synth::fixtures::hollow_block([20.0; 3], 5.0),
        &[(12, Plane)],
        [24, 12],
        3000.0,
        7000.0,
    );

    let mut text = StepText::in_millimeters();
    let (sin, cos) = 0.1_f64.sin_cos();
    let corners = [X, [cos, sin, 0.0]];
    let vertices = corners.map(|at| text.vertex(at));
    let arc = circle_edge(&mut text, vertices, [UP, X], [0.0; 3], 1.0);
    let chord = text.straight_edge(vertices, corners);
    let axes = text.axes([0.0; 3], UP, X);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let face = text.face(plane, ".T.", &[(arc, ".T."), (chord, ".F.")]);
    check_open(
        "lens",
        open(text, &[face]),
        &[(1, Plane)],
        [0, 1],
        0.5 * (0.1 - sin),
    );
}

#[test]
fn inner_loops_that_touch() {
    let mut text = StepText::in_millimeters();
    let axes = text.axes([0.0; 3], UP, X);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let corners: [Point; 9] = [
        [0., 0.],
        [10., 0.],
        [10., 10.],
        [0., 10.],
        [5., 5.],
        [2., 4.],
        [2., 6.],
        [8., 6.],
        [8., 4.],
    ]
    .map(|[x, y]| [x, y, 0.0]);
    let vertices = corners.map(|at| text.vertex(at));
    let loops: [&[usize]; 3] = [&[0, 1, 2, 3], &[4, 5, 6], &[4, 7, 8]];
    let bounds: Vec<usize> = loops
        .iter()
        .map(|walk| {
            let uses: Vec<usize> = (0..walk.len())
                .map(|i| {
                    let [a, b] = [walk[i], walk[(i + 1) % walk.len()]];
                    let edge =
                        text.straight_edge([vertices[a], vertices[b]], [corners[a], corners[b]]);
                    text.add(format!("ORIENTED_EDGE('',*,*,#{edge},.T.)"))
                })
                .collect();
            let edges = text.add(format!("EDGE_LOOP('',({}))", references(&uses)));
            text.add(format!("FACE_BOUND('',#{edges},.T.)"))
        })
        .collect();
    let face = text.add(format!(
        "ADVANCED_FACE('',({}),#{plane},.T.)",
        references(&bounds)
    ));
    check_open(
        "inner loops touching",
        open(text, &[face]),
        &[(1, Plane)],
        [0, 1],
        100.0 - 6.0,
    );
}

#[test]
fn thin_faces_are_meshed_until_their_triangles_have_their_area() {
    // Two strips between a line and a flat arc near it. The strips are far apart, so the chord tolerance is not stricter than the
    // angle tolerance. With a single chord, each strip would be larger by a seventh.
    let (half, sag, gap) = (0.15_f64.sin(), 1.0 - 0.15_f64.cos(), 0.051);
    let mut text = StepText::in_millimeters();
    let strips = [0.0, 20.0].map(|x| {
        let corners = [
            [-half, 0.0],
            [half, 0.0],
            [half, gap + sag],
            [-half, gap + sag],
        ]
        .map(|[a, y]| [x + a, y, 0.0]);
        let vertices = corners.map(|at| text.vertex(at));
        let mut side = |i: usize, j: usize| {
            text.straight_edge([vertices[i], vertices[j]], [corners[i], corners[j]])
        };
        let sides = [side(0, 1), side(1, 2), side(3, 0)];
        let arc = circle_edge(
            &mut text,
            [vertices[3], vertices[2]],
            [UP, X],
            [x, 1.0 + gap, 0.0],
            1.0,
        );
        let axes = text.axes([x, 0.0, 0.0], UP, X);
        let plane = text.add(format!("PLANE('',#{axes})"));
        text.face(
            plane,
            ".T.",
            &[
                (sides[0], ".T."),
                (sides[1], ".T."),
                (arc, ".F."),
                (sides[2], ".T."),
            ],
        )
    });
    let area = 4.0 * half * (gap + sag) - 2.0 * (0.15 - half * 0.15_f64.cos());
    let text = open(text, &strips);
    check_open("strips under arcs", &text, &[(2, Plane)], [0, 2], area);
    let mesh = shape_of("strips under arcs", &text).mesh;
    let triangles = mesh.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
        0.5 * partprobe_shape::norm(partprobe_shape::cross(
            partprobe_shape::subtract(b, a),
            partprobe_shape::subtract(c, a),
        ))
    });
    let found: f64 = triangles.sum();
    assert!(
        (found - area).abs() <= 0.05 * area,
        "triangles of {found}, expected {area}"
    );
}

/// The corners of two unit cubes, of which the second is moved, and their polygons over one list of corners.
fn two_cubes(motion: Point) -> (Vec<Point>, Vec<Vec<usize>>) {
    let mut corners = box_corners([1.0; 3]).to_vec();
    let second = box_corners([1.0; 3])
        .map(|corner| [0, 1, 2].map(|axis| corner[axis] + motion[axis]))
        .map(|corner| {
            corners
                .iter()
                .position(|&known| known == corner)
                .unwrap_or_else(|| {
                    corners.push(corner);
                    corners.len() - 1
                })
        });
    let moved = CUBE_POLYGONS.map(|polygon| polygon.iter().map(|&i| second[i]).collect());
    (
        corners,
        CUBE_POLYGONS
            .iter()
            .map(|polygon| polygon.to_vec())
            .chain(moved)
            .collect(),
    )
}

#[test]
fn edges_that_more_than_two_faces_share() {
    let faces = |text: &mut StepText, motion| {
        let (corners, polygons) = two_cubes(motion);
        let polygons: Vec<&[usize]> = polygons.iter().map(Vec::as_slice).collect();
        text.polyhedron(&corners, &polygons)
    };
    let mut text = StepText::in_millimeters();
    let all = faces(&mut text, [1.0, 1.0, 0.0]);
    text.solid(&all);
    check(
        "non-manifold edge",
        text.bytes(),
        &[(12, Plane)],
        [28, 12],
        12.0,
        2.0,
    );
    assert_eq!(
        shape_of("non-manifold edge", &text.bytes())
            .flags
            .non_manifold_edges,
        1
    );

    let mut text = StepText::in_millimeters();
    let all = faces(&mut text, [1.0, 0.0, 0.0]);
    text.solid(&all[..6]);
    text.solid(&all[6..]);
    check(
        "edges shared between shells",
        text.bytes(),
        &[(12, Plane)],
        [24, 12],
        12.0,
        2.0,
    );
}

/// A cylinder whose wall is a closed rational B-spline. `order` changes the order of its partial entities.
pub(crate) fn spline_cylinder(order: impl Fn(&mut Vec<String>)) -> String {
    let mut text = cylinder(2.0, 3.0);
    let around = [
        [1, 0],
        [1, 1],
        [0, 1],
        [-1, 1],
        [-1, 0],
        [-1, -1],
        [0, -1],
        [1, -1],
        [1, 0],
    ];
    let rows = around.map(|[x, y]| {
        let row = [0.0, 3.0].map(|z| text.point([2.0 * f64::from(x), 2.0 * f64::from(y), z]));
        format!("({})", references(&row))
    });
    let weights = around.map(|[x, y]| {
        if x * y == 0 {
            "(1.,1.)"
        } else {
            "(0.7071067811865476,0.7071067811865476)"
        }
    });
    let mut partials = vec![
        "BOUNDED_SURFACE()".to_owned(),
        format!(
            "B_SPLINE_SURFACE(2,1,({}),.UNSPECIFIED.,.T.,.F.,.F.)",
            rows.join(",")
        ),
        "B_SPLINE_SURFACE_WITH_KNOTS((3,2,2,2,3),(2,2),(0.,1.,2.,3.,4.),(0.,1.),.UNSPECIFIED.)"
            .to_owned(),
        "GEOMETRIC_REPRESENTATION_ITEM()".to_owned(),
        format!("RATIONAL_B_SPLINE_SURFACE(({}))", weights.join(",")),
        "REPRESENTATION_ITEM('')".to_owned(),
        "SURFACE()".to_owned(),
    ];
    order(&mut partials);
    let text = String::from_utf8(text.bytes()).unwrap();
    let start = text.find("CYLINDRICAL_SURFACE").unwrap();
    let end = start + text[start..].find(';').unwrap();
    format!("{}({}){}", &text[..start], partials.concat(), &text[end..])
}

#[test]
fn a_closed_spline_in_every_order_of_its_partial_entities() {
    let types = [(2, Plane), (1, Bspline)];
    for turn in 0..7 {
        let text = spline_cylinder(|partials| partials.rotate_left(turn));
        check(
            &format!("complex instance turned by {turn}"),
            text,
            &types,
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
        let text = spline_cylinder(|partials| {
            partials.reverse();
            partials.rotate_left(turn);
        });
        check(
            &format!("complex instance backwards, turned by {turn}"),
            text,
            &types,
            [2, 3],
            20.0 * PI,
            12.0 * PI,
        );
    }
}

#[test]
fn a_spline_one_side_of_which_is_a_point() {
    let mut text = StepText::in_millimeters();
    let corners = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
    let poles = [0, 1, 0, 2].map(|i: usize| text.point(corners[i]));
    let spline = text.add(format!(
        "B_SPLINE_SURFACE_WITH_KNOTS('',1,1,(({}),({})),.UNSPECIFIED.,.F.,.F.,.F.,(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED.)",
        references(&poles[..2]),
        references(&poles[2..])
    ));
    let vertices = corners.map(|at| text.vertex(at));
    let walk = [[0, 1], [1, 2], [2, 0]].map(|ends| {
        (
            text.straight_edge(ends.map(|i| vertices[i]), ends.map(|i| corners[i])),
            ".F.",
        )
    });
    let face = text.face(spline, ".T.", &[walk[2], walk[1], walk[0]]);
    check_open(
        "degenerate B-spline",
        open(text, &[face]),
        &[(1, Bspline)],
        [0, 1],
        2.0,
    );
}

#[test]
fn edges_off_their_surface() {
    let mut text = cuboid([10.0; 3]);
    let axes = text.axes([0.0, 0.0, 10.01], UP, X);
    let text = String::from_utf8(text.bytes()).unwrap();
    let top = text.match_indices("PLANE('',#").nth(1).unwrap().0;
    let end = top + text[top..].find(';').unwrap();
    let text = format!("{}PLANE('',#{axes}){}", &text[..top], &text[end..]);
    check(
        "edges off their surface",
        text,
        &[(6, Plane)],
        [12, 6],
        600.0,
        1000.0,
    );
}
