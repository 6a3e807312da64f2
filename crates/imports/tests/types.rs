//! Tests every type of import on a tetrahedron whose faces are the labels, with files that are in memory.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot build its fixture has failed"
)]

use partprobe_carrier::{
    Carrier, CarrierMeta, Face, FaceGraph, FaceType, LabelLayer, Mesh, NormalKind, Point,
    PointSample, STEP_PARTS, STEP_PARTS_RAW, Units, keyed_rng, sample_by_area,
};
use partprobe_formats::{
    Array, PartFieldLimits, PartFieldMap, PartFieldMesh, PartFieldShape, PlyPoints, array_to_npy,
    points_to_ply,
};
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

/// A text PLY of these triangles of the tetrahedron, with vertices moved by a function.
fn ply(triangles: &[[u32; 3]], moved: impl Fn(Point) -> Point) -> String {
    ply_of(&CORNERS.map(moved), triangles)
}

fn ply_of(vertices: &[Point], triangles: &[[u32; 3]]) -> String {
    let vertex_lines: Vec<String> = vertices
        .iter()
        .map(|vertex| vertex.map(|x| x.to_string()).join(" "))
        .collect();
    let faces: Vec<String> = triangles
        .iter()
        .map(|[a, b, c]| format!("3 {a} {b} {c}"))
        .collect();
    format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n{}\n{}\n",
        vertices.len(),
        triangles.len(),
        vertex_lines.join("\n"),
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
        "no labels are named after this shape; they may be in labels.jsonl, line 2, which cannot be read: not JSON",
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

/// A text PLY of the tetrahedron with these columns per triangle.
fn marked_ply(properties: &str, columns: [&str; 4]) -> String {
    let plain = ply(&TRIANGLES, |corner| corner);
    let (head, body) = plain.split_once("end_header\n").unwrap();
    let lines: Vec<&str> = body.lines().collect();
    let faces = lines[4..].iter().zip(columns);
    let faces: Vec<String> = faces
        .map(|(face, columns)| format!("{face} {columns}"))
        .collect();
    let vertices = lines[..4].join("\n");
    format!(
        "{head}{properties}end_header\n{vertices}\n{}\n",
        faces.join("\n")
    )
}

#[test]
fn triangles_by_the_labels_in_a_mesh_file() {
    let in_file = |name: &str, text: String| Memory::default().with(name, text);
    let label = marked_ply("property int label\n", ["4", "4", "2", "-1"]);
    let files = || in_file("labels/solid.ply", label.clone());
    check("mesh", PATH, files(), "triangle, label", &[1, 1, 0, -1]);
    let by_index = [("path", "labels"), ("by", "index")];
    check("mesh", &by_index, files(), "index, label", &[1, 1, 0, -1]);
    let nearest = [("path", "labels"), ("by", "nn-surface")];
    check(
        "mesh",
        &nearest,
        files(),
        "nn-surface, label",
        &[1, 1, 0, -1],
    );

    let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let colored = marked_ply(colors, ["9 0 0", "0 9 0", "9 0 0", "0 0 0"]);
    let files = || in_file("labels/solid.ply", colored.clone());
    check(
        "mesh",
        PATH,
        files(),
        "triangle, face-color",
        &[0, 1, 0, -1],
    );
    let all_colors = [("path", "labels"), ("unlabeled_color", "none")];
    check(
        "mesh",
        &all_colors,
        files(),
        "triangle, face-color",
        &[0, 1, 0, 2],
    );
    let by_label = [("path", "labels"), ("labels_from", "label")];
    check_refused(
        "mesh",
        &by_label,
        files(),
        "labels/solid.ply: there is no `label` in the file, which has face-color",
    );

    let vertices = CORNERS.map(|corner| format!("v {}", corner.map(|x| x.to_string()).join(" ")));
    let obj = format!(
        "{}\ng a\nf 1 3 2\ng b\nf 1 2 4\nf 2 3 4\ng a\nf 3 1 4\n",
        vertices.join("\n")
    );
    let files = || in_file("labels/solid.obj", obj.clone());
    check("mesh", PATH, files(), "triangle, group", &[0, 1, 1, 0]);
    let damaged = in_file("labels/solid.obj", obj.replace("f 1 3 2", "f 1 3 9"));
    check_refused(
        "mesh",
        PATH,
        damaged,
        "labels/solid.obj: a face names vertex 8, but there are only 4",
    );
}

#[test]
fn a_mesh_next_to_its_labels_holds_none() {
    let npy = array_to_npy(&Array::vector(vec![5i64, 6, 7, 7]));
    let label = marked_ply("property int label\n", ["4", "4", "2", "-1"]);
    let files = || {
        Memory::default()
            .with("labels/a/solid.npy", npy.clone())
            .with("labels/b/solid.ply", label.clone())
    };
    check("mesh", PATH, files(), "index", &[0, 1, 2, 2]);
    let with_mesh = [("path", "labels/a"), ("meshes", "labels/b")];
    check("mesh", &with_mesh, files(), "triangle", &[0, 1, 2, 2]);
}

/// A glTF document of the tetrahedron: one node per face, in meters with y up, and its buffer.
fn gltf() -> (String, Vec<u8>) {
    let meters = |[x, y, z]: Point| [x, z, -y].map(|x| (0.001 * x) as f32);
    let mut buffer: Vec<u8> = CORNERS
        .iter()
        .flat_map(|&corner| meters(corner))
        .flat_map(f32::to_le_bytes)
        .collect();
    buffer.extend(TRIANGLES.as_flattened().iter().map(|&corner| corner as u8));
    let list = |item: &dyn Fn(usize) -> String| (0..4).map(item).collect::<Vec<_>>().join(",");
    let nodes = list(&|face| format!(r#"{{"mesh":{face}}}"#));
    let meshes = list(&|face| {
        format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":{}}}]}}"#,
            face + 1
        )
    });
    let accessors = list(&|face| {
        format!(
            r#"{{"bufferView":1,"byteOffset":{},"componentType":5121,"count":3,"type":"SCALAR"}}"#,
            3 * face
        )
    });
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{nodes}],"meshes":[{meshes}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},{accessors}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}],
        "buffers":[{{"uri":"solid.bin","byteLength":60}}]}}"#
    );
    (text, buffer)
}

#[test]
fn triangles_by_the_nodes_of_a_scene() {
    let (text, buffer) = gltf();
    let files = || Memory::default().with("labels/solid.gltf", text.clone());
    let way = "triangle, node, from meters with y up";
    let whole = files().with("labels/solid.bin", buffer);
    check("mesh", PATH, whole, way, &[0, 1, 2, 3]);
    check_refused(
        "mesh",
        PATH,
        files(),
        "labels/solid.gltf: buffer 0 cannot be read: labels/solid.bin: missing",
    );
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

/// Points of the tetrahedron with the number of their triangle: positions, normals and labels.
#[cfg(feature = "hdf5")]
fn labeled_points() -> (Vec<f32>, Vec<f32>, Vec<i32>) {
    let mut rng = keyed_rng(0, &[]);
    let sample =
        sample_by_area(tetrahedron().mesh(), 2000, NormalKind::Triangle, &mut rng).unwrap();
    let labels = sample.triangles.iter().map(|&triangle| triangle as i32);
    let labels = labels.collect();
    let flat = |rows: &[[f32; 3]]| rows.as_flattened().to_vec();
    (flat(&sample.points), flat(&sample.normals), labels)
}

/// An HDF5 file of arrays with these names, numbers and lengths, in packed chunks.
#[cfg(feature = "hdf5")]
fn hdf5(arrays: &[(&str, &[f32], &[u64])]) -> Vec<u8> {
    let mut builder = hdf5_pure::FileBuilder::new();
    for (name, numbers, shape) in arrays {
        let chunks: Vec<u64> = shape.iter().map(|&length| length.min(700)).collect();
        builder
            .create_dataset(name)
            .with_f32_data(numbers)
            .with_shape(shape)
            .with_chunks(&chunks)
            .with_deflate(4);
    }
    builder.finish().unwrap()
}

#[cfg(feature = "hdf5")]
#[test]
fn points_of_hdf5_by_shape_and_by_row() {
    let (points, normals, labels) = labeled_points();
    let labels: Vec<f32> = labels.into_iter().map(|label| label as f32).collect();
    let zeros = vec![0.0; points.len()];
    let one_shape = |name: &str| {
        hdf5(&[
            ("points", &points, &[2000, 3]),
            ("normals", &normals, &[2000, 3]),
            (name, &labels, &[2000]),
        ])
    };
    let files = |name| Memory::default().with("labels/solid.h5", one_shape(name));
    check("points", PATH, files("labels"), "nn-point", &[0, 1, 2, 3]);
    check("points", PATH, files("seg_id"), "nn-point", &[0, 1, 2, 3]);
    let by_name = [("path", "labels"), ("labels_from", "prim")];
    check("points", &by_name, files("prim"), "nn-point", &[0, 1, 2, 3]);
    check_refused(
        "points",
        &by_name,
        files("labels"),
        "labels/solid.h5: there is no array `prim` in the file, which has labels, normals, points",
    );
    check_refused(
        "points",
        PATH,
        files("prim"),
        "the file holds positions only, and no labels",
    );

    let rows = |first: &[f32], second: &[f32]| [first, second].concat();
    let many = hdf5(&[
        ("points", &rows(&zeros, &points), &[2, 2000, 3]),
        ("normals", &rows(&zeros, &normals), &[2, 2000, 3]),
        ("labels", &rows(&zeros[..2000], &labels), &[2, 2000]),
    ]);
    let predicted = hdf5(&[("seg_id", &rows(&zeros[..2000], &labels), &[2, 2000])]);
    let files = || {
        Memory::default()
            .with("test_data.h5", many.clone())
            .with("predictions.h5", predicted.clone())
            .with("ids.txt", "other\nsolid\n")
    };
    let data = [("path", "test_data.h5"), ("ids", "ids.txt")];
    check("points", &data, files(), "nn-point", &[0, 1, 2, 3]);
    let joined = join("points", &data, files()).unwrap();
    assert_eq!(joined.report.entries, ["test_data.h5, row 1 (solid)"]);
    let predictions = [
        ("path", "predictions.h5"),
        ("points", "test_data.h5"),
        ("ids", "ids.txt"),
    ];
    check("points", &predictions, files(), "nn-point", &[0, 1, 2, 3]);
    let alone = [("path", "predictions.h5"), ("ids", "ids.txt")];
    check_refused(
        "points",
        &alone,
        files(),
        "predictions.h5, row 1 (solid): the file holds labels only; give the positions with the key `points`",
    );
    check_refused(
        "points",
        &data,
        files().with("ids.txt", "solid\n"),
        "test_data.h5: the file has 2 shapes, and `ids` has 1 names; give the list that belongs to it",
    );
    let in_folder = Memory::default().with("labels/solid.h5", many.clone());
    check_refused(
        "points",
        PATH,
        in_folder,
        "as in a file of 2 shapes; give this file as the path, and a list of the names of its shapes with the key `ids`",
    );
    let damaged = Memory::default().with("labels/solid.h5", &many[..many.len() / 2]);
    check_refused("points", PATH, damaged, "labels/solid.h5: ");
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

/// The export of the tetrahedron for PartField, with a different label for each triangle of the mesh.
///
/// PartField's mesh is the exported one, moved into the cube in single precision, after `changed`.
fn partfield_by_map(changed: impl Fn(&mut PartFieldMesh)) -> (PartFieldMesh, Memory) {
    let limits = PartFieldLimits {
        max_edge: 0.2,
        max_triangles: 1000,
    };
    let exported = PartFieldMesh::new(tetrahedron().mesh(), &limits).unwrap();
    let shape = PartFieldShape {
        id: "data__solid".to_owned(),
        source: "data/solid.step".to_owned(),
        mesh: "meshes/data-solid.obj".to_owned(),
        parents: "parents/data-solid.npy".to_owned(),
        n_triangles: exported.triangles.len(),
        center: exported.center,
        scale: exported.scale,
    };
    let shapes = BTreeMap::from([("data-solid".to_owned(), shape)]);
    let map = PartFieldMap::new(limits.max_edge, shapes);

    let mut made = exported.clone();
    changed(&mut made);
    let normalized = |vertex: &Point| {
        let in_cube = |axis: usize| (vertex[axis] - exported.center[axis]) * exported.scale;
        [0, 1, 2].map(|axis| f64::from(in_cube(axis) as f32))
    };
    let vertices: Vec<Point> = made.vertices.iter().map(normalized).collect();
    let labels: Vec<i64> = (0..).take(made.triangles.len()).collect();
    let files = Memory::default()
        .with("pf/map.json", serde_json::to_vec(&map).unwrap())
        .with(
            "pf/parents/data-solid.npy",
            array_to_npy(&Array::vector(exported.parent)),
        )
        .with(
            "run/cluster_out/data-solid_0_20.npy",
            array_to_npy(&Array::vector(labels)),
        )
        .with(
            "run/input_data-solid_0.ply",
            ply_of(&vertices, &made.triangles),
        );
    (made, files)
}

#[test]
fn partfield_by_the_map_of_an_export() {
    let keys = [("path", "run"), ("map", "pf")];
    let (made, files) = partfield_by_map(|_| ());
    let joined = join("partfield", &keys, files.clone()).unwrap();
    assert_eq!(joined.report.by, "index, level 20");
    assert_eq!(joined.report.entries, ["cluster_out/data-solid_0_20.npy"]);

    // A point in the middle of each small triangle has its label.
    let middle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|vertex| made.vertices[vertex as usize]);
        [0, 1, 2].map(|axis| ((a[axis] + b[axis] + c[axis]) / 3.0) as f32)
    };
    let sample = PointSample {
        points: made.triangles.iter().map(middle).collect(),
        triangles: made.parent.clone(),
        ..PointSample::default()
    };
    let expected: Vec<i32> = (0..).take(made.triangles.len()).collect();
    assert_eq!(joined.labels.label_of_points(&sample), Ok(expected));

    // Without the map, the name is not that of the shape.
    check_refused("partfield", &keys[..1], files, "no labels for this shape");
    let elsewhere = [("path", "run"), ("map", "run")];
    check_refused(
        "partfield",
        &elsewhere,
        partfield_by_map(|_| ()).1,
        "run/map.json",
    );
}

#[test]
fn another_mesh_than_the_exported_one_is_joined_by_position() {
    let keys = [("path", "run"), ("map", "pf")];
    let joined_by = |changed: fn(&mut PartFieldMesh)| {
        let (_, files) = partfield_by_map(changed);
        join("partfield", &keys, files).map(|joined| joined.report.by)
    };
    let n_exported = partfield_by_map(|_| ()).0.triangles.len();
    let fewer = format!(
        "nn-surface, level 20 (not by the map: the mesh has {} triangles, and the exported one has {n_exported})",
        n_exported - 1
    );
    assert_eq!(joined_by(|made| _ = made.triangles.pop()), Ok(fewer));
    let mixed = joined_by(|made| made.triangles.reverse()).unwrap();
    assert!(
        mixed.starts_with("nn-surface, level 20 (not by the map: triangle 0 of"),
        "{mixed}"
    );
    let other = joined_by(|made| made.vertices.iter_mut().for_each(|vertex| vertex[0] *= 2.0));
    assert!(
        other
            .unwrap_err()
            .contains("is not the surface of this shape")
    );
}

proptest::proptest! {
    #[test]
    fn no_bytes_make_an_import_panic(body: Vec<u8>, ending in proptest::sample::select(&[
        "npy", "json", "txt", "seg", "ply", "obj", "glb", "gltf", "h5", "csv", "xyz",
    ][..])) {
        let files = Memory::default().with(&format!("labels/solid.{ending}"), body);
        for import_type in ["faces", "mesh", "points"] {
            let _ = join(import_type, PATH, files.clone());
        }
    }
}
