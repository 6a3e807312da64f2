//! Tests every hard case of STEP files by name. The expected values are in closed form.

#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its own text has failed"
)]

mod bounded;
mod classes;
mod dialects;
mod files;
#[path = "../../src/fixtures.rs"]
#[allow(dead_code, reason = "the unit tests use the rest of it")]
mod fixtures;
mod misoriented;
mod other_contents;
mod revolved;
mod tessellated;

use fixtures::{StepText, references};
use partprobe_brep::{ReadBudget, Tessellation, TessellationOptions, read, tessellate};
use partprobe_shape::{FaceType, Point, solid_mesh, weld};
use partprobe_sources::partition_by_type_and_angle;

const UP: Point = [0.0, 0.0, 1.0];
const X: Point = [1.0, 0.0, 0.0];
/// The threshold of the paper, in degrees.
const THETA_DEG: f64 = 8.0;

fn shape_of(name: &str, text: &[u8]) -> Tessellation {
    let brep = read(text, &ReadBudget::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
    tessellate(
        &brep,
        &TessellationOptions {
            solid_volumes: true,
            ..TessellationOptions::default()
        },
    )
}

/// Checks types, edges and parts, the total area within 1 %, and that no face is lost.
#[track_caller]
fn check_faces(
    name: &str,
    text: impl AsRef<[u8]>,
    types: &[(usize, FaceType)],
    [n_edges, n_parts]: [usize; 2],
    area: f64,
) -> Tessellation {
    let shape = shape_of(name, text.as_ref());
    assert_eq!(shape.lost, [], "{name}");
    for face_type in FaceType::ALL {
        let expected: usize = types
            .iter()
            .filter(|entry| entry.1 == face_type)
            .map(|entry| entry.0)
            .sum();
        let found = shape
            .graph
            .faces
            .iter()
            .filter(|face| face.face_type == face_type)
            .count();
        assert_eq!(found, expected, "{name}: {face_type}");
    }
    assert_eq!(shape.graph.edges.len(), n_edges, "{name}: edges");
    let partition = partition_by_type_and_angle(&shape.graph, THETA_DEG);
    assert_eq!(partition.n_parts() as usize, n_parts, "{name}: parts");
    let found: f64 = shape.graph.faces.iter().map(|face| face.area).sum();
    assert!(
        (found - area).abs() <= 0.01 * area,
        "{name}: area {found}, expected {area}"
    );
    shape
}

/// Checks the same as `check_faces`, and that the mesh is closed and the surfaces enclose this volume within 1 %.
#[track_caller]
fn check(
    name: &str,
    text: impl AsRef<[u8]>,
    types: &[(usize, FaceType)],
    counts: [usize; 2],
    area: f64,
    volume: f64,
) {
    let shape = check_faces(name, text, types, counts, area);
    let mesh = solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true);
    assert!(
        mesh.watertight && mesh.volume > 0.0,
        "{name}: the mesh is open"
    );
    let found: f64 = shape.solid_volumes.iter().sum();
    assert!(
        (found - volume).abs() <= 0.01 * volume,
        "{name}: volume {found}, expected {volume}"
    );
}

/// Checks the same as `check_faces` for an open shell, and that the mesh has a border.
#[track_caller]
fn check_open(
    name: &str,
    text: impl AsRef<[u8]>,
    types: &[(usize, FaceType)],
    counts: [usize; 2],
    area: f64,
) {
    let shape = check_faces(name, text, types, counts, area);
    assert!(
        !solid_mesh(&shape.mesh, &weld(&shape.mesh), |_| true).watertight,
        "{name}: the mesh is closed"
    );
}

/// An open shell of these faces.
fn open(mut text: StepText, faces: &[usize]) -> Vec<u8> {
    let shell = text.add(format!("OPEN_SHELL('',({}))", references(faces)));
    let model = text.add(format!("SHELL_BASED_SURFACE_MODEL('',(#{shell}))"));
    text.add(format!(
        "MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',(#{model}),#1)"
    ));
    text.bytes()
}

fn circle_edge(
    text: &mut StepText,
    [from, to]: [usize; 2],
    [z, x]: [Point; 2],
    at: Point,
    radius: f64,
) -> usize {
    let axes = text.axes(at, z, x);
    let circle = text.add(format!("CIRCLE('',#{axes},{radius:?})"));
    text.add(format!("EDGE_CURVE('',#{from},#{to},#{circle},.T.)"))
}
