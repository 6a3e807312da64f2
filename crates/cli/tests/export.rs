//! Tests `export` and `check`: the same bytes for any number of threads, labels that survive every format, and folders in
//! which something is wrong.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;

use folder::contents;
use partprobe_carrier::Carrier;
use partprobe_formats::{
    Array, Values, array_from_npy, array_to_npy, arrays_from_npz, carrier_from_npz,
};
use partprobe_synth::{SynthSettings, part};
use partprobe_tables::{Columns, ShapeLabels, Text, labels_of_table, table_from_parquet};
use serde_json::Value;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;

const FORMATS: [&str; 9] = [
    "glb",
    "ply",
    "obj",
    "parts",
    "brepnet",
    "pointcept",
    "partfield-input",
    "parquet",
    "webdataset",
];
const SHAPE: &str = "steps__p1";

/// Runs the program in a folder and expects this exit code; stdout or stderr must contain the text.
#[track_caller]
fn check(folder: &Path, arguments: &str, code: i32, text: &str) -> String {
    let words = arguments.split_whitespace();
    let output = Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .args(words)
        .current_dir(folder)
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    let stdout = String::from_utf8(output.stdout).unwrap();
    assert_eq!(output.status.code(), Some(code), "{arguments}: {stderr}");
    assert!(!stderr.contains("panicked"), "{arguments}: {stderr}");
    assert!(
        stderr.contains(text) || stdout.contains(text),
        "{arguments}: `{text}` is not in {stdout}{stderr}"
    );
    stdout
}

/// `steps/` with five parts and a file that is none, and the data set `d/`.
fn labeled_parts() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let steps = folder.path().join("steps");
    fs::create_dir(&steps).unwrap();
    let settings = SynthSettings {
        seed: 3,
        min_parts: 2,
        max_parts: 12,
    };
    for index in 0..5 {
        fs::write(
            steps.join(format!("p{index}.step")),
            part(&settings, index).step,
        )
        .unwrap();
    }
    fs::write(steps.join("bad.step"), "hello").unwrap();
    check(folder.path(), "label steps --out d", 0, "");
    folder
}

fn carrier(folder: &Path) -> Carrier {
    carrier_from_npz(&fs::read(folder.join(format!("d/{SHAPE}.npz"))).unwrap()).unwrap()
}

fn integers(path: &Path) -> Vec<i64> {
    fs::read_to_string(path)
        .unwrap()
        .lines()
        .map(|line| line.parse().unwrap())
        .collect()
}

fn lines(path: &Path) -> Vec<Value> {
    fs::read_to_string(path)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

#[test]
fn threads_and_inputs_do_not_change_the_bytes() {
    let folder = labeled_parts();
    let path = folder.path();
    for format in FORMATS {
        let points = if format == "pointcept" {
            "--points 200"
        } else {
            ""
        };
        check(
            path,
            &format!("export {format} d --out {format}-1 --jobs 1 {points}"),
            0,
            "1 failed",
        );
        check(
            path,
            &format!("export {format} d --out {format}-3 --jobs 3 {points}"),
            0,
            "5 shapes",
        );
        let expected = contents(&path.join(format!("{format}-1")));
        assert_eq!(
            contents(&path.join(format!("{format}-3"))),
            expected,
            "{format}"
        );
        assert!(
            expected.contains_key(Path::new("export.json"))
                && expected.contains_key(Path::new("shapes.jsonl"))
        );
        // STEP files are labeled on the way, and nothing of that stays.
        check(
            path,
            &format!("export {format} steps --out {format}-steps {points}"),
            0,
            "warning: steps__bad",
        );
        assert_eq!(
            contents(&path.join(format!("{format}-steps"))),
            expected,
            "{format}"
        );
    }
}

#[test]
fn every_format_is_replaced_by_force_and_other_files_are_not() {
    let folder = labeled_parts();
    let path = folder.path();
    let exports =
        FORMATS
            .into_iter()
            .chain(["parts --as obj", "brepnet --as csv", "obj --vertices split"]);
    for (number, format) in exports.enumerate() {
        let points = if format == "pointcept" {
            "--points 200"
        } else {
            ""
        };
        let export = format!("export {format} d --out {number} {points} --force");
        check(path, &export, 0, "5 shapes");
        let expected = contents(&path.join(number.to_string()));
        check(path, &export, 0, "5 shapes");
        assert_eq!(
            contents(&path.join(number.to_string())),
            expected,
            "{format}"
        );

        for own in ["thesis.tex", "train.py"] {
            fs::write(path.join(format!("{number}/{own}")), "mine").unwrap();
            check(path, &export, 2, own);
            fs::remove_file(path.join(format!("{number}/{own}"))).unwrap();
        }
    }
}

#[test]
fn a_triangle_keeps_its_label_in_obj_and_parts() {
    let folder = labeled_parts();
    let (path, carrier) = (folder.path(), carrier(folder.path()));
    let faces: Vec<i64> = carrier
        .mesh()
        .tri_face
        .iter()
        .map(|&face| i64::from(face))
        .collect();
    for (label, of_faces) in [
        ("part", carrier.part_of_face()),
        ("raw-part", carrier.raw_part_of_face()),
    ] {
        check(
            path,
            &format!("export obj d/{SHAPE}.npz --out {label} --label {label}"),
            0,
            "1 shape in 3 files",
        );
        let expected: Vec<i64> = faces
            .iter()
            .map(|&face| i64::from(of_faces[face as usize]))
            .collect();
        assert_eq!(
            integers(&path.join(format!("{label}/{SHAPE}.seg"))),
            expected
        );
        assert_eq!(integers(&path.join(format!("{label}/{SHAPE}.fidx"))), faces);
    }
    check(path, "export parts d --out parts --as obj", 0, "");
    let list: Value =
        serde_json::from_slice(&fs::read(path.join(format!("parts/{SHAPE}/parts.json"))).unwrap())
            .unwrap();
    let parts = list["parts"].as_array().unwrap();
    assert_eq!(parts.len(), carrier.n_parts());
    let mut n_triangles = 0;
    for (label, part) in parts.iter().enumerate() {
        assert_eq!(part["file"], format!("part_{label:04}.obj"));
        let mesh =
            fs::read_to_string(path.join(format!("parts/{SHAPE}/part_{label:04}.obj"))).unwrap();
        n_triangles += mesh.lines().filter(|line| line.starts_with("f ")).count();
        for face in part["faces"].as_array().unwrap() {
            assert_eq!(
                carrier.part_of_face()[face.as_u64().unwrap() as usize],
                label as i32
            );
        }
    }
    assert_eq!(n_triangles, faces.len());
}

#[test]
fn faces_are_in_the_order_of_the_file() {
    let folder = labeled_parts();
    let (path, carrier) = (folder.path(), carrier(folder.path()));
    let rows = &carrier.graph().faces;
    check(
        path,
        "export brepnet d --out b --label type",
        0,
        "5 shapes in 10 files",
    );
    let types: Vec<i64> = rows
        .iter()
        .map(|face| i64::from(face.face_type.code()))
        .collect();
    assert_eq!(integers(&path.join(format!("b/{SHAPE}.seg"))), types);
    let graph: Value =
        serde_json::from_slice(&fs::read(path.join(format!("b/{SHAPE}.graph.json"))).unwrap())
            .unwrap();
    let ids: Vec<u64> = rows.iter().map(|face| face.step_id).collect();
    assert_eq!(graph["faces"]["step_id"], serde_json::json!(ids));
    assert_eq!(
        graph["edges"]["faces"].as_array().unwrap().len(),
        carrier.graph().edges.len()
    );
    check(
        path,
        "export brepnet d --out csv --as csv",
        0,
        "5 shapes in 15 files",
    );
    let edges = fs::read_to_string(path.join(format!("csv/{SHAPE}.edges.csv"))).unwrap();
    assert_eq!(edges.lines().count(), 1 + carrier.graph().edges.len());
}

#[test]
fn colors_follow_the_label_and_ids_do_not() {
    let folder = labeled_parts();
    let (path, carrier) = (folder.path(), carrier(folder.path()));
    let document = |label: &str| -> Value {
        check(
            path,
            &format!("export glb d --out {label} --label {label}"),
            0,
            "",
        );
        let bytes = fs::read(path.join(format!("{label}/{SHAPE}.glb"))).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    };
    let by_part = document("part");
    assert_eq!(
        by_part["nodes"][0]["extras"]["face_part"],
        serde_json::json!(carrier.part_of_face())
    );
    let names = by_part["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|node| &node["name"]);
    assert!(names.clone().any(|name| name == "part 0") && names.count() > 2);
    assert_eq!(by_part, document("type"));
    check(path, "export glb d --out one --nodes one", 0, "");
    let bytes = |label: &str| fs::read(path.join(format!("{label}/{SHAPE}.glb"))).unwrap();
    assert_ne!(bytes("part"), bytes("type"));
}

#[test]
fn points_know_class_and_instance() {
    let folder = labeled_parts();
    let path = folder.path();
    check(
        path,
        "export pointcept d --out pc --points 300 --split 0.4/0.3/0.3 --seed 5",
        0,
        "left out",
    );
    check(path, "check pointcept pc", 0, " 0 problems");
    for (file, tester) in [
        ("insseg.py", "InsSegTester"),
        ("semseg.py", "SemSegTester"),
        ("README.md", "tools/train.py"),
    ] {
        let text = fs::read_to_string(path.join("pc").join(file)).unwrap();
        assert!(text.contains(tester), "{file}");
    }
    let split: Value =
        serde_json::from_slice(&fs::read(path.join("pc/split.json")).unwrap()).unwrap();
    for line in lines(&path.join("pc/shapes.jsonl"))
        .iter()
        .filter(|line| line["reason"].is_null())
    {
        let (id, side) = (
            line["id"].as_str().unwrap(),
            line["split"].as_str().unwrap(),
        );
        assert!(split[side].as_array().unwrap().contains(&line["id"]));
        let carrier =
            carrier_from_npz(&fs::read(path.join(format!("d/{id}.npz"))).unwrap()).unwrap();
        let instance =
            array_from_npy(&fs::read(path.join(format!("pc/{side}/{id}/instance.npy"))).unwrap())
                .unwrap();
        let Values::I32(instance) = instance.values() else {
            panic!("instance is int32")
        };
        assert_eq!(instance.len(), 300);
        assert!(*instance.iter().max().unwrap() < carrier.n_parts() as i32);
    }
    assert!(
        fs::read_to_string(path.join("pc/pointcept_data.py"))
            .unwrap()
            .contains("DefaultDataset")
    );
    check(
        path,
        "export pointcept d --out many --points 10 --min-parts 999",
        1,
        "no shape is left",
    );
    check(
        path,
        "export pointcept d --out odd --split 1/2",
        2,
        "three shares",
    );
    check(
        path,
        "export pointcept d --out odd --min-parts 3 --max-parts 2",
        2,
        "--max-parts is below",
    );
}

#[test]
fn tables_have_a_row_per_shape_and_the_labels_of_the_carriers() {
    let folder = labeled_parts();
    let path = folder.path();
    check(path, "label steps --out e --layers smooth-12", 0, "");
    check(
        path,
        "export parquet e --out t --shard-size 2",
        0,
        "5 shapes in 3 files, 1 failed",
    );
    let mut ids = Vec::new();
    for number in 0..3 {
        let bytes = fs::read(path.join(format!("t/part-{number:05}.parquet"))).unwrap();
        let mut table = table_from_parquet(bytes, Columns::All).unwrap().table;
        let of_file = table.take_cells::<Text>("id").unwrap();
        let units = table.take_cells::<Text>("unit").unwrap();
        assert!(units.iter().all(|unit| unit.as_deref() == Some("file")));
        for (id, labels) in of_file.into_iter().zip(labels_of_table(table).unwrap()) {
            let id = id.unwrap();
            let bytes = fs::read(path.join(format!("e/{id}.npz"))).unwrap();
            let carrier = carrier_from_npz(&bytes).unwrap();
            assert_eq!(labels, Some(ShapeLabels::of(&carrier)), "{id}");
            ids.push(id.into_owned());
        }
    }
    assert_eq!(
        ids,
        (0..5).map(|n| format!("steps__p{n}")).collect::<Vec<_>>()
    );
    let shapes = lines(&path.join("t/shapes.jsonl"));
    assert_eq!(shapes[4]["files"][0], "part-00002.parquet");
}

#[test]
fn samples_are_sorted_and_contain_the_requested_content() {
    let folder = labeled_parts();
    let path = folder.path();
    for (content, member) in [
        ("carrier", "triangles"),
        ("labels", "face_label"),
        ("points", "points"),
    ] {
        check(
            path,
            &format!(
                "export webdataset d --out {content} --content {content} --points 50 --shard-size 3"
            ),
            0,
            "5 shapes in 2 files",
        );
        let mut names = Vec::new();
        for number in 0..2 {
            let file =
                fs::File::open(path.join(format!("{content}/shapes-{number:06}.tar"))).unwrap();
            for entry in tar::Archive::new(file).entries().unwrap() {
                let mut entry = entry.unwrap();
                let name = entry.path().unwrap().display().to_string();
                let mut bytes = Vec::new();
                entry.read_to_end(&mut bytes).unwrap();
                if name.ends_with(".npz") {
                    let arrays = arrays_from_npz(&bytes).unwrap();
                    assert!(arrays.array(member).is_some(), "{content}");
                } else {
                    let facts: Value = serde_json::from_slice(&bytes).unwrap();
                    assert_eq!(format!("{}.json", facts["id"].as_str().unwrap()), name);
                }
                names.push(name);
            }
        }
        let expected = (0..5).flat_map(|n| ["npz", "json"].map(|e| format!("steps__p{n}.{e}")));
        assert_eq!(names, expected.collect::<Vec<_>>());
    }
}

#[test]
fn a_damaged_pointcept_folder_is_described() {
    let folder = labeled_parts();
    let path = folder.path();
    check(
        path,
        "export pointcept d --out pc --points 50 --split 0.6/0.2/0.2",
        0,
        "",
    );
    let shapes = |side: &str| -> Vec<PathBuf> {
        let mut shapes: Vec<PathBuf> = fs::read_dir(path.join("pc").join(side))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        shapes.sort();
        shapes
    };
    let copy = |from: &Path, to: &Path| {
        fs::create_dir(to).unwrap();
        fs::read_dir(from)
            .unwrap()
            .map(Result::unwrap)
            .for_each(|file| {
                fs::copy(file.path(), to.join(file.file_name())).unwrap();
            });
    };
    let (first, val) = (shapes("train").remove(0), shapes("val").remove(0));
    copy(&val, &path.join("pc/test/copy"));
    copy(&val, &path.join("pc/test").join(val.file_name().unwrap()));
    fs::write(
        first.join("instance.npy"),
        array_to_npy(&Array::vector(vec![0i32, 2])),
    )
    .unwrap();
    fs::remove_file(first.join("coord.npy")).unwrap();
    fs::write(path.join("pc/train/notes.txt"), "").unwrap();
    let found = check(
        path,
        "check pointcept pc --jobs 2",
        1,
        "is not ready for Pointcept",
    );
    let name = val.file_name().unwrap().to_string_lossy();
    for expected in [
        "coord.npy is missing",
        "instance.npy: no point has id 1, but ids go up to 2",
        "train/notes.txt: not a folder",
        &format!("test/copy: the same points as val/{name}"),
        &format!("test/{name}: also in val"),
    ] {
        assert!(found.contains(expected), "`{expected}` is not in {found}");
    }
    fs::remove_dir_all(&first).unwrap();
    check(
        path,
        "check pointcept pc",
        1,
        "listed in shapes.jsonl, but not there",
    );
    check(
        path,
        "check pointcept steps",
        2,
        "has no shape in train, val or test",
    );
}

#[test]
fn a_damaged_carrier_does_not_stop_the_others() {
    let folder = labeled_parts();
    let path = folder.path();
    fs::write(path.join("d/steps__p0.npz"), b"PK").unwrap();
    for format in FORMATS {
        check(
            path,
            &format!("export {format} d --out {format}"),
            1,
            "1 carrier cannot be used",
        );
        let reasons: Vec<Value> = lines(&path.join(format!("{format}/shapes.jsonl")));
        let reason = reasons
            .iter()
            .find(|line| line["id"] == "steps__p0")
            .unwrap()["reason"]
            .as_str()
            .unwrap()
            .to_owned();
        assert!(reason.contains("not a readable NPZ archive"), "{reason}");
    }
    check(
        path,
        "export ply d/steps__p0.npz --out alone",
        1,
        "no shape could be written; the lines above say why",
    );
}

#[test]
fn impossible_requests_are_refused_and_leave_no_files() {
    let folder = labeled_parts();
    let path = folder.path();
    fs::create_dir(path.join("empty")).unwrap();
    for (arguments, text) in [
        ("export glb empty --out o", "there is no .step"),
        ("export glb gone --out o", "gone does not exist"),
        ("export glb gone.npz --out o", "gone.npz does not exist"),
        ("export stl d --out o", "unrecognized subcommand"),
        (
            "export glb d --out o --set label.tau_min=0",
            "labeled already",
        ),
        (
            "export glb steps --out o --set label.nothing=0",
            "unknown field `nothing`",
        ),
        ("export glb d steps --out o", "two shapes have the id"),
    ] {
        check(path, arguments, 2, text);
        assert!(!path.join("o").exists(), "{arguments}");
    }
    let twice = "d is given 2 times and is read once";
    check(path, "export ply d d --out o", 0, twice);
    check(path, "export glb d --out o", 2, "is not empty");
    check(path, "export glb d --out d", 2, "is not empty");
    check(path, "export glb d --out d --force", 2, "lies in --out");
    check(
        path,
        "export glb steps --out d --force",
        2,
        "holds no export.json",
    );
    // An export that finds no shape keeps the former one.
    let before = contents(&path.join("o"));
    fs::write(path.join("text.step"), "no STEP text").unwrap();
    check(path, "export glb text.step --out o --force", 1, "");
    assert_eq!(contents(&path.join("o")), before);
    check(path, "export glb d --out o --force", 0, "");
    assert!(
        contents(&path.join("o"))
            .keys()
            .all(|file| file.extension().unwrap() != "ply")
    );
}
