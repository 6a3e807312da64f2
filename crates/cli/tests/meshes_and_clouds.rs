//! Tests meshes and point clouds without any STEP file: labeled, inspected, exported, drawn, compared, trained on and scored.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

mod program;

use partprobe_formats::{Array, array_to_npy};
use program::{check, index, program};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Seconds, but every stage is there.
const TINY: &str = r#"
base = "base.toml"
[sample]
n_points = 400
[split]
train = 0.5
valid = 0.25
test = 0.25
[compare]
supervision = ["given", "normal-kmeans-20"]
references = ["given"]
[tokens]
train_tokens = 64
test_tokens = 96
[train]
steps = 4
batch_shapes = 2
valid_every = 2
[eval]
restarts = 3
bootstrap = 50
"#;

type Point = [f64; 3];

/// An axis-parallel block: its lowest and its highest corner.
struct Block([Point; 2]);

/// The labels of a table: its top, and its legs.
const LABELS: [u32; 5] = [12, 13, 13, 14, 14];

/// A top and four legs, with other proportions for each number.
fn table(number: u32) -> [Block; 5] {
    let n = f64::from(number);
    let [width, depth, height] = [4.0 + 0.3 * n, 3.0 + 0.17 * n * n, 2.0 + 0.41 * n];
    let thickness = 0.4 + 0.02 * n;
    let leg = |x: f64, y: f64| Block([[x, y, 0.0], [x + 0.5, y + 0.5, height]]);
    [
        Block([[0.0, 0.0, height], [width, depth, height + thickness]]),
        leg(0.0, 0.0),
        leg(width - 0.5, 0.0),
        leg(0.0, depth - 0.5),
        leg(width - 0.5, depth - 0.5),
    ]
}

impl Block {
    /// The four corners of each side, counter-clockwise seen from outside.
    fn sides(&self) -> Vec<[Point; 4]> {
        let Self([low, high]) = *self;
        let mut sides = Vec::new();
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for (level, is_high) in [(low, false), (high, true)] {
                let corner = |at_u: Point, at_v: Point| {
                    let mut corner = level;
                    corner[u] = at_u[u];
                    corner[v] = at_v[v];
                    corner
                };
                let mut side = [
                    corner(low, low),
                    corner(high, low),
                    corner(high, high),
                    corner(low, high),
                ];
                if !is_high {
                    side.reverse();
                }
                sides.push(side);
            }
        }
        sides
    }

    /// Points with normals on each side, on a grid of `n` by `n`.
    fn points(&self, n: u32) -> Vec<[Point; 2]> {
        let mut points = Vec::new();
        for (side, [a, b, _, d]) in self.sides().into_iter().enumerate() {
            let axis = side / 2;
            let mut normal = [0.0; 3];
            normal[axis] = if side % 2 == 0 { -1.0 } else { 1.0 };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let [s, t] = [i, j].map(|i| (f64::from(i) + 0.5) / f64::from(n));
                let at = |axis: usize| a[axis] + s * (b[axis] - a[axis]) + t * (d[axis] - a[axis]);
                points.push([[at(0), at(1), at(2)], normal]);
            }
        }
        points
    }
}

/// Quads, one group for each block.
fn obj(blocks: &[Block]) -> String {
    let (mut vertices, mut faces, mut n) = (String::new(), String::new(), 0);
    for (block, label) in blocks.iter().zip(LABELS) {
        writeln!(faces, "g label{label}").unwrap();
        for side in block.sides() {
            for [x, y, z] in side {
                writeln!(vertices, "v {x} {y} {z}").unwrap();
            }
            writeln!(faces, "f {} {} {} {}", n + 1, n + 2, n + 3, n + 4).unwrap();
            n += 4;
        }
    }
    vertices + &faces
}

/// The same with a label for each face.
fn ply(blocks: &[Block]) -> String {
    let sides = || {
        blocks
            .iter()
            .zip(LABELS)
            .flat_map(|(block, label)| block.sides().into_iter().map(move |side| (side, label)))
    };
    let n_faces = sides().count();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face {n_faces}\nproperty list uchar int vertex_indices\nproperty int label\nend_header\n",
        4 * n_faces
    );
    for [x, y, z] in sides().flat_map(|(side, _)| side) {
        writeln!(text, "{x} {y} {z}").unwrap();
    }
    for (face, (_, label)) in sides().enumerate() {
        let [a, b, c, d] = [0, 1, 2, 3].map(|corner| 4 * face + corner);
        writeln!(text, "4 {a} {b} {c} {d} {label}").unwrap();
    }
    text
}

/// The points of a table, and the label of each.
fn cloud(blocks: &[Block]) -> (Vec<[Point; 2]>, Vec<i64>) {
    let labeled = blocks.iter().zip(LABELS);
    labeled
        .flat_map(|(block, label)| {
            block
                .points(4)
                .into_iter()
                .map(move |point| (point, i64::from(label)))
        })
        .unzip()
}

fn rows_of_shapenet_part(blocks: &[Block]) -> String {
    let (points, labels) = cloud(blocks);
    let mut text = String::new();
    for ([[x, y, z], [u, v, w]], label) in points.iter().zip(labels) {
        writeln!(text, "{x:.6} {y:.6} {z:.6} {u} {v} {w} {label}.000000").unwrap();
    }
    text
}

fn write(path: &Path, bytes: impl AsRef<[u8]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

/// Trains on both sources, scores, and checks that every row of the scores is there.
#[track_caller]
fn check_run(folder: &Path, data: &str, n_test: usize) {
    write(&folder.join("tiny.toml"), TINY);
    let out = format!("run-{data}");
    check(
        folder,
        &["run", "tiny.toml", "--data", data, "--out", &out],
        0,
        "",
    );

    let scores = fs::read_to_string(folder.join(&out).join("scores.jsonl")).unwrap();
    let rows: Vec<serde_json::Value> = scores
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    for supervision in ["given", "normal-kmeans-20", "untrained", "no-network"] {
        let of_given: Vec<f64> = rows
            .iter()
            .filter(|row| row["supervision"] == supervision && row["reference"] == "given")
            .map(|row| row["miou"].as_f64().unwrap())
            .collect();
        assert_eq!(of_given.len(), n_test, "{supervision}: {scores}");
        assert!(
            of_given.iter().all(|miou| (0.05..=1.0).contains(miou)),
            "{supervision}: {of_given:?}"
        );
    }
}

#[test]
fn meshes_are_labeled_trained_on_and_scored() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for number in 0..6 {
        let blocks = table(number);
        write(&folder.join(format!("tables/a{number}.obj")), obj(&blocks));
        write(
            &folder.join(format!("tables/b{number}.ply")),
            ply(&table(number + 20)),
        );
    }
    check(folder, &["label", "tables", "--out", "meshes"], 0, "");
    let shapes = index(&folder.join("meshes"));
    assert_eq!(shapes.len(), 12);
    for shape in &shapes {
        assert_eq!(
            (&shape["status"], &shape["kind"]),
            (&"ok".into(), &"mesh".into())
        );
        assert_eq!(
            (&shape["n_labels"], &shape["n_triangles"]),
            (&3.into(), &60.into())
        );
    }

    // What the file says is what every command sees.
    let ids = ["meshes/tables__a1.npz", "meshes/tables__b2.npz"];
    check(folder, &["render", ids[0], "-o", "a1.png"], 0, "");
    check(folder, &["export", "obj", ids[0], "--out", "objs"], 0, "");
    check(
        folder,
        &[
            "sample", "meshes", "--out", "points", "--format", "npz", "--source", "given",
            "--source", "vsa-20",
        ],
        0,
        "",
    );
    check(
        folder,
        &[
            "sample",
            "meshes",
            "--out",
            "none",
            "--format",
            "npz",
            "--source",
            "brep-face",
        ],
        1,
        "the source `brep-face` needs a B-Rep, and this shape is a mesh without a B-Rep",
    );
    let table = check(
        folder,
        &[
            "compare",
            "given",
            "normal-kmeans-20",
            "--data",
            "meshes",
            "--points",
            "500",
        ],
        0,
        "",
    );
    assert!(table.contains("normal-kmeans-20"), "{table}");
    check(
        folder,
        &["sources", "given", "ward-20", "--data", "meshes"],
        0,
        "",
    );
    check_run(folder, "meshes", 3);
}

#[test]
fn clouds_are_labeled_trained_on_and_scored() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for number in 0..6 {
        let blocks = table(number);
        write(
            &folder.join(format!("tables/a{number}.txt")),
            rows_of_shapenet_part(&blocks),
        );
        let (points, labels) = cloud(&table(number + 20));
        let points: Vec<[f32; 3]> = points
            .iter()
            .map(|[point, _]| point.map(|x| x as f32))
            .collect();
        write(
            &folder.join(format!("tables/b{number}.npy")),
            array_to_npy(&Array::rows(&points)),
        );
        write(
            &folder.join(format!("tables/b{number}_labels.npy")),
            array_to_npy(&Array::vector(labels)),
        );
    }
    write(&folder.join("tables/README.txt"), "Tables with legs.\n");
    check(folder, &["label", "tables", "--out", "clouds"], 0, "");
    let shapes = index(&folder.join("clouds"));
    // One line counts README.txt; the files of labels are used, so that none is counted.
    let (unread, shapes): (Vec<_>, Vec<_>) =
        shapes.iter().partition(|line| line["status"] == "skipped");
    assert_eq!(unread.len(), 1, "{unread:?}");
    assert_eq!(unread[0]["n_skipped"], 1, "{unread:?}");
    assert_eq!(shapes.len(), 12);
    for shape in shapes {
        assert_eq!(
            (&shape["status"], &shape["kind"]),
            (&"ok".into(), &"cloud".into())
        );
        assert_eq!(shape["n_labels"], 3);
        let has_normals = shape["id"].as_str().unwrap().contains("__a");
        let notes = shape["notes"].to_string();
        assert_eq!(notes.contains("estimated"), !has_normals, "{notes}");
    }

    check(
        folder,
        &["render", "clouds/tables__a1.npz", "-o", "a1.png"],
        0,
        "",
    );
    check(
        folder,
        &[
            "sample", "clouds", "--out", "points", "--format", "ply", "--source", "given",
        ],
        0,
        "",
    );
    check(
        folder,
        &[
            "sample", "clouds", "--out", "none", "--format", "npz", "--source", "sdf-5",
        ],
        1,
        "the source `sdf-5` needs a surface of triangles, and this shape is a point cloud",
    );
    check(
        folder,
        &["compare", "given", "normal-kmeans-20", "--data", "clouds"],
        0,
        "",
    );
    check_run(folder, "clouds", 3);
}

#[test]
fn damage_is_a_line_of_the_index_and_the_rest_is_labeled() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write(&folder.join("d/good.obj"), obj(&table(1)));
    write(&folder.join("d/bad.obj"), "v 0 0 0\nf 1 x 1\n");
    write(&folder.join("d/few.obj"), obj(&table(2)));
    write(&folder.join("d/few.seg"), "1\n2\n");
    write(
        &folder.join("d/flat.obj"),
        "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n",
    );
    let output = program(folder, &["label", "d", "--out", "data"])
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!message.contains("panicked"), "{message}");
    let reason = |id: &str| {
        let shapes = index(&folder.join("data"));
        let shape = shapes.iter().find(|shape| shape["id"] == id).unwrap();
        shape["reason"].as_str().unwrap_or_default().to_owned()
    };
    assert_eq!(reason("d__good"), "");
    assert_eq!(reason("d__bad"), "line 2: `f 1 x 1` can't be understood");
    assert_eq!(
        reason("d__few"),
        "few.seg: there are 2 labels, and the shape has 60 triangles"
    );
    assert_eq!(
        reason("d__flat"),
        "it has no extent: no triangle has an area"
    );

    // Edited labels are noticed: the shape is labeled again.
    write(&folder.join("d/few.seg"), "1\n".repeat(60));
    let arguments = ["label", "d", "--out", "data", "--resume"];
    let output = program(folder, &arguments).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("d/few.obj is labeled again"), "{message}");
    assert_eq!(reason("d__few"), "");
}

#[test]
fn meshes_next_to_step_files_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let step = partprobe_synth::fixtures::cuboid([3.0, 2.0, 1.0]);
    write(&folder.join("both/a.step"), step);
    write(&folder.join("both/a.obj"), obj(&table(1)));
    check(folder, &["label", "both", "--out", "data"], 0, "");
    let lines = index(&folder.join("data"));
    let sources: Vec<&str> = lines
        .iter()
        .map(|line| line["source"].as_str().unwrap())
        .collect();
    assert_eq!(sources, ["both/*.obj", "both/a.step"]);
    check(
        folder,
        &["label", "both/a.step", "both/a.obj", "--out", "two"],
        0,
        "",
    );
    let lines = index(&folder.join("two"));
    let reason = lines
        .iter()
        .find_map(|line| line["reason"].as_str())
        .unwrap();
    assert!(reason.contains("in a call of their own"), "{reason}");
    // Alone, the mesh is read.
    check(folder, &["label", "both/a.obj", "--out", "mesh"], 0, "");
    assert_eq!(index(&folder.join("mesh"))[0]["kind"], "mesh");
}
