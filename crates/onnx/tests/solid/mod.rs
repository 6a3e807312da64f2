//! Makes a box with six faces, and the files that a source reads.

use partprobe_carrier::{
    Carrier, CarrierMeta, Edge, Face, FaceGraph, FaceType, LabelLayer, Mesh, Point, STEP_PARTS,
    STEP_PARTS_RAW, Units,
};
use partprobe_imports::JoinedLabels;
use partprobe_sources::SourceContext;

/// The lengths of the box, in millimeters.
const SIZE: Point = [20.0, 14.0, 9.0];

/// The two triangles of each side of the box; each side is a face and a part of its own.
pub(crate) fn box_carrier() -> Carrier {
    let mut mesh = Mesh {
        vertices: Vec::new(),
        vertex_face: Vec::new(),
        triangles: Vec::new(),
        tri_face: Vec::new(),
        vertex_normal: Vec::new(),
    };
    for face in 0..6u32 {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners(face));
        mesh.vertex_face.extend([face; 4]);
        let triangles = [[0, 1, 2], [0, 2, 3]];
        mesh.triangles
            .extend(triangles.map(|corners| corners.map(|at| first + at)));
        mesh.tri_face.extend([face; 2]);
    }
    let edges = (0..6).flat_map(|a| (a + 1..6).map(move |b| [a, b]));
    let graph = FaceGraph {
        faces: (0..6)
            .map(|face| Face::new(10 + face, FaceType::Plane, 1.0))
            .collect(),
        edges: edges
            .filter(|[a, b]| a / 2 != b / 2)
            .map(|faces| Edge {
                faces,
                phi: 90.0,
                length: 1.0,
            })
            .collect(),
    };
    let meta = CarrierMeta {
        id: "box".to_owned(),
        source_sha256: String::new(),
        theta_deg: 8.0,
        tau_min: 0,
        chord_mm: 0.01,
        angle_rad: 0.3,
        diagonal_mm: mesh.diagonal(),
        units: Units::millimeters_and_radians(),
        lost: Vec::new(),
        notes: Vec::new(),
        instances: Vec::new(),
    };
    let parts: LabelLayer = (0..6).collect();
    let layers = [(STEP_PARTS_RAW, parts.clone()), (STEP_PARTS, parts)];
    Carrier::new(mesh, graph, layers, meta).unwrap()
}

/// The corners of a face, counterclockwise from outside: faces 0 and 1 are those across x, 2 and 3 across y.
fn corners(face: u32) -> [Point; 4] {
    let axis = (face / 2) as usize;
    let is_upper = face % 2 == 1;
    let corner = |u: bool, v: bool| {
        let mut point = [0.0; 3];
        let length = |is_far: bool, axis: usize| if is_far { SIZE[axis] } else { 0.0 };
        point[axis] = length(is_upper, axis);
        point[(axis + 1) % 3] = length(u, (axis + 1) % 3);
        point[(axis + 2) % 3] = length(v, (axis + 2) % 3);
        point
    };
    let mut corners = [
        corner(false, false),
        corner(true, false),
        corner(true, true),
        corner(false, true),
    ];
    if !is_upper {
        corners.reverse();
    }
    corners
}

/// A context with these keys.
pub(crate) fn context(keys: &[(&str, &str)]) -> SourceContext {
    keys.iter()
        .fold(SourceContext::default(), |context, &(key, value)| {
            context.with(key, value)
        })
}

/// The label of each face, if both of its triangles have the same one.
#[track_caller]
pub(crate) fn face_labels(joined: &JoinedLabels) -> Vec<i32> {
    let of_triangle = joined.labels.of_triangles().of_triangle();
    let pairs = of_triangle.chunks_exact(2);
    pairs
        .map(|pair| {
            assert_eq!(pair[0], pair[1], "{of_triangle:?}");
            pair[0]
        })
        .collect()
}
