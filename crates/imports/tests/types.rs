//! Tests every type of import on a tetrahedron whose faces are the labels, with files that are in memory.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its fixture has failed"
)]

use partprobe_carrier::{
    Carrier, CarrierMeta, Face, FaceGraph, FaceType, LabelLayer, Mesh, NormalKind, Point,
    STEP_PARTS, STEP_PARTS_RAW, Units, keyed_rng, sample_by_area,
};
use partprobe_formats::{Array, PlyPoints, array_to_npy, points_to_ply};
use partprobe_imports::{ImportedSource, JoinedLabels, open_import};
use partprobe_sources::{FileError, LabelSource, PathKind, SourceContext, SourceFiles};
use std::collections::BTreeMap;
use std::sync::Arc;

const CORNERS: [Point; 4] = [
    [1.0, 1.0, 1.0],
    [5.0, 1.0, 1.0],
    [1.0, 4.0, 1.0],
    [1.0, 1.0, 3.0],
];
const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

#[derive(Clone, Debug, Default)]
struct Memory(BTreeMap<String, Vec<u8>>);

impl Memory {
    fn with(mut self, path: &str, bytes: impl Into<Vec<u8>>) -> Self {
        self.0.insert(path.to_owned(), bytes.into());
        self
    }
}

impl SourceFiles for Memory {
    fn kind(&self, path: &str) -> PathKind {
        if self.0.contains_key(path) {
            PathKind::File
        } else if self.0.keys().any(|file| file.starts_with(path)) {
            PathKind::Folder
        } else {
            PathKind::Missing
        }
    }

    fn read(&self, path: &str) -> Result<Vec<u8>, FileError> {
        let missing = || FileError {
            path: path.to_owned(),
            reason: "missing".to_owned(),
        };
        self.0.get(path).cloned().ok_or_else(missing)
    }

    fn list(&self, folder: &str) -> Result<Vec<String>, FileError> {
        let root = format!("{}/", folder.trim_end_matches('/'));
        Ok(self
            .0
            .keys()
            .filter_map(|file| file.strip_prefix(&root))
            .map(str::to_owned)
            .collect())
    }
}

/// The tetrahedron `data__solid`; each face is one triangle.
fn tetrahedron() -> Carrier {
    let face = |step_id| Face {
        step_id,
        face_type: FaceType::Plane,
        canonical_type: FaceType::Plane,
        area: 1.0,
        shell: 0,
        solid: None,
        instance: 0,
        name: None,
        color: None,
        layer: None,
    };
    let mesh = Mesh {
        vertices: CORNERS.to_vec(),
        vertex_face: vec![0; 4],
        triangles: TRIANGLES.to_vec(),
        tri_face: (0..4).collect(),
        vertex_normal: Vec::new(),
    };
    let meta = CarrierMeta {
        id: "data__solid".to_owned(),
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
    let graph = FaceGraph {
        faces: (0..4).map(|number| face(10 + number)).collect(),
        edges: Vec::new(),
    };
    let one_per_face: LabelLayer = (0..4).collect();
    let layers = [
        (STEP_PARTS_RAW, one_per_face.clone()),
        (STEP_PARTS, one_per_face),
    ];
    Carrier::new(mesh, graph, layers, meta).unwrap()
}

/// A text PLY of these triangles, with vertices moved by a function.
fn ply(triangles: &[[u32; 3]], moved: impl Fn(Point) -> Point) -> String {
    let vertices = CORNERS
        .map(|corner| moved(corner).map(|x| x.to_string()).join(" "))
        .join("\n");
    let faces: Vec<String> = triangles
        .iter()
        .map(|[a, b, c]| format!("3 {a} {b} {c}"))
        .collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n{vertices}\n{}\n",
        triangles.len(),
        faces.join("\n")
    )
}

fn join(import_type: &str, keys: &[(&str, &str)], files: Memory) -> Result<JoinedLabels, String> {
    let context = SourceContext::default().with_files(Arc::new(files));
    let context = keys
        .iter()
        .fold(context, |context, &(key, value)| context.with(key, value));
    let import = open_import(import_type, &context).map_err(|error| error.to_string())?;
    import
        .join(&tetrahedron())
        .map_err(|problem| problem.to_string())
}

#[track_caller]
fn check(import_type: &str, keys: &[(&str, &str)], files: Memory, by: &str, expected: &[i32]) {
    let joined = join(import_type, keys, files).unwrap();
    assert_eq!(joined.report.by, by);
    assert_eq!(joined.labels.of_triangles().of_triangle(), expected);
    assert!(joined.labels.origin().is_some());
}

#[track_caller]
fn check_refused(import_type: &str, keys: &[(&str, &str)], files: Memory, expected: &str) {
    let reason = join(import_type, keys, files).unwrap_err();
    assert!(reason.contains(expected), "{reason}");
}

const PATH: &[(&str, &str)] = &[("path", "labels")];

#[test]
fn faces_by_id_and_by_order() {
    let by_id = Memory::default().with(
        "labels/solid.json",
        r#"{"10": 3, "11": 3, "12": 0, "13": -1}"#,
    );
    check("faces", PATH, by_id, "step-id", &[1, 1, 0, -1]);
    let in_order = Memory::default().with("labels/solid.seg", "7\n8\n7\n9\n");
    check("faces", PATH, in_order, "order", &[0, 1, 0, 2]);
    let stranger = Memory::default().with("labels/other.seg", "7\n");
    check_refused("faces", PATH, stranger, "no labels for this shape");
    check_refused("faces", PATH, Memory::default(), "labels does not exist");
}

#[test]
fn a_damaged_line_is_named_where_it_matters() {
    let whole = r#"{"file": "solid.step", "labels": [0, 1, 0, 2]}"#;
    let other = r#"{"file": "other.step", "labels": [0]}"#;
    let path = &[("path", "labels.jsonl")][..];
    let lines = |lines: &[&str]| Memory::default().with("labels.jsonl", lines.join("\n"));
    check("faces", path, lines(&["{", whole]), "order", &[0, 1, 0, 2]);
    check_refused(
        "faces",
        path,
        lines(&[other, "{"]),
        "no labels for this shape, unless they are in labels.jsonl, line 2, which cannot be read: not JSON",
    );
    let without_labels = r#"{"file": "solid.step", "labels": 3}"#;
    check_refused(
        "faces",
        path,
        lines(&[other, without_labels]),
        "labels.jsonl, line 2: ",
    );
    check_refused("faces", path, lines(&[other]), "no labels for this shape");
    check_refused("faces", path, lines(&["{"]), "no line can be read; line 1");
}

#[test]
fn face_labels_are_constant_on_faces() {
    let files = Memory::default().with("labels/solid.seg", "7\n8\n7\n9\n");
    let with_points = files.clone().with("labels/solid.xyz", "1 1 1 0\n");
    for (import_type, expected) in [("faces", true), ("mesh", false), ("points", false)] {
        let context = SourceContext::default()
            .with_files(Arc::new(with_points.clone()))
            .with("path", "labels");
        let source = ImportedSource::new("mine", open_import(import_type, &context).unwrap());
        assert_eq!(source.labels_faces(), expected, "{import_type}");
    }
    let joined = join("faces", PATH, files).unwrap();
    assert!(joined.labels.of_faces().is_some());
}

#[test]
fn triangles_by_index_by_corners_and_by_the_nearest_surface() {
    let npy = |labels: &[i64]| array_to_npy(&Array::vector(labels.to_vec()));
    let alone = || Memory::default().with("labels/solid.npy", npy(&[29, 312, 29, -1]));
    check("mesh", PATH, alone(), "index", &[0, 1, 0, -1]);

    let order = [2, 0, 3, 1].map(|triangle: usize| TRIANGLES[triangle]);
    let with_mesh = [("path", "labels"), ("meshes", "meshes")];
    let files = || alone().with("meshes/solid.ply", ply(&order, |corner| corner));
    check("mesh", &with_mesh, files(), "triangle", &[1, -1, 0, 0]);
    let nearest = [
        ("path", "labels"),
        ("meshes", "meshes"),
        ("by", "nn-surface"),
    ];
    check("mesh", &nearest, files(), "nn-surface", &[1, -1, 0, 0]);
    let scaled = alone().with(
        "meshes/solid.ply",
        ply(&order, |corner| corner.map(|x| 10.0 * x)),
    );
    check_refused("mesh", &with_mesh, scaled, "moved, rotated or scaled");
    let few = Memory::default().with("labels/solid.npy", npy(&[1, 2]));
    check_refused(
        "mesh",
        PATH,
        few,
        "there are 2 labels, and the carrier has 4 triangles",
    );

    let p3_sam = Memory::default()
        .with(
            "labels/solid/auto_mask_mesh_final_face_ids.npy",
            npy(&[5, 6, 7, 8]),
        )
        .with(
            "labels/solid/auto_mask_mesh_face_ids.npy",
            npy(&[0, 0, 0, 0]),
        )
        .with(
            "labels/solid/auto_mask_mesh_final.ply",
            ply(&order, |corner| corner),
        );
    check("mesh", PATH, p3_sam, "triangle", &[1, 3, 0, 2]);
}

#[test]
fn points_by_the_nearest_one_whose_normal_agrees() {
    let carrier = tetrahedron();
    let sample = sample_by_area(
        carrier.mesh(),
        4000,
        NormalKind::Triangle,
        &mut keyed_rng(0, &[]),
    )
    .unwrap();
    let cloud = PlyPoints {
        points: sample.points,
        normals: sample.normals,
        parts: sample
            .triangles
            .iter()
            .map(|&triangle| triangle as i32)
            .collect(),
    };
    let files = || Memory::default().with("labels/solid.ply", points_to_ply(&cloud));
    check("points", PATH, files(), "nn-point", &[0, 1, 2, 3]);
    let inches = [("path", "labels"), ("factor", "25.4")];
    check_refused("points", &inches, files(), "moved, rotated or scaled");
}

/// PartField's clusters at two levels, on a mesh that was moved into a cube after a rotation.
fn partfield(rotated: impl Fn(Point) -> Point) -> Memory {
    let level = |labels: [i64; 4]| array_to_npy(&Array::vector(labels.to_vec()));
    let normalized = |[x, y, z]: Point| {
        let [x, y, z] = rotated([x - 3.0, y - 2.5, z - 2.0]);
        [x, y, z].map(|x| 0.45 * x)
    };
    Memory::default()
        .with("run/cluster_out/solid_0_02.npy", level([6, 6, 2, 6]))
        .with("run/cluster_out/solid_0_04.npy", level([6, 4, 2, 0]))
        .with(
            "run/features/input_solid_0.ply",
            ply(&TRIANGLES, normalized),
        )
        .with(
            "run/features/part_feat_solid_0_batch.npy",
            level([0, 0, 0, 0]),
        )
}

#[test]
fn partfield_by_level_in_the_pose_of_the_carrier() {
    let level = |k| [("path", "run"), ("k", k)];
    let same = |vertex: Point| vertex;
    check(
        "partfield",
        &level("max"),
        partfield(same),
        "triangle, level 4",
        &[3, 2, 1, 0],
    );
    check(
        "partfield",
        &level("2"),
        partfield(same),
        "triangle, level 2",
        &[1, 1, 0, 1],
    );
    // There are four STEP parts.
    check(
        "partfield",
        &level("match"),
        partfield(same),
        "triangle, level 4",
        &[3, 2, 1, 0],
    );
    check_refused(
        "partfield",
        &level("3"),
        partfield(same),
        "level 3 is missing; there are levels 2 to 4",
    );
    // The level with four labels is equal to the four STEP parts.
    check(
        "partfield",
        &level("best"),
        partfield(same),
        "triangle, level 4, optimistic: the best of 2 by the STEP parts",
        &[3, 2, 1, 0],
    );
    let joined = join("partfield", &level("best"), partfield(same)).unwrap();
    assert!(joined.labels.origin().unwrap().join.contains("optimistic"));
    check_refused("partfield", &level("all"), partfield(same), "`k` is `all`");

    let rotated = |[x, y, z]: Point| [y, z, x];
    check(
        "partfield",
        &level("max"),
        partfield(rotated),
        "triangle, level 4, rotated",
        &[3, 2, 1, 0],
    );
    let mirrored = |[x, y, z]: Point| [-x, y, z];
    check_refused(
        "partfield",
        &level("max"),
        partfield(mirrored),
        "in any rotation by right angles",
    );
}
