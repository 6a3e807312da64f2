//! Tests edges that lie far from the surfaces of their faces.

use super::*;

/// The mesh of a shape whose edges are numbered from 101. Checks that one lost entity names this face and this edge.
#[track_caller]
fn named(mut brep: Brep, face: u64, edge: u64) -> BrepMesh {
    for (edge, number) in brep.edges.iter_mut().zip(101..) {
        edge.step_id = number;
    }
    let tessellation = mesh_of(&brep);
    let [loss] = tessellation.lost.as_slice() else {
        panic!("{:?}", tessellation.lost)
    };
    assert_eq!(loss.step_id, face, "{loss}");
    assert!(
        loss.reason.contains(&format!("edge #{edge} lies ")),
        "{loss}"
    );
    tessellation
}

#[track_caller]
fn check_areas(tessellation: &BrepMesh, face: u32, expected: f64) {
    let found = tessellation.areas[face as usize];
    assert!(
        (found - expected).abs() <= 1e-3 * expected,
        "area {found}, expected {expected}"
    );
    let triangles = tessellation.mesh.triangle_areas();
    let of_face = triangles
        .iter()
        .zip(&tessellation.mesh.tri_face)
        .filter(|(_, of)| **of == face);
    let found: f64 = of_face.map(|(area, _)| area).sum();
    assert!(
        (found - expected).abs() <= 0.05 * expected,
        "mesh {found}, expected {expected}"
    );
}

#[test]
fn a_rim_far_away_bounds_nothing() {
    let brep = shape(&[[1003.5, 0.0, 0.0], [3.5, 0.0, 10.0]]);
    let far = Frame {
        origin: [1000.0, 0.0, 0.0],
        ..UP
    };
    let brep = brep.arc(0, 0, far, 3.5).circle(1, 3.5, 10.0);
    let tube = brep.face(
        Surface::Cylinder {
            frame: UP,
            radius: 3.5,
        },
        true,
        &[&[1], &[-2]],
    );
    assert_eq!(named(tube, 1, 101).mesh.triangles, [] as [[u32; 3]; 0]);
}

#[test]
fn a_boundary_that_leaves_its_plane_lies_in_its_own() {
    let corners = [
        [0.0; 3],
        [0.0, 10.0, 0.0],
        [0.0, 10.0, 10.0],
        [0.0, 0.0, 10.0],
    ];
    let square = shape(&corners)
        .line(0, 1)
        .line(1, 2)
        .line(2, 3)
        .line(3, 0)
        .face(plane_at(0.0), true, &[&[1, 2, 3, 4]]);
    check_areas(&named(square, 1, 102), 0, 100.0);
}

#[test]
fn a_plane_in_the_wrong_position_leaves_its_solid_closed() {
    let mut brep = box_of([10.0, 20.0, 30.0]);
    brep.faces[1].surface = Arc::new(plane_at(31.0));
    let tessellation = named(brep, 2, 105);
    check_areas(&tessellation, 1, 200.0);
    let solid = solid_of(&tessellation);
    assert!(solid.watertight && (solid.volume - 6000.0).abs() < 1e-9);
}

#[test]
fn a_hole_off_its_plane_is_projected() {
    let brep = shape(&[[10.0, 0.0, 0.0], [2.0, 0.0, 5.0]])
        .circle(0, 10.0, 0.0)
        .circle(1, 2.0, 5.0);
    let tessellation = named(brep.face(plane_at(0.0), true, &[&[1], &[-2]]), 1, 102);
    check_areas(&tessellation, 0, 96.0 * PI);
    assert!(
        tessellation
            .mesh
            .vertices
            .iter()
            .all(|vertex| vertex[2] == 0.0)
    );
}

#[test]
fn a_wider_rim_ends_on_its_cylinder() {
    let brep = shape(&[[5.0, 0.0, 0.0], [3.0, 0.0, 10.0]])
        .circle(0, 5.0, 0.0)
        .circle(1, 3.0, 10.0);
    let tube = brep.face(
        Surface::Cylinder {
            frame: UP,
            radius: 3.0,
        },
        true,
        &[&[1], &[-2]],
    );
    let tessellation = named(tube, 1, 101);
    check_areas(&tessellation, 0, 60.0 * PI);
    assert!(
        tessellation
            .mesh
            .vertices
            .iter()
            .all(|vertex| vertex[0].hypot(vertex[1]) < 3.001)
    );
}

#[test]
fn a_chord_of_a_cylinder_is_named() {
    // Three sides of a quarter of the tube, and a straight edge instead of the lower arc.
    let corners = [
        [5.0, 0.0, 0.0],
        [0.0, 5.0, 0.0],
        [0.0, 5.0, 10.0],
        [5.0, 0.0, 10.0],
    ];
    let above = Frame {
        origin: [0.0, 0.0, 10.0],
        ..UP
    };
    let brep = shape(&corners)
        .line(0, 1)
        .line(1, 2)
        .arc(3, 2, above, 5.0)
        .line(3, 0);
    let quarter = brep.face(
        Surface::Cylinder {
            frame: UP,
            radius: 5.0,
        },
        true,
        &[&[1, 2, -3, 4]],
    );
    named(quarter, 1, 101);
}

#[test]
fn imprecise_edges_are_kept_as_they_are() {
    let mut brep = box_of([10.0, 20.0, 30.0]);
    brep.faces[1].surface = Arc::new(plane_at(30.01));
    let tessellation = mesh_of(&brep);
    assert_eq!(tessellation.lost, []);
    assert!(solid_of(&tessellation).watertight);
}
