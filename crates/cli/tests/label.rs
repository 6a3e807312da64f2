//! Tests how the real program labels files: batches with bad files, the same bytes for any number of workers, and the
//! messages for people and programs.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_formats::{arrays_from_npz, carrier_from_npz, points_from_ply, sample_from_npz};
use partprobe_synth::{SynthSettings, fixtures, part};
use program::{check, index};
use std::collections::BTreeSet;
use std::fs;

const HEADER: &str = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
                      FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n";
const TRAILER: &str = "ENDSEC;\nEND-ISO-10303-21;\n";

fn step(data: &str) -> Vec<u8> {
    format!("{HEADER}{data}{TRAILER}").into_bytes()
}

/// Files that hold no shape, each bad in its own way.
fn bad_files() -> Vec<(&'static str, Vec<u8>)> {
    let solid = "#1=MANIFOLD_SOLID_BREP('',#2);\n#2=CLOSED_SHELL('',(#3));\n";
    let nested = format!(
        "#1=MANIFOLD_SOLID_BREP('',{}#2{});\n",
        "(".repeat(300_000),
        ")".repeat(300_000)
    );
    vec![
        ("empty", Vec::new()),
        (
            "truncated",
            part(&settings(), 0).step.as_bytes()[..2_000].to_vec(),
        ),
        (
            "binary",
            (0..5_000u32)
                .map(|x| (x.wrapping_mul(2_654_435_761) >> 13) as u8)
                .collect(),
        ),
        ("text", b"hello".to_vec()),
        ("missing", step("#1=MANIFOLD_SOLID_BREP('',#2);\n")),
        ("wrong", step("#1=MANIFOLD_SOLID_BREP('',#1);\n")),
        (
            "cyclic",
            step(&format!(
                "{solid}#3=ADVANCED_FACE('',(#4),#5,.T.);\n#4=FACE_BOUND('',#4,.T.);\n#5=OFFSET_SURFACE('',#5,1.,.F.);\n"
            )),
        ),
        (
            "nan",
            step(&format!(
                "{solid}#3=ADVANCED_FACE('',(),#5,.T.);\n#5=SPHERICAL_SURFACE('',#6,NaN);\n\
                 #6=AXIS2_PLACEMENT_3D('',#7,$,$);\n#7=CARTESIAN_POINT('',(1.E999,0.,0.));\n"
            )),
        ),
        (
            "huge",
            step(&format!(
                "{solid}#3=ADVANCED_FACE('',(),#5,.T.);\n#5=B_SPLINE_SURFACE_WITH_KNOTS('',3,3,((#7,#7),(#7,#7)),.UNSPECIFIED.,\
                 .F.,.F.,.F.,(1000000000,1000000000),(1000000000,1000000000),(0.,1.),(0.,1.),.UNSPECIFIED.);\n\
                 #7=CARTESIAN_POINT('',(0.,0.,0.));\n"
            )),
        ),
        ("nested", step(&nested)),
    ]
}

fn settings() -> SynthSettings {
    SynthSettings {
        seed: 3,
        min_parts: 2,
        max_parts: 12,
    }
}

/// A folder with good parts and bad files.
fn mixed_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let steps = folder.path().join("steps");
    fs::create_dir_all(steps.join("bad")).unwrap();
    for index in 0..6 {
        fs::write(
            steps.join(format!("part{index}.stp")),
            part(&settings(), index).step,
        )
        .unwrap();
    }
    for (name, bytes) in bad_files() {
        fs::write(steps.join("bad").join(format!("{name}.step")), bytes).unwrap();
    }
    folder
}

#[test]
fn a_batch_survives_its_bad_files_and_its_bytes_do_not_depend_on_the_workers() {
    let folder = mixed_folder();
    let path = folder.path();
    let summary = check(
        path,
        &["label", "steps", "--out", "one", "--jobs", "1"],
        0,
        "",
    );
    assert!(
        summary.contains("files: 16\nwithout a carrier: 10\n"),
        "{summary}"
    );
    check(
        path,
        &["label", "steps", "--out", "two", "--jobs", "2"],
        0,
        "",
    );
    assert_eq!(contents(&path.join("one")), contents(&path.join("two")));
    let rows = index(&path.join("one"));
    assert_eq!(rows.len(), 16);
    assert!(
        rows.iter()
            .filter(|row| row["status"] == "failed")
            .all(|row| row["reason"]
                .as_str()
                .is_some_and(|reason| reason.len() > 10))
    );
    for (index, row) in (0..).zip(rows.iter().filter(|row| row["status"] == "ok")) {
        let made = part(&settings(), index);
        let carrier = carrier_from_npz(
            &fs::read(path.join("one").join(row["file"].as_str().unwrap())).unwrap(),
        )
        .unwrap();
        assert_eq!(row["id"], format!("steps__part{index}"));
        assert_eq!(carrier.meta().id, format!("steps__part{index}"));
        assert_eq!(row["n_parts"], made.n_parts);
        assert_eq!(
            carrier.raw_part_of_face(),
            made.face_parts
                .iter()
                .map(|&part| part as i32)
                .collect::<Vec<_>>()
        );
    }
}

#[test]
fn further_layers_are_members_of_the_carriers_and_change_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let block = fixtures::cuboid([3.0, 2.0, 1.0]);
    fs::write(path.join("part.step"), block).unwrap();
    check(path, &["label", "part.step", "--out", "plain"], 0, "");
    let layers = ["--layers", "brep-face,color"];
    let label = [&["label", "part.step", "--out", "layered"], &layers[..]].concat();
    check(path, &label, 0, "");

    let carrier = |name: &str| fs::read(path.join(name).join("part.npz")).unwrap();
    let (plain, layered) = (carrier("plain"), carrier("layered"));
    let [before, after] = [&plain, &layered].map(|bytes| arrays_from_npz(bytes).unwrap());
    let new: Vec<&str> = after
        .names()
        .filter(|name| before.array(name).is_none())
        .collect();
    assert_eq!(new, ["face_label_brep-face"]);
    let changed: Vec<&str> = before
        .names()
        .filter(|name| before.array(name) != after.array(name))
        .collect();
    assert_eq!(changed, ["content_hash", "meta"]);

    let read = carrier_from_npz(&layered).unwrap();
    let faces = read.layer("brep-face").unwrap().of_face();
    assert_eq!(faces, [0, 1, 2, 3, 4, 5]);
    assert_eq!(carrier_from_npz(&plain).unwrap().layers().len(), 2);

    // The block has no colors: the index says why there is no such layer.
    let notes = index(&path.join("layered"))[0]["notes"].to_string();
    assert!(
        notes.contains("no layer `color`: no face has a color"),
        "{notes}"
    );
    // The settings of a data set without further layers are those of earlier programs.
    let settings = |name: &str| fs::read_to_string(path.join(name).join("dataset.json")).unwrap();
    assert!(!settings("plain").contains("layers") && settings("layered").contains("layers"));
    let resumed = ["label", "part.step", "--out", "plain", "--resume"];
    check(path, &[&resumed[..], &layers].concat(), 2, "label.layers");
    for (name, message) in [
        ("ward-20", "not constant on faces"),
        ("face", "`face` is not a label source"),
        ("solid,solid", "label.layers names a source twice"),
    ] {
        let label = ["label", "part.step", "--out", "refused", "--layers", name];
        check(path, &label, 2, message);
    }
}

#[test]
fn exit_codes_distinguish_done_failed_and_misused() {
    let folder = mixed_folder();
    let path = folder.path();
    check(
        path,
        &["label", "steps/bad", "--out", "none"],
        1,
        "no file could be labeled",
    );
    check(
        path,
        &["label", "steps", "--out", "strict", "--strict"],
        1,
        "could not be labeled",
    );
    check(path, &["label", "steps", "--out", "strict"], 2, "--force");
    check(
        path,
        &["label", "steps/part0.stp", "--out", "strict", "--force"],
        0,
        "",
    );
    assert_eq!(index(&path.join("strict")).len(), 1);
    check(
        path,
        &["label", "steps", "--out", "steps", "--force"],
        2,
        "lies in --out",
    );
    check(
        path,
        &["label", "nothing", "--out", "strict", "--force"],
        2,
        "does not exist",
    );
    fs::write(path.join("strict/mine.txt"), "not to be lost").unwrap();
    check(
        path,
        &["label", "steps/part0.stp", "--out", "strict", "--force"],
        2,
        "mine.txt was not written by `label`",
    );
    assert_eq!(index(&path.join("strict")).len(), 1);
    check(
        path,
        &["synth", "--out", "steps", "-n", "1"],
        2,
        "is not empty",
    );
    check(
        path,
        &["label", "nothing", "--out", "x"],
        2,
        "does not exist",
    );
    check(
        path,
        &["label", "steps", "--out", "x", "--set", "label.tau=3"],
        2,
        "unknown field `tau`",
    );
    check(
        path,
        &[
            "label",
            "steps/part0.stp",
            "steps/part0.stp",
            "--out",
            "twice",
        ],
        0,
        "is given 2 times and is read once",
    );
    assert_eq!(index(&path.join("twice")).len(), 1);
    check(path, &["frobnicate"], 2, "unrecognized");
    check(path, &["--help"], 0, "");
    assert!(!path.join("x").exists());
}

#[test]
fn bad_files_are_explained_and_leave_no_files() {
    let folder = mixed_folder();
    for (name, _) in bad_files() {
        let file = format!("steps/bad/{name}.step");
        let stdout = check(folder.path(), &["inspect", &file, "--json"], 1, &file);
        assert_eq!(stdout, "", "{name}");
    }
}

#[test]
fn a_file_above_its_memory_does_not_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::File::create(path.join("a.step"))
        .unwrap()
        .set_len(250 << 20)
        .unwrap();
    fs::write(path.join("b.step"), fixtures::cuboid([3.0, 4.0, 5.0])).unwrap();
    // The worker itself, its stack and its arenas take about 150 MiB of addresses.
    check(
        path,
        &[
            "label",
            ".",
            "--out",
            "d",
            "--jobs",
            "1",
            "--set",
            "label.memory_mb=224",
        ],
        0,
        "",
    );
    let rows = index(&path.join("d"));
    assert_eq!(rows[0]["status"], "over-budget");
    assert_eq!(rows[1]["status"], "ok");
    check(
        path,
        &[
            "label",
            "a.step",
            "--out",
            "e",
            "--set",
            "label.max_file_mb=1",
        ],
        1,
        "",
    );
    assert!(
        index(&path.join("e"))[0]["reason"]
            .as_str()
            .unwrap()
            .contains("label.max_file_mb")
    );
}

#[test]
fn lists_and_solids() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("box.step"), fixtures::cuboid([3.0, 4.0, 5.0])).unwrap();
    fs::write(path.join("list.txt"), "# my parts\nbox.step\ngone.step\n").unwrap();
    check(path, &["label", "list.txt", "--out", "listed"], 0, "");
    let rows = index(&path.join("listed"));
    assert_eq!(
        (&rows[0]["id"], &rows[0]["status"]),
        (&"list__box".into(), &"ok".into())
    );
    assert_eq!(
        (&rows[1]["id"], &rows[1]["status"]),
        (&"list__gone".into(), &"failed".into())
    );
    check(
        path,
        &[
            "label",
            "box.step",
            "--out",
            "solids",
            "--unit",
            "solid",
            "--compress",
        ],
        0,
        "",
    );
    assert_eq!(index(&path.join("solids"))[0]["id"], "box__s0");
    fs::write(
        path.join("twins.step"),
        fixtures::two_blocks([3.0, 4.0, 5.0]),
    )
    .unwrap();
    check(
        path,
        &["label", "twins.step", "--out", "twins", "--unit", "solid"],
        0,
        "",
    );
    let rows = index(&path.join("twins"));
    assert_eq!((rows.len(), &rows[0]["n_equal_solids"]), (1, &1.into()));
    fs::write(path.join("open.step"), fixtures::open_box([3.0, 4.0, 5.0])).unwrap();
    check(
        path,
        &["label", "open.step", "--out", "open", "--unit", "solid"],
        1,
        "",
    );
    assert!(
        index(&path.join("open"))[0]["reason"]
            .as_str()
            .unwrap()
            .contains("belongs to a solid")
    );
}

#[test]
fn samples_repeat_and_carry_their_labels() {
    let folder = mixed_folder();
    let path = folder.path();
    check(
        path,
        &[
            "label",
            "steps",
            "--out",
            "d",
            "--attributes",
            "normal,uv,curvature",
        ],
        0,
        "",
    );
    for out in ["a", "b"] {
        check(
            path,
            &[
                "sample",
                "d",
                "--out",
                out,
                "--format",
                "npz",
                "--n-points",
                "500",
                "--normals",
                "analytic",
            ],
            0,
            "",
        );
    }
    assert_eq!(contents(&path.join("a")), contents(&path.join("b")));
    let (sample, labels) =
        sample_from_npz(&fs::read(path.join("a/steps__part0.npz")).unwrap()).unwrap();
    assert_eq!(sample.points.len(), 500);
    assert_eq!(
        labels.keys().collect::<Vec<_>>(),
        ["brep-face", "primitive", "step-parts"]
    );
    check(
        path,
        &[
            "sample",
            "d",
            "--out",
            "p",
            "--format",
            "ply",
            "--n-points",
            "500",
        ],
        0,
        "",
    );
    let cloud = points_from_ply(&fs::read(path.join("p/steps__part0.ply")).unwrap()).unwrap();
    assert_eq!(
        (cloud.points, cloud.parts),
        (sample.points, labels["step-parts"].clone())
    );
    check(
        path,
        &[
            "sample", "d", "--out", "p", "--format", "ply", "--source", "nothing",
        ],
        2,
        "nothing",
    );
    assert!(arrays_from_npz(&fs::read(path.join("a/steps__part1.npz")).unwrap()).is_ok());
}

#[test]
fn step_files_give_points_on_their_true_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(
        path.join("ball.step"),
        fixtures::sphere(4.0, fixtures::FullTurn::Seamed),
    )
    .unwrap();
    let arguments = [
        "sample",
        "ball.step",
        "--out",
        "s",
        "--format",
        "npz",
        "--n-points",
        "300",
        "--project",
    ];
    check(
        path,
        &[&arguments[..], &["--attributes", "uv,curvature"]].concat(),
        0,
        "",
    );
    let mut members = arrays_from_npz(&fs::read(path.join("s/ball.npz")).unwrap()).unwrap();
    let points: Vec<[f32; 3]> = members.rows("points").unwrap();
    let normals: Vec<[f32; 3]> = members.rows("normals").unwrap();
    let curvature: Vec<[f32; 2]> = members.rows("curvature").unwrap();
    assert_eq!(members.rows::<f64, 2>("uv").unwrap().len(), 300);
    assert_eq!(members.blocks::<f32, 2, 3>("direction").unwrap().len(), 300);
    assert_eq!(points.len(), 300);
    for ((point, normal), curvature) in points.iter().zip(&normals).zip(&curvature) {
        let place = [0, 1, 2].map(|axis| point[axis] - 4.0 * normal[axis]);
        // All normals meet at its center.
        let first = [0, 1, 2].map(|axis| points[0][axis] - 4.0 * normals[0][axis]);
        assert!(
            place.iter().zip(first).all(|(a, b)| (a - b).abs() < 1e-5),
            "{place:?}"
        );
        assert_eq!(*curvature, [0.25, 0.25]);
    }
    check(
        path,
        &[
            "label",
            "ball.step",
            "--out",
            "d",
            "--attributes",
            "uv,curvature",
        ],
        0,
        "",
    );
    check(
        path,
        &["sample", "d", "--out", "e", "--format", "npz", "--project"],
        2,
        "give the STEP files",
    );
    check(
        path,
        &[
            "sample",
            "ball.step",
            "--out",
            "e",
            "--format",
            "ply",
            "--attributes",
            "uv",
        ],
        2,
        "--format npz",
    );
}

#[test]
fn inspect_and_verify_agree_with_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("g")).unwrap();
    fs::write(path.join("g/box.step"), fixtures::cuboid([3.0, 4.0, 5.0])).unwrap();
    let report: serde_json::Value =
        serde_json::from_str(&check(path, &["inspect", "g/box.step", "--json"], 0, "")).unwrap();
    let faces = report["faces"].as_array().unwrap();
    assert_eq!((faces.len(), &report["n_parts"]), (6, &6.into()));
    assert_eq!(report["edges"].as_array().unwrap().len(), 12);
    assert!(
        report["edges"]
            .as_array()
            .unwrap()
            .iter()
            .all(|edge| (edge["phi"].as_f64().unwrap() - 90.0).abs() < 1e-9)
    );
    assert_eq!(report["mesh"]["solids"][0]["watertight"], true);
    assert!(
        check(path, &["inspect", "g/box.step"], 0, "")
            .contains("6 faces in 6 parts, 12 shared edges")
    );

    let position = |id: &serde_json::Value| {
        faces
            .iter()
            .position(|face| &face["step_id"] == id)
            .unwrap()
    };
    let reference = serde_json::json!({
        "file": "g/box.step", "status": "ok",
        "faces": faces.iter().map(|face| serde_json::json!([face["step_id"], 0, face["type"], face["part"], 0, face["area"], face["area"]])).collect::<Vec<_>>(),
        "edges": report["edges"].as_array().unwrap().iter().map(|edge| {
            serde_json::json!([position(&edge["faces"][0]), position(&edge["faces"][1]), edge["phi"], edge["length"]])
        }).collect::<Vec<_>>(),
    });
    fs::write(path.join("ref.jsonl"), format!("{reference}\n")).unwrap();
    let table = check(
        path,
        &["verify", "--reference", "ref.jsonl", ".", "--list"],
        0,
        "",
    );
    assert!(
        table.contains(
            "| g | 1 | 0 | 100 % | 100 % | 100 % | 100 % | 100 % | 100 % | 0 | 0 | 100 % | 0 | – | – | – | 100 % | 100 % | 100 % |"
        ),
        "{table}"
    );
    let table = check(path, &["verify", "."], 0, "");
    assert!(
        table.contains("| g | 1 | 0 | 6 | 100 % | 1 | 100 % |"),
        "{table}"
    );
    let solid = report["mesh"]["solids"][0]["step_id"].clone();
    for (volume, cells) in [
        (60.5, "| 1 | 100 % | – | 100 % | 100 % |"),
        (61.0, "| 1 | 0.00 % (−1) | – | 0.00 % (−1) | 100 % |"),
    ] {
        let volumes =
            serde_json::json!({ "file": "g/box.step", "solids": [[solid, true, volume, false]] });
        fs::write(path.join("volumes.jsonl"), format!("{volumes}\n")).unwrap();
        let table = check(
            path,
            &[
                "verify",
                "--reference",
                "ref.jsonl",
                "--volumes",
                "volumes.jsonl",
                ".",
            ],
            0,
            "",
        );
        assert!(table.contains(cells), "{table}");
    }
    check(
        path,
        &[
            "verify",
            "--reference",
            "ref.jsonl",
            "--volumes",
            "gone.jsonl",
            ".",
        ],
        2,
        "gone.jsonl",
    );
    let other = reference.to_string().replacen("plane", "cone", 1);
    fs::write(path.join("ref.jsonl"), format!("{other}\n")).unwrap();
    let table = check(
        path,
        &["verify", "--reference", "ref.jsonl", ".", "--list"],
        0,
        "",
    );
    assert!(table.contains("is plane, reference cone"), "{table}");

    let json = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&check(
            path,
            &[&["verify", ".", "--json"], more].concat(),
            0,
            "",
        ))
        .unwrap()
    };
    let report = json(&[]);
    let sixfold = serde_json::json!({"n": 6, "of": 6, "rate": 1.0});
    assert_eq!(
        (&report["all"]["n_files"], &report["all"]["own_areas"]),
        (&1.into(), &sixfold)
    );
    assert_eq!(
        (
            &report["groups"]["g"],
            report["findings"].as_array().unwrap().len()
        ),
        (&report["all"], 0)
    );
    assert!(report["all"]["types"].is_null() && report["disagreements"].is_null());
    let report = json(&["--reference", "ref.jsonl"]);
    assert_eq!(
        report["all"]["types"],
        serde_json::json!({"n": 0, "of": 1, "rate": 0.0})
    );
    let disagreement = &report["disagreements"][0];
    assert_eq!(disagreement["path"], "g/box.step");
    assert!(
        disagreement["reason"]
            .as_str()
            .unwrap()
            .contains("is plane, reference cone"),
        "{disagreement}"
    );

    fs::create_dir(path.join("rough")).unwrap();
    fs::write(path.join("rough/bad.step"), "no STEP").unwrap();
    let report = json(&[]);
    assert_eq!(
        (&report["failed"][0]["path"], &report["all"]["n_failed"]),
        (&"rough/bad.step".into(), &1.into())
    );
    check(
        path,
        &["verify", "--reference", "ref.jsonl", "gone"],
        2,
        "is not a folder",
    );
    check(
        path,
        &["verify", "--reference", "gone.jsonl", "."],
        2,
        "gone.jsonl",
    );
}

/// A solid that its file holds twice, the second time 10 mm further along z.
fn twice_mapped(solid: String) -> String {
    let representation = solid
        .lines()
        .find(|line| line.contains("SHAPE_REPRESENTATION(") && line.contains("BREP"))
        .unwrap();
    let (id, rest) = representation.split_once('=').unwrap();
    let context = rest.rsplit_once(',').unwrap().1.trim_end_matches(");");
    let entities = format!(
        "#9001=CARTESIAN_POINT('',(0.,0.,0.));\n#9002=CARTESIAN_POINT('',(0.,0.,10.));\n\
         #9003=AXIS2_PLACEMENT_3D('',#9001,$,$);\n#9004=AXIS2_PLACEMENT_3D('',#9002,$,$);\n\
         #9005=REPRESENTATION_MAP(#9003,{id});\n#9006=MAPPED_ITEM('',#9005,#9003);\n#9007=MAPPED_ITEM('',#9005,#9004);\n\
         #9008=SHAPE_REPRESENTATION('',(#9006,#9007),{context});\n"
    );
    let (before, after) = solid.rsplit_once("ENDSEC;").unwrap();
    format!("{before}{entities}ENDSEC;{after}")
}

#[test]
fn instances_are_placed_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(
        path.join("two.step"),
        twice_mapped(fixtures::cuboid([3.0, 4.0, 5.0])),
    )
    .unwrap();
    check(path, &["label", "two.step", "--out", "once"], 0, "");
    check(
        path,
        &["label", "two.step", "--out", "all", "--instances"],
        0,
        "",
    );
    let carrier = |dataset: &str| {
        carrier_from_npz(&fs::read(path.join(dataset).join("two.npz")).unwrap()).unwrap()
    };
    let (once, all) = (carrier("once"), carrier("all"));
    assert_eq!(
        (once.graph().faces.len(), once.meta().instances.len()),
        (6, 1)
    );
    assert_eq!(
        (all.graph().faces.len(), all.meta().instances.len()),
        (12, 2)
    );
    assert_eq!(all.meta().instances[1].transform[2][3], 10.0);
    let instances: Vec<u32> = all.graph().faces.iter().map(|face| face.instance).collect();
    assert_eq!(instances, [[0; 6], [1; 6]].concat());
    check(
        path,
        &[
            "label",
            "two.step",
            "--out",
            "x",
            "--instances",
            "--unit",
            "solid",
        ],
        2,
        "label.instances",
    );
}

/// A ball of radius 4 that its file holds twice, the second time 10 mm further along z and turned.
fn two_balls() -> String {
    let turned = "#9004=AXIS2_PLACEMENT_3D('',#9002,#9010,$);\n#9010=DIRECTION('',(0.,1.,1.));";
    twice_mapped(fixtures::sphere(4.0, fixtures::FullTurn::Seamed))
        .replace("#9004=AXIS2_PLACEMENT_3D('',#9002,$,$);", turned)
}

#[test]
fn occurrences_have_true_surfaces_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("balls.step"), two_balls()).unwrap();
    check(
        path,
        &[
            "label",
            "balls.step",
            "--out",
            "d",
            "--instances",
            "--attributes",
            "normal,uv,curvature",
        ],
        0,
        "",
    );
    let carrier = carrier_from_npz(&fs::read(path.join("d/balls.npz")).unwrap()).unwrap();
    let n_vertices = carrier.mesh().vertices.len();
    assert_eq!(
        (
            carrier.graph().faces.len(),
            carrier.attributes().curvature.len()
        ),
        (2, n_vertices)
    );
    assert_eq!(
        carrier.attributes().uv[..n_vertices / 2],
        carrier.attributes().uv[n_vertices / 2..]
    );

    let labeled = [
        "sample",
        "d",
        "--out",
        "plain",
        "--format",
        "npz",
        "--n-points",
        "400",
    ];
    check(path, &labeled, 0, "");
    let arguments = [
        "sample",
        "balls.step",
        "--out",
        "s",
        "--format",
        "npz",
        "--n-points",
        "400",
        "--instances",
    ];
    let printed = check(
        path,
        &[&arguments[..], &["--project", "--attributes", "curvature"]].concat(),
        0,
        "",
    );
    assert!(!printed.contains("stayed on their triangles"), "{printed}");
    let bytes = |folder: &str| fs::read(path.join(folder).join("balls.npz")).unwrap();
    let ((plain, labels), (projected, own)) = (
        sample_from_npz(&bytes("plain")).unwrap(),
        sample_from_npz(&bytes("s")).unwrap(),
    );
    assert_eq!(labels, own);
    // The same points are drawn in both cases; projected, all normals of a ball meet in its center.
    let center = |i: usize| {
        [0, 1, 2].map(|axis| projected.points[i][axis] - 4.0 * projected.normals[i][axis])
    };
    let near =
        |a: [f32; 3], b: [f32; 3], reach: f32| a.iter().zip(b).all(|(a, b)| (a - b).abs() < reach);
    let faces = &own["brep-face"];
    for (i, face) in faces.iter().enumerate() {
        let first = faces.iter().position(|other| other == face).unwrap();
        assert!(
            near(center(i), center(first), 1e-4),
            "{:?} {:?}",
            center(i),
            center(first)
        );
        assert!(near(plain.points[i], projected.points[i], 0.2));
    }
    let curvature: Vec<[f32; 2]> = arrays_from_npz(&bytes("s"))
        .unwrap()
        .rows("curvature")
        .unwrap();
    assert!(faces.contains(&1) && curvature.iter().all(|row| *row == [0.25, 0.25]));
    check(
        path,
        &[
            "sample",
            "d",
            "--out",
            "x",
            "--format",
            "npz",
            "--instances",
        ],
        2,
        "label it with --instances",
    );
}

/// A `CSG_SOLID` of a block of 1 × 2 × 3 mm: its six faces share the number of the primitive.
const BLOCK: &str = "\
#1=(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3))REPRESENTATION_CONTEXT('',''));
#2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));
#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));
#4=CARTESIAN_POINT('',(0.,0.,0.));
#5=DIRECTION('',(0.,0.,1.));
#6=DIRECTION('',(1.,0.,0.));
#7=AXIS2_PLACEMENT_3D('',#4,#5,#6);
#8=BLOCK('',#7,1.,2.,3.);
#9=CSG_SOLID('body',#8);
#10=CSG_SHAPE_REPRESENTATION('',(#9),#1);
";

#[test]
fn faces_of_one_number_have_surfaces_of_their_own() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("block.step"), step(BLOCK)).unwrap();
    let report: serde_json::Value =
        serde_json::from_str(&check(path, &["inspect", "block.step", "--json"], 0, "")).unwrap();
    let faces = report["faces"].as_array().unwrap();
    let ids: BTreeSet<u64> = faces
        .iter()
        .map(|face| face["step_id"].as_u64().unwrap())
        .collect();
    let normals: BTreeSet<String> = faces
        .iter()
        .map(|face| {
            let axis = face["surface"]["axis"].as_array().unwrap();
            let rounded = axis
                .iter()
                .map(|x| x.as_f64().unwrap().abs().round() as i32);
            format!("{:?}", rounded.collect::<Vec<i32>>())
        })
        .collect();
    assert_eq!(
        (faces.len(), ids.len(), normals.len()),
        (6, 1, 3),
        "{report}"
    );
    assert_eq!(
        report["mesh"]["bounding_box"],
        serde_json::json!([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]])
    );
    let center = report["mesh"]["solids"][0]["centroid"].as_array().unwrap();
    for (x, expected) in center.iter().zip([0.5, 1.0, 1.5]) {
        assert!((x.as_f64().unwrap() - expected).abs() < 1e-12, "{report}");
    }
}
