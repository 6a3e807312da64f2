//! Makes a small carrier with known numbers, for the tests of the mesh formats.

use partprobe_carrier::{
    Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, LabelLayer, Mesh, STEP_PARTS,
    STEP_PARTS_RAW, Units,
};

/// Three unit squares in a row along x, two triangles each: two planes that are one part, and a cylinder.
pub(crate) fn three_squares() -> Carrier {
    let kinds = [FaceType::Plane, FaceType::Plane, FaceType::Cylinder];
    let faces = (0u32..3)
        .zip(kinds)
        .map(|(face, kind)| square_face(face, kind))
        .collect();
    let edge = |face: u32, phi| Edge {
        faces: [face, face + 1],
        phi,
        length: 1.0,
    };
    let graph = FaceGraph {
        faces,
        edges: vec![edge(0, 2.0), edge(1, f64::NAN)],
    };
    let corner = |face: u32, [x, y]: [u32; 2]| [f64::from(face + x), f64::from(y), 0.0];
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    let mesh = Mesh {
        vertices: (0..3)
            .flat_map(|face| corners.map(|at| corner(face, at)))
            .collect(),
        vertex_face: (0..3).flat_map(|face| [face; 4]).collect(),
        triangles: (0..3)
            .flat_map(|face| [[0, 1, 2], [0, 2, 3]].map(|at| at.map(|x: u32| 4 * face + x)))
            .collect(),
        tri_face: (0..3).flat_map(|face| [face; 2]).collect(),
        vertex_normal: Vec::new(),
    };
    let meta = CarrierMeta {
        id: "squares".to_owned(),
        source_sha256: "00".to_owned(),
        theta_deg: 8.0,
        tau_min: 0,
        chord_mm: 0.01,
        angle_rad: 0.3,
        diagonal_mm: 3.2,
        units: Units::millimeters_and_radians(),
        lost: Vec::new(),
        notes: Vec::new(),
        instances: Vec::new(),
    };
    let parts = || LabelLayer::from(vec![0, 0, 1]);
    let layers = [(STEP_PARTS_RAW, parts()), (STEP_PARTS, parts())];
    Carrier::new(mesh, graph, layers, meta).unwrap()
}

fn square_face(face: u32, kind: FaceType) -> Face {
    Face::new(100 + u64::from(face), kind, 1.0)
}
