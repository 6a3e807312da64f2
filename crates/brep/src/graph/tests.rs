use super::{ShapeFlags, face_graph};
use crate::fixtures::{StepText, box_corners, cuboid, cylinder, references};
use crate::{ReadBudget, read};
use partprobe_shape::{FaceGraph, FaceType, Point};
use proptest::prelude::*;
use std::f64::consts::TAU;

fn graph_of(text: &StepText) -> (FaceGraph, ShapeFlags) {
    face_graph(&read(&text.bytes(), &ReadBudget::default()).unwrap())
}

/// Checks each edge's faces, angle and length.
#[track_caller]
fn check(text: &StepText, expected: &[([u32; 2], f64, f64)]) {
    let (graph, _) = graph_of(text);
    let faces: Vec<_> = graph.edges.iter().map(|edge| edge.faces).collect();
    assert_eq!(
        faces,
        expected.iter().map(|edge| edge.0).collect::<Vec<_>>()
    );
    for (edge, (_, phi, length)) in graph.edges.iter().zip(expected) {
        assert!(
            (edge.phi - phi).abs() < 1e-9 && (edge.length - length).abs() < 1e-9,
            "{edge:?}"
        );
    }
}

#[test]
fn a_box_has_twelve_right_angles() {
    let (graph, flags) = graph_of(&cuboid([1.0, 2.0, 3.0]));
    assert_eq!((graph.faces.len(), graph.edges.len()), (6, 12));
    assert!(
        graph
            .edges
            .iter()
            .all(|edge| (edge.phi - 90.0).abs() < 1e-12)
    );
    let total: f64 = graph.edges.iter().map(|edge| edge.length).sum();
    assert!((total - 24.0).abs() < 1e-12);
    assert_eq!(flags, ShapeFlags::default());
}

#[test]
fn rims_of_a_cylinder_count_and_its_seam_does_not() {
    let text = cylinder(2.0, 5.0);
    check(
        &text,
        &[([0, 2], 90.0, 2.0 * TAU), ([1, 2], 90.0, 2.0 * TAU)],
    );
    let (graph, flags) = graph_of(&text);
    assert_eq!(
        flags,
        ShapeFlags {
            seams: 1,
            ..ShapeFlags::default()
        }
    );
    let types: Vec<_> = graph.faces.iter().map(|face| face.face_type).collect();
    assert_eq!(
        types,
        [FaceType::Plane, FaceType::Plane, FaceType::Cylinder]
    );
}

/// Two strips that meet at the y axis, the second lifted by `lift_deg` out of the first's plane.
fn two_strips(lift_deg: f64, second_flag: &str) -> StepText {
    let mut text = StepText::in_millimeters();
    let (sin, cos) = (
        libm::sin(lift_deg.to_radians()),
        libm::cos(lift_deg.to_radians()),
    );
    let corners = [
        [-1.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
        [cos, 0.0, sin],
        [cos, 1.0, sin],
    ];
    let mut faces = text.polyhedron(&corners, &[&[0, 1, 2, 3], &[1, 4, 5, 2]]);
    faces[1] = text.add(format!("ORIENTED_FACE('',*,#{},{second_flag})", faces[1]));
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(&faces)));
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    text
}

#[test]
fn the_angle_of_two_strips_is_their_lift() {
    for lift in [0.0, 4.0, 7.999, 8.0, 90.0, 179.0] {
        check(&two_strips(lift, ".T."), &[([0, 1], lift, 1.0)]);
    }
}

#[test]
fn a_reversed_face_folds_the_join_and_is_flagged() {
    check(&two_strips(0.0, ".F."), &[([0, 1], 180.0, 1.0)]);
    let (_, flags) = graph_of(&two_strips(0.0, ".F."));
    assert_eq!(
        flags,
        ShapeFlags {
            twice_same_direction: 1,
            free_edges: 6,
            ..ShapeFlags::default()
        }
    );
}

#[test]
fn an_edge_of_three_faces_gives_all_pairs_and_a_flag() {
    let mut text = StepText::in_millimeters();
    let corners = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.0],
    ];
    let faces = text.polyhedron(&corners, &[&[0, 2, 1], &[0, 1, 3], &[0, 1, 4]]);
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(&faces)));
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    let (graph, flags) = graph_of(&text);
    assert_eq!(
        graph
            .edges
            .iter()
            .map(|edge| edge.faces)
            .collect::<Vec<_>>(),
        [[0, 1], [0, 2], [1, 2]]
    );
    assert_eq!(flags.non_manifold_edges, 1);
}

#[test]
fn halves_of_a_cylinder_are_smooth_at_their_edges() {
    let mut text = StepText::in_millimeters();
    let (up, x) = ([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let at = [
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 1.0],
        [-1.0, 0.0, 1.0],
    ];
    let vertices = at.map(|at| text.vertex(at));
    let axes = [0.0, 1.0].map(|z| text.axes([0.0, 0.0, z], up, x));
    let arc = |text: &mut StepText, axes: usize, [a, b]: [usize; 2]| {
        let circle = text.add(format!("CIRCLE('',#{axes},1.)"));
        text.add(format!(
            "EDGE_CURVE('',#{},#{},#{circle},.T.)",
            vertices[a], vertices[b]
        ))
    };
    let arcs = [(0, [0, 1]), (0, [1, 0]), (1, [2, 3]), (1, [3, 2])]
        .map(|(i, ends)| arc(&mut text, axes[i], ends));
    let uprights = [[0, 2], [1, 3]]
        .map(|[a, b]| text.straight_edge([vertices[a], vertices[b]], [at[a], at[b]]));
    let side = text.add(format!("CYLINDRICAL_SURFACE('',#{},1.)", axes[0]));
    let faces = [
        text.face(
            side,
            ".T.",
            &[
                (arcs[0], ".T."),
                (uprights[1], ".T."),
                (arcs[2], ".F."),
                (uprights[0], ".F."),
            ],
        ),
        text.face(
            side,
            ".T.",
            &[
                (arcs[1], ".T."),
                (uprights[0], ".T."),
                (arcs[3], ".F."),
                (uprights[1], ".F."),
            ],
        ),
    ];
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(&faces)));
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    check(&text, &[([0, 1], 0.0, 1.0), ([0, 1], 0.0, 1.0)]);
}

/// An extrusion whose basis curve ends with a double pole, so that its normal is undefined along one edge.
#[test]
fn a_normal_that_is_undefined_along_an_edge_is_taken_as_a_limit() {
    let mut text = StepText::in_millimeters();
    let poles: [Point; 4] = [
        [-3.0, 0.0, 0.0],
        [-2.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
    ];
    let poles = poles.map(|pole| text.point(pole));
    let basis = text.add(format!(
        "B_SPLINE_CURVE_WITH_KNOTS('',3,({}),.U.,.F.,.F.,(4,4),(0.,1.),.U.)",
        references(&poles)
    ));
    let up = text.direction([0.0, 1.0, 0.0]);
    let vector = text.add(format!("VECTOR('',#{up},1.)"));
    let extrusion = text.add(format!(
        "SURFACE_OF_LINEAR_EXTRUSION('',#{basis},#{vector})"
    ));
    let corners = [
        [-3.0, 0.0, 0.0],
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-3.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
    ];
    let vertices = corners.map(|corner| text.vertex(corner));
    let mut edge = |a: usize, b: usize| {
        text.straight_edge([vertices[a], vertices[b]], [corners[a], corners[b]])
    };
    let [bottom, shared, top, left] = [edge(0, 1), edge(1, 2), edge(3, 2), edge(0, 3)];
    let [rise, far, fall] = [edge(1, 4), edge(4, 5), edge(2, 5)];
    let axes = text.axes([0.0; 3], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let plane = text.add(format!("PLANE('',#{axes})"));
    let faces = [
        text.face(
            extrusion,
            ".T.",
            &[
                (bottom, ".T."),
                (shared, ".T."),
                (top, ".F."),
                (left, ".F."),
            ],
        ),
        text.face(
            plane,
            ".T.",
            &[(rise, ".T."), (far, ".T."), (fall, ".F."), (shared, ".F.")],
        ),
    ];
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(&faces)));
    text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    check(&text, &[([0, 1], 90.0, 1.0)]);
}

proptest! {
    #[test]
    fn lengths_scale_and_angles_do_not(sides in prop::array::uniform3(0.01_f64..100.0), scale in 0.1_f64..10.0) {
        let (graph, _) = graph_of(&cuboid(sides));
        let (scaled, _) = graph_of(&cuboid(sides.map(|side| side * scale)));
        for (edge, scaled) in graph.edges.iter().zip(&scaled.edges) {
            prop_assert_eq!(edge.faces, scaled.faces);
            prop_assert!((edge.length * scale - scaled.length).abs() <= 1e-9 * scaled.length);
            prop_assert!((edge.phi - 90.0).abs() < 1e-9 && (scaled.phi - 90.0).abs() < 1e-9);
        }
    }

    #[test]
    fn the_order_of_faces_only_renumbers(order in Just([0, 1, 2, 3, 4, 5]).prop_shuffle()) {
        let polygons = order.map(|face: usize| crate::fixtures::CUBE_POLYGONS[face]);
        let mut text = StepText::in_millimeters();
        let faces = text.polyhedron(&box_corners([1.0, 2.0, 3.0]), &polygons);
        text.solid(&faces);
        let (graph, _) = graph_of(&text);
        let (plain, _) = graph_of(&cuboid([1.0, 2.0, 3.0]));
        let renumbered = |faces: [u32; 2]| {
            let mut faces = faces.map(|face| order[face as usize] as u32);
            faces.sort_unstable();
            faces
        };
        let mut pairs: Vec<_> = graph.edges.iter().map(|edge| renumbered(edge.faces)).collect();
        pairs.sort_unstable();
        prop_assert_eq!(pairs, plain.edges.iter().map(|edge| edge.faces).collect::<Vec<_>>());
    }
}
