//! Tests imported labels in the real program: they are checked, sampled, trained on, and missed if they change.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot run the program has failed"
)]

mod program;

use partprobe_formats::{
    Array, LabeledMesh, Values, array_from_npy, array_to_npy, arrays_from_npz, mesh_from_obj,
    mesh_to_ply,
};
use program::{check, index};
use std::fs;
use std::path::Path;

/// A data set `data` of generated parts, and `labels` with a file per part: each face is a label, by its STEP id.
fn labeled_parts(n: usize) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let count = n.to_string();
    check(
        root,
        &["synth", "--out", "parts", "-n", &count, "--max-parts", "8"],
        0,
        "",
    );
    check(root, &["label", "parts", "--out", "data"], 0, "");
    fs::create_dir(root.join("labels")).unwrap();
    for entry in index(&root.join("data")) {
        let labels: serde_json::Map<String, serde_json::Value> = (0..)
            .zip(face_ids(root, &entry))
            .map(|(number, id)| (id.to_string(), serde_json::Value::from(number)))
            .collect();
        let text = serde_json::Value::Object(labels).to_string();
        fs::write(label_file(root, &entry, "json"), text).unwrap();
    }
    folder
}

fn face_ids(root: &Path, entry: &serde_json::Value) -> Vec<u64> {
    let bytes = fs::read(root.join("data").join(entry["file"].as_str().unwrap())).unwrap();
    arrays_from_npz(&bytes)
        .unwrap()
        .vector("face_step_id")
        .unwrap()
}

fn label_file(root: &Path, entry: &serde_json::Value, extension: &str) -> std::path::PathBuf {
    let source = entry["source"].as_str().unwrap();
    let stem = Path::new(source).file_stem().unwrap();
    root.join("labels").join(stem).with_extension(extension)
}

#[test]
fn labels_are_checked_before_anything_is_trained() {
    let folder = labeled_parts(3);
    let root = folder.path();
    let table = check(
        root,
        &["check", "labels", "labels", "--data", "data"],
        0,
        "",
    );
    assert!(
        table.starts_with("faces: 3 of 3 shapes have labels\n\n| labels | shapes |\n|---|---:|\n| joined by step-id | 3 |"),
        "{table}"
    );

    let entries = index(&root.join("data"));
    fs::remove_file(label_file(root, &entries[0], "json")).unwrap();
    fs::remove_file(label_file(root, &entries[1], "json")).unwrap();
    fs::write(label_file(root, &entries[1], "seg"), "0\n1\n").unwrap();
    fs::write(root.join("labels/stranger.seg"), "0\n").unwrap();
    let arguments = ["check", "labels", "labels", "--data", "data", "--json"];
    let json = check(root, &arguments, 1, "not every label could be joined");
    let checked: serde_json::Value = serde_json::from_str(&json).unwrap();
    let statuses: Vec<&str> = checked[0]["shapes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|shape| shape["status"].as_str().unwrap())
        .collect();
    assert_eq!(statuses, ["without-labels", "refused", "whole"]);
    let reason = checked[0]["shapes"][1]["reason"].as_str().unwrap();
    assert!(
        reason.starts_with("there are 2 labels in order, and the shape has"),
        "{reason}"
    );
    // The file of the refused shape is its own.
    assert_eq!(checked[0]["unused"], serde_json::json!(["stranger.seg"]));
}

#[test]
fn labels_that_seem_to_be_classes_are_reported() {
    let folder = labeled_parts(2);
    let root = folder.path();
    let hint = "a label whose faces are not connected; if the labels are classes";
    let table = |more: &[&str]| {
        let arguments = ["check", "labels", "labels", "--data", "data"];
        check(root, &[&arguments[..], more].concat(), 0, "")
    };
    assert!(!table(&[]).contains(hint), "each face is a label");

    // Two faces that do not touch are of one class, and all other faces have labels of their own.
    for entry in index(&root.join("data")) {
        let ids = face_ids(root, &entry);
        let carrier = fs::read(root.join("data").join(entry["file"].as_str().unwrap())).unwrap();
        let members = arrays_from_npz(&carrier).unwrap();
        let Values::U32(edges) = members.array("edge_faces").unwrap().values().clone() else {
            panic!("edges are pairs of face indices");
        };
        let touches = |face: u32| {
            edges
                .chunks(2)
                .any(|edge| [[0, face], [face, 0]].iter().any(|pair| edge == pair))
        };
        let far = (1..ids.len() as u32).find(|&face| !touches(face)).unwrap();
        let labels: serde_json::Map<String, serde_json::Value> = (0..)
            .zip(&ids)
            .map(|(number, id)| {
                let label = if number == far { 0 } else { number };
                (id.to_string(), serde_json::Value::from(label))
            })
            .collect();
        let text = serde_json::Value::Object(labels).to_string();
        fs::write(label_file(root, &entry, "json"), text).unwrap();
    }
    assert!(table(&[]).contains(&format!("2 shapes have {hint}")));
    let instances = ["--type", "faces", "--set", "instances=true"];
    assert!(!table(&instances).contains(hint));
}

#[test]
fn labels_that_match_no_shape_are_reported() {
    let folder = labeled_parts(1);
    let root = folder.path();
    fs::create_dir(root.join("empty")).unwrap();
    fs::create_dir(root.join("others")).unwrap();
    fs::write(root.join("others/stranger.seg"), "0\n").unwrap();
    fs::create_dir(root.join("notes")).unwrap();
    fs::write(root.join("notes/readme.md"), "").unwrap();
    let labels = |path: &str, more: &[&str], code: i32, error: &str| {
        let arguments = ["check", "labels", path, "--data", "data"];
        check(root, &[&arguments[..], more].concat(), code, error)
    };
    let missing = "nowhere does not exist; give a folder with a label file for each shape";
    labels("nowhere", &[], 2, missing);
    labels("nowhere", &["--type", "faces"], 2, missing);
    let empty = "the folder empty is empty; put a label file for each shape into it";
    labels("empty", &["--type", "mesh"], 2, empty);
    let other = "the file readme.md in notes does not hold labels of this type";
    labels("notes", &["--type", "points"], 2, other);

    let failed = "not every label could be joined";
    assert!(labels("empty", &[], 1, failed).contains(empty));
    let hint = "no label file is named like a shape: the first label file is stranger.seg, and the first shape is ";
    for more in [&[][..], &["--type", "faces"]] {
        let table = labels("others", more, 1, failed);
        assert!(table.contains(hint), "{table}");
    }
}

#[test]
fn exported_meshes_bring_their_parts_back() {
    let folder = labeled_parts(2);
    let root = folder.path();
    for (format, way) in [
        ("ply", "triangle, part"),
        ("glb", "triangle, part, from meters with y up"),
    ] {
        check(root, &["export", format, "data", "--out", format], 0, "");
        let arguments = [
            "check", "labels", format, "--data", "data", "--type", "mesh",
        ];
        let table = check(root, &arguments, 0, "");
        assert!(table.contains(&format!("joined by {way} ")), "{table}");
        assert!(table.contains("| each labeled | 2 |"), "{table}");
    }
}

#[test]
fn imported_labels_are_a_source_like_any_other() {
    let folder = labeled_parts(2);
    let root = folder.path();
    let sample = |out: &str, more: &[&str], code: i32, error: &str| {
        let arguments = [
            "sample",
            "data",
            "--out",
            out,
            "--format",
            "npz",
            "--n-points",
            "200",
        ];
        check(root, &[&arguments[..], more].concat(), code, error);
    };
    let mine = [
        "--set",
        "sources.mine.path=labels",
        "--set",
        "sources.mine.type=faces",
    ];
    let named = [&mine[..], &["--source", "mine", "--source", "brep-face"]].concat();
    sample("points", &named, 0, "");
    for entry in index(&root.join("data")) {
        let id = entry["id"].as_str().unwrap();
        let bytes = fs::read(root.join(format!("points/{id}.npz"))).unwrap();
        let arrays = arrays_from_npz(&bytes).unwrap();
        let labels = |name: &str| arrays.array(name).unwrap().clone();
        assert_eq!(labels("label_mine"), labels("label_brep-face"));
    }

    let table = check(root, &[&["sources"], &mine[..]].concat(), 0, "");
    assert!(table.contains("\n| mine |"), "{table}");
    sample(
        "a",
        &["--source", "mine"],
        2,
        "`mine` is not a label source",
    );
    sample(
        "b",
        &[&mine[..], &["--source", "other"]].concat(),
        2,
        ", mine",
    );
    let layers = ["label", "parts", "--out", "layers", "--layers", "mine"];
    let error = "label.layers names `mine`, whose labels are imported; a layer is computed by a built-in source";
    check(root, &[&layers[..], &mine[..]].concat(), 2, error);
    for (setting, error) in [
        ("sources.mine.colum=3", "type `faces` has no key `colum`"),
        (
            "sources.mine.type=meshes",
            "`meshes` is not a type of label file",
        ),
        (
            "sources.mine.by=luck",
            "`by` is `luck`; it must be one of auto, step-id",
        ),
        ("sources.mine.path=nowhere", "nowhere does not exist"),
        (
            "sources.ward-20.type=faces",
            "the name of a built-in label source",
        ),
        ("sources.My.type=faces", "a name consists of"),
        (
            "sources.mine.k=best",
            "choose a name with `optimistic` in it, for example `mine-optimistic`",
        ),
    ] {
        let more = [&mine[..], &["--set", setting, "--source", "mine"]].concat();
        sample("c", &more, 2, error);
    }
}

#[test]
fn a_run_trains_on_imported_labels_and_notices_that_they_change() {
    let folder = labeled_parts(12);
    let root = folder.path();
    let entries = index(&root.join("data"));
    fs::remove_file(label_file(root, &entries[0], "json")).unwrap();
    let config = r#"
base = "base.toml"
[sources.mine]
type = "faces"
path = "labels"
[compare]
supervision = ["mine"]
references = ["step-parts"]
[sample]
n_points = 600
[split]
train = 0.5
valid = 0.25
test = 0.25
[tokens]
train_tokens = 48
test_tokens = 64
[train]
steps = 2
batch_shapes = 2
valid_every = 0
[eval]
restarts = 1
bootstrap = 20
"#;
    fs::write(root.join("mine.toml"), config).unwrap();
    let run = ["run", "mine.toml", "--data", "data", "--out", "run"];
    check(
        root,
        &run,
        0,
        "1 left out: `mine`: no labels for this shape",
    );
    // The run can be scored and repeated from another folder, and resumed with the relative paths of earlier versions.
    let run_path = root.join("run");
    let run_path = run_path.to_str().unwrap();
    let elsewhere = root.join("labels");
    check(&elsewhere, &["eval", run_path], 0, "");
    let repeated = check(&elsewhere, &["rerun", run_path, "--out", "../again"], 0, "");
    assert!(repeated.contains(", 0 of them differ"), "{repeated}");
    let config_file = root.join("run/config.toml");
    let stored = fs::read_to_string(&config_file).unwrap();
    let relative = stored.replace(&format!("{}/labels", root.display()), "labels");
    assert_ne!(relative, stored);
    fs::write(&config_file, relative).unwrap();
    check(root, &[&run[..], &["--resume"]].concat(), 0, "");
    let split = fs::read_to_string(root.join("run/split.json")).unwrap();
    assert!(split.contains("\"imported\""), "{split}");

    // The labels may be elsewhere, as long as they are the same.
    fs::rename(root.join("labels"), root.join("moved")).unwrap();
    let moved = ["--resume", "--set", "sources.mine.path=moved"];
    check(root, &[&run[..], &moved].concat(), 0, "");
    let split: serde_json::Value = serde_json::from_str(&split).unwrap();
    let id = split["train"][0].as_str().unwrap();
    let entry = entries.iter().find(|entry| entry["id"] == id).unwrap();
    let name = label_file(root, entry, "json");
    let changed = root.join("moved").join(name.file_name().unwrap());
    let text = fs::read_to_string(&changed)
        .unwrap()
        .replacen(":0", ":1", 1);
    fs::write(&changed, text).unwrap();
    let error = "its labels by `mine` are not those that this run was split with";
    check(root, &[&run[..], &moved].concat(), 1, error);
}

/// The labels of a sample by two sources.
fn both_labels(root: &Path, out: &str, id: &str) -> [Vec<i32>; 2] {
    let bytes = fs::read(root.join(format!("{out}/{id}.npz"))).unwrap();
    let mut arrays = arrays_from_npz(&bytes).unwrap();
    ["label_mine", "label_brep-face"].map(|name| arrays.vector(name).unwrap())
}

#[test]
fn labels_of_triangles_find_their_triangles() {
    let folder = labeled_parts(2);
    let root = folder.path();
    fs::create_dir(root.join("triangles")).unwrap();
    let entries = index(&root.join("data"));
    for entry in &entries {
        let bytes = fs::read(root.join("data").join(entry["file"].as_str().unwrap())).unwrap();
        let faces: Vec<u32> = arrays_from_npz(&bytes).unwrap().vector("tri_face").unwrap();
        let stem = label_file(root, entry, "npy");
        let path = root.join("triangles").join(stem.file_name().unwrap());
        fs::write(path, array_to_npy(&Array::vector(faces))).unwrap();
    }
    check(root, &["export", "ply", "data", "--out", "exported"], 0, "");

    let type_mesh = [
        "--set",
        "sources.mine.type=mesh",
        "--set",
        "sources.mine.path=triangles",
    ];
    let with_meshes = ["--set", "sources.mine.meshes=exported"];
    for (out, more, least) in [
        ("index", &[][..], 1.0),
        ("triangle", &["--set", "sources.mine.by=triangle"][..], 1.0),
        // Points are stored in single precision: a few points near an edge are nearer to its other side.
        (
            "nn-surface",
            &["--set", "sources.mine.by=nn-surface"][..],
            0.99,
        ),
    ] {
        let meshes = if out == "index" {
            &[][..]
        } else {
            &with_meshes
        };
        let arguments = [
            "sample",
            "data",
            "--out",
            out,
            "--format",
            "npz",
            "--n-points",
            "2000",
        ];
        let sources = ["--source", "mine", "--source", "brep-face"];
        check(
            root,
            &[&arguments[..], &type_mesh, meshes, more, &sources].concat(),
            0,
            "",
        );
        for entry in &entries {
            let [mine, faces] = both_labels(root, out, entry["id"].as_str().unwrap());
            let n_equal = mine
                .iter()
                .zip(&faces)
                .filter(|(mine, face)| mine == face)
                .count();
            assert!(
                n_equal as f64 >= least * mine.len() as f64,
                "{out}: {n_equal}"
            );
        }
    }

    let arguments = [
        "check",
        "labels",
        "triangles",
        "--data",
        "data",
        "--type",
        "mesh",
    ];
    let table = check(root, &arguments, 0, "");
    assert!(
        table.starts_with("mesh: 2 of 2 shapes have labels\n\n| labels | shapes |\n|---|---:|\n| joined by index |"),
        "{table}"
    );
    let moved = ["--set", "meshes=moved"];
    fs::create_dir(root.join("moved")).unwrap();
    for entry in &entries {
        let name = label_file(root, entry, "off");
        let cube = "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 2\n";
        fs::write(root.join("moved").join(name.file_name().unwrap()), cube).unwrap();
    }
    let table = check(root, &[&arguments[..], &moved].concat(), 1, "");
    assert!(
        table.contains("labels, and their mesh has 1 triangles"),
        "{table}"
    );
}

#[test]
fn a_damaged_line_is_named_and_the_others_are_used() {
    let folder = labeled_parts(3);
    let root = folder.path();
    let mut lines: Vec<String> = index(&root.join("data"))
        .iter()
        .map(|entry| {
            let faces = fs::read_to_string(label_file(root, entry, "json")).unwrap();
            format!("{{\"file\": {}, \"faces\": {faces}}}", entry["source"])
        })
        .collect();
    lines[1].truncate(20);
    fs::write(root.join("all.jsonl"), lines.join("\n")).unwrap();
    let arguments = ["check", "labels", "all.jsonl", "--data", "data"];
    let table = check(root, &arguments, 1, "not every label could be joined");
    assert!(
        table.starts_with("faces: 2 of 3 shapes have labels"),
        "{table}"
    );
    let reason = "they may be in all.jsonl, line 2, which cannot be read: not JSON";
    assert!(table.contains(reason), "{table}");
}

/// What PartField writes for a shape of an export: its mesh in the cube, and a label per triangle at one level.
fn write_partfield_results(root: &Path, name: &str, shape: &serde_json::Value, labels: Vec<i64>) {
    let obj = fs::read(root.join("pf").join(shape["mesh"].as_str().unwrap())).unwrap();
    let mut mesh = mesh_from_obj(&obj).unwrap();
    let scale = shape["scale"].as_f64().unwrap();
    for vertex in &mut mesh.vertices {
        for (axis, x) in vertex.iter_mut().enumerate() {
            *x = (*x - shape["center"][axis].as_f64().unwrap()) * scale;
        }
    }
    let n_triangles = mesh.triangles.len();
    assert_eq!(shape["n_triangles"], n_triangles);
    let labeled = LabeledMesh {
        vertices: mesh.vertices,
        triangles: mesh.triangles,
        face: vec![0; n_triangles],
        part: vec![0; n_triangles],
        face_type: vec![0; n_triangles],
        color: vec![[0; 3]; n_triangles],
        ..LabeledMesh::default()
    };
    let results = root.join("results");
    fs::create_dir_all(results.join("cluster_out")).unwrap();
    fs::write(
        results.join(format!("input_{name}_0.ply")),
        mesh_to_ply(&labeled),
    )
    .unwrap();
    fs::write(
        results.join(format!("cluster_out/{name}_0_07.npy")),
        array_to_npy(&Array::vector(labels)),
    )
    .unwrap();
}

#[test]
fn labels_of_exported_meshes_are_joined_by_index() {
    let folder = labeled_parts(3);
    let root = folder.path();
    let export = ["export", "partfield-input", "data", "--out", "pf"];
    let few = [&export[..], &["--max-triangles", "21"]].concat();
    check(
        root,
        &few,
        1,
        "it has more than 21 triangles if no edge is longer than",
    );
    check(
        root,
        &[&export[..], &["--force", "--max-edge", "3"]].concat(),
        2,
        "a fraction from 0.0001 to 1",
    );
    check(root, &[&export[..], &["--force"]].concat(), 0, "");

    let map = fs::read(root.join("pf/map.json")).unwrap();
    let map: serde_json::Value = serde_json::from_slice(&map).unwrap();
    let entries = index(&root.join("data"));
    for (name, shape) in map["shapes"].as_object().unwrap() {
        let is_own = |entry: &&serde_json::Value| entry["id"] == shape["id"];
        let entry = entries.iter().find(is_own).unwrap();
        let carrier = fs::read(root.join("data").join(entry["file"].as_str().unwrap())).unwrap();
        let mut carrier = arrays_from_npz(&carrier).unwrap();
        let face_of_triangle: Vec<u32> = carrier.vector("tri_face").unwrap();
        let parents = fs::read(root.join("pf").join(shape["parents"].as_str().unwrap())).unwrap();
        let Values::U32(parents) = array_from_npy(&parents).unwrap().into_values() else {
            panic!("parents are numbers of triangles");
        };
        let face = |&parent: &u32| i64::from(face_of_triangle[parent as usize]);
        write_partfield_results(root, name, shape, parents.iter().map(face).collect());
    }

    let check_labels = ["check", "labels", "results", "--data", "data"];
    let by_map = ["--type", "partfield", "--set", "map=pf"];
    let table = check(root, &[&check_labels[..], &by_map].concat(), 0, "");
    assert!(
        table.contains("3 of 3 shapes have labels\n\n| labels | shapes |\n|---|---:|\n| joined by index, level 7 |"),
        "{table}"
    );
    assert!(table.contains("| labels of other shapes | 0 |"), "{table}");

    let sample = [
        "sample",
        "data",
        "--out",
        "points",
        "--format",
        "npz",
        "--n-points",
        "2000",
    ];
    let mine = [
        "--set",
        "sources.mine.type=partfield",
        "--set",
        "sources.mine.path=results",
        "--set",
        "sources.mine.map=pf",
    ];
    let sources = ["--source", "mine", "--source", "brep-face"];
    check(root, &[&sample[..], &mine, &sources].concat(), 0, "");
    for entry in &entries {
        let [mine, faces] = both_labels(root, "points", entry["id"].as_str().unwrap());
        assert_eq!(mine, faces);
    }
}

#[test]
fn a_model_that_cannot_be_run_is_refused_by_name() {
    let folder = labeled_parts(1);
    let root = folder.path();
    fs::write(root.join("model.onnx"), "not a model").unwrap();
    let sample = [
        "sample", "data", "--out", "points", "--format", "npz", "--source", "net",
    ];
    let model = [
        "--set",
        "sources.net.type=onnx",
        "--set",
        "sources.net.path=model.onnx",
    ];
    for (setting, error) in [
        (
            "sources.net.runtime=/nowhere/libonnxruntime.so",
            "sources.net: `runtime` /nowhere/libonnxruntime.so cannot be used: ",
        ),
        ("sources.net.path=nowhere.onnx", "nowhere.onnx"),
        (
            "sources.net.cluster=dbscan",
            "`cluster` is `dbscan`; it must be one of ward, ward-faces, k-means",
        ),
        ("sources.net.input=x", "type `onnx` has no key `input`"),
    ] {
        let arguments = [&sample[..], &model, &["--set", setting]].concat();
        check(root, &arguments, 2, error);
    }
}
