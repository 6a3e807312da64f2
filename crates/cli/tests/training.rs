//! Tests golden trainings of the real program: killed and resumed, ended early, diverged and repeated, with faults, and
//! what a trained backbone then says of foreign files.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

mod fixture;

use fixture::{Fixture, assert_code};
use partprobe_formats::{
    Array, Half, PlyPoints, Values, arrays_from_npz, arrays_to_npz, points_to_ply,
};
use std::fs;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

const CHECKPOINTS: &str = "checkpoints/step-parts-0";

impl Fixture {
    /// Trains on the labeled parts of the first run.
    fn train(&self, out: &str, more: &[&str]) -> Output {
        self.program(&[&train_args(out)[..], more].concat())
    }

    fn weights(&self, out: &str) -> Vec<u8> {
        fs::read(self.path(out).join(CHECKPOINTS).join("model.safetensors")).unwrap()
    }
}

fn train_args(out: &str) -> [&str; 8] {
    [
        "train",
        "tiny.toml",
        "--data",
        "first/data/carriers",
        "--supervision",
        "step-parts",
        "--out",
        out,
    ]
}

fn lines_of(path: &Path, event: &str) -> Vec<serde_json::Value> {
    let text = fs::read_to_string(path).unwrap();
    let lines = text
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    lines.filter(|line| line["event"] == event).collect()
}

#[test]
fn a_killed_training_is_resumed_to_the_same_bytes() {
    let fixture = Fixture::new();
    let through = fixture.weights("first");
    for (out, more) in [
        ("a", &["--loaders", "0"][..]),
        ("b", &["--loaders", "3"]),
        ("c", &["--resample"]),
    ] {
        assert_code(&fixture.train(out, more), 0);
        assert!(fixture.weights(out) == through, "{more:?}");
    }

    // Killed as soon as there is a checkpoint, wherever it stands then.
    let mut killed = fixture.command(&train_args("killed")).spawn().unwrap();
    while !fixture
        .path("killed")
        .join(CHECKPOINTS)
        .join("last")
        .exists()
    {
        std::thread::sleep(Duration::from_millis(1));
        assert!(
            killed
                .try_wait()
                .unwrap()
                .is_none_or(|status| status.success())
        );
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert_code(&fixture.train("killed", &["--resume"]), 0);
    assert!(fixture.weights("killed") == through);
    let same = |file: &str| {
        let read = |out: &str| fs::read(fixture.path(out).join(CHECKPOINTS).join(file)).unwrap();
        assert!(read("killed") == read("first"), "{file}");
    };
    ["last", "best", "validations.json", "training.json"]
        .into_iter()
        .for_each(same);
}

#[test]
fn a_time_limit_stops_with_a_checkpoint() {
    let fixture = Fixture::new();
    let output = fixture.train("limited", &["--stop-after", "0"]);
    assert_code(&output, 130);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(message.contains("stopped at step 1 of 6"), "{message}");
    assert!(!message.contains("error:"), "{message}");
    assert_code(&fixture.train("limited", &["--resume"]), 0);
    assert!(fixture.weights("limited") == fixture.weights("first"));
    assert_code(&fixture.train("refused", &["--stop-after", "soon"]), 2);
}

#[test]
fn epochs_end_early_without_progress_also_when_resumed() {
    let fixture = Fixture::new();
    // Nothing is learned, so that no validation after the first is better.
    let more = [
        "--set",
        "train.epochs=9",
        "--set",
        "train.valid_every_epochs=1",
        "--set",
        "train.patience=2",
        "--set",
        "optim.learning_rate=0",
    ];
    assert_code(&fixture.train("early", &more), 0);
    let record = fs::read_to_string(
        fixture
            .path("early")
            .join(CHECKPOINTS)
            .join("training.json"),
    )
    .unwrap();
    let record: serde_json::Value = serde_json::from_str(&record).unwrap();
    let log = fixture.path("early/log.jsonl");
    let valid = lines_of(&log, "valid");
    let steps: Vec<u64> = valid
        .iter()
        .map(|line| line["step"].as_u64().unwrap())
        .collect();
    let epoch = steps[0];
    assert_eq!(steps, [epoch, 2 * epoch, 3 * epoch]);
    assert_eq!(
        (record["stopped_early"].as_bool(), record["steps"].as_u64()),
        (Some(true), Some(3 * epoch))
    );
    // What was killed between its last checkpoint and its weights.
    let weights = fixture.weights("early");
    fs::remove_file(
        fixture
            .path("early")
            .join(CHECKPOINTS)
            .join("model.safetensors"),
    )
    .unwrap();
    assert_code(
        &fixture.train("early", &[&more[..], &["--resume"]].concat()),
        0,
    );
    assert!(fixture.weights("early") == weights);
    assert_eq!(lines_of(&log, "step").len() as u64, 3 * epoch);
    let end = &lines_of(&log, "end")[0];
    assert!((0.0..=1.0).contains(&end["wait_share"].as_f64().unwrap()));
}

#[test]
fn curves_are_drawn_for_tensorboard() {
    let fixture = Fixture::new();
    let folder = fixture.path("first/tensorboard/step-parts-0");
    let file = fs::read_dir(folder)
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    assert!(
        file.file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .contains("tfevents")
    );
    let bytes = fs::read(file).unwrap();
    let count = |tag: &[u8]| {
        bytes
            .windows(tag.len())
            .filter(|window| *window == tag)
            .count()
    };
    assert_eq!(
        [
            b"train/loss" as &[u8],
            b"train/learning_rate",
            b"valid/gtc_miou"
        ]
        .map(count),
        [6, 6, 3]
    );
}

#[test]
fn an_update_that_diverges_is_kept_and_can_be_repeated() {
    let fixture = Fixture::new();
    assert_code(&fixture.train("diverging", &["--stop-after", "0"]), 130);
    let last = fixture.path("diverging").join(CHECKPOINTS).join("last");
    let mut bytes = fs::read(&last).unwrap();
    let header = u64::from_le_bytes(*bytes.first_chunk::<8>().unwrap()) as usize;
    let text = String::from_utf8(bytes[8..8 + header].to_vec()).unwrap();
    let table: serde_json::Value = serde_json::from_str(&text).unwrap();
    let bias = table["weights.head.bias"]["data_offsets"][0]
        .as_u64()
        .unwrap() as usize;
    bytes[8 + header + bias..][..4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    // The hash of the values, which would tell: spaces are nothing in JSON.
    let start = text.find(r#"\"values_sha256\""#).unwrap();
    let length = text[start..].find(',').unwrap() + 1;
    bytes[8 + start..][..length].fill(b' ');
    fs::write(&last, bytes).unwrap();

    let output = fixture.train("diverging", &["--resume"]);
    assert_code(&output, 1);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("step 2: shape `") && message.contains("partprobe replay"),
        "{message}"
    );
    let shape = message.split('`').nth(1).unwrap().to_owned();
    let output = fixture.program(&["replay", "diverging/diverged/step-parts-0"]);
    assert_code(&output, 1);
    let message = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        message.contains(&format!(
            "{shape}: step 2: shape `{shape}` gave numbers that are not finite"
        )),
        "{message}"
    );
    assert_code(&fixture.program(&["replay", "first"]), 2);
}

/// Enough to learn from in two seconds: a sound training gains about 0.19 mIoU, and each fault none.
const WITH_FAULTS: &str = r#"
base = "base.toml"
[data]
source = "synth"
[synth]
n = 40
max_parts = 8
[sample]
n_points = 1500
[split]
train = 0.7
valid = 0.0
test = 0.3
[compare]
supervision = ["step-parts"]
[tokens]
train_tokens = 96
test_tokens = 128
[train]
steps = 90
batch_shapes = 2
valid_every = 0
[eval]
restarts = 1
bootstrap = 20
[expect]
"step-parts/step-parts.miou - untrained/step-parts.miou" = ">= 0.1"
"step-parts.untouched_tensors" = "<= 0"
"#;

#[test]
fn every_fault_misses_an_expectation() {
    let fixture = Fixture::empty();
    fs::write(fixture.path("with-faults.toml"), WITH_FAULTS).unwrap();
    let run = |out: &str, more: &[&str]| {
        let fixed = ["run", "with-faults.toml", "--out", out];
        fixture.program(&[&fixed[..], more].concat())
    };
    assert_code(&run("sound", &[]), 0);
    let data = ["--data", "sound/data/carriers"];
    for (flag, fault, missed) in [
        (
            "--set",
            "optim.learning_rate=0",
            "missed: step-parts/step-parts.miou",
        ),
        (
            "--inject-fault",
            "flip-loss",
            "missed: step-parts/step-parts.miou",
        ),
        (
            "--inject-fault",
            "shuffle-labels",
            "missed: step-parts/step-parts.miou",
        ),
        (
            "--inject-fault",
            "freeze-encoder",
            "missed: step-parts/step-parts.miou",
        ),
        (
            "--inject-fault",
            "zero-block-gradient",
            "missed: step-parts.untouched_tensors",
        ),
    ] {
        let output = run(fault, &[&data[..], &[flag, fault]].concat());
        assert_code(&output, 3);
        let message = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(message.contains(missed), "{fault}: {message}");
    }
    // What is finished misses its bounds again. A training with a fault is never resumed without it.
    let resumed = || run("flip-loss", &[&data[..], &["--resume"]].concat());
    assert_code(&resumed(), 3);
    let weights = "flip-loss/checkpoints/step-parts-0/model.safetensors";
    fs::remove_file(fixture.path(weights)).unwrap();
    let output = resumed();
    assert_code(&output, 1);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("was not trained on this run's shapes"),
        "{message}"
    );
}

/// A tetrahedron's corners and faces.
const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn stl() -> String {
    let corner = |idx: usize| {
        format!(
            "vertex {} {} {}\n",
            CORNERS[idx][0], CORNERS[idx][1], CORNERS[idx][2]
        )
    };
    let facet = |face: [usize; 3]| format!("facet\n{}endfacet\n", face.map(corner).concat());
    format!("solid\n{}", FACES.map(facet).concat())
}

fn obj() -> String {
    let corner = |[x, y, z]: [f32; 3]| format!("v {x} {y} {z}\n");
    let face = |face: [usize; 3]| format!("f {} {} {}\n", face[0] + 1, face[1] + 1, face[2] + 1);
    CORNERS.map(corner).concat() + &FACES.map(face).concat()
}

fn embeddings(file: &Path) -> Vec<f32> {
    match arrays_from_npz(&fs::read(file).unwrap())
        .unwrap()
        .array("embeddings")
        .unwrap()
        .values()
    {
        Values::F32(values) => values.clone(),
        Values::F16(values) => values.iter().map(|half: &Half| half.to_f32()).collect(),
        _ => Vec::new(),
    }
}

#[test]
fn anything_with_a_surface_or_points_is_embedded() {
    let fixture = Fixture::new();
    fs::write(fixture.path("a.stl"), stl()).unwrap();
    fs::write(fixture.path("b.obj"), obj()).unwrap();
    let (points, normals) = (CORNERS.to_vec(), vec![[0.0, 0.0, 1.0]; 4]);
    let cloud = PlyPoints {
        points: points.clone(),
        normals: normals.clone(),
        parts: Vec::new(),
    };
    fs::write(fixture.path("c.ply"), points_to_ply(&cloud)).unwrap();
    let members = [
        ("points", Array::rows(&points)),
        ("normals", Array::rows(&normals)),
    ];
    fs::write(
        fixture.path("d.npz"),
        arrays_to_npz(&members, partprobe_formats::Compression::Stored).unwrap(),
    )
    .unwrap();
    fs::write(
        fixture.path("e.ply"),
        points_to_ply(&PlyPoints {
            normals: Vec::new(),
            ..cloud
        }),
    )
    .unwrap();

    let weights = format!("first/{CHECKPOINTS}/model.safetensors");
    let embed = |out: &str, more: &[&str]| {
        let fixed = [
            "embed", &weights, "a.stl", "b.obj", "c.ply", "d.npz", "e.ply", "f.txt", "--out", out,
        ];
        let output = fixture.program(&[&fixed[..], more].concat());
        assert_code(&output, i32::from(more.contains(&"--strict")));
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            message.contains("e.ply: points need a normal each") && message.contains("f.txt"),
            "{message}"
        );
        assert!(
            message.contains("2 of 6 files could not be embedded; the others are written"),
            "{message}"
        );
        assert_eq!(String::from_utf8_lossy(&output.stdout).lines().count(), 4);
    };
    embed("tokens", &[]);
    embed("points", &["--form", "points", "--dtype", "f16"]);
    embed("points", &["--force", "--strict", "--form", "points"]);
    fs::write(fixture.path("points/thesis.tex"), "").unwrap();
    let refused = fixture.program(&["embed", &weights, "a.stl", "--out", "points", "--force"]);
    assert_code(&refused, 2);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        message.contains("thesis.tex was not written by `embed`"),
        "{message}"
    );
    fs::remove_file(fixture.path("points/thesis.tex")).unwrap();
    for name in ["a", "b", "c", "d"] {
        let file = |out: &str| fixture.path(out).join(format!("{name}.npz"));
        let members = arrays_from_npz(&fs::read(file("points")).unwrap()).unwrap();
        // Meshes are sampled as the training was, whose settings stand in the file of weights.
        let n_points = if ["a", "b"].contains(&name) { 600 } else { 4 };
        assert_eq!(
            members.array("embeddings").unwrap().shape(),
            [n_points, 128]
        );
        let tokens = embeddings(&file("tokens"));
        let token_of_point = arrays_from_npz(&fs::read(file("tokens")).unwrap())
            .unwrap()
            .vector::<u32>("token_of_point")
            .unwrap();
        for (row, token) in embeddings(&file("points")).chunks(128).zip(token_of_point) {
            let expected = &tokens[128 * token as usize..][..128];
            assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3));
        }
    }
    assert_code(
        &fixture.program(&["embed", &weights, "a.stl", "--out", "x", "--seed", "1"]),
        2,
    );

    // Two files of one name, of which one changes before the call is resumed.
    for folder in ["one", "two"] {
        fs::create_dir(fixture.path(folder)).unwrap();
    }
    fs::write(fixture.path("one/x.obj"), obj()).unwrap();
    fs::write(fixture.path("two/x.stl"), stl()).unwrap();
    let twins = [
        "embed",
        &weights,
        "one/x.obj",
        "two/x.stl",
        "--out",
        "twins",
    ];
    assert_code(&fixture.program(&twins), 0);
    let file = |name: &str| fs::read(fixture.path("twins").join(name)).unwrap();
    let before = ["one__x.npz", "two__x.npz"].map(file);
    let larger = obj().replace("v 1", "v 2");
    assert_ne!(larger, obj());
    fs::write(fixture.path("one/x.obj"), larger).unwrap();
    let output = fixture.program(&[&twins[..], &["--resume"]].concat());
    assert_code(&output, 0);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("1 file was there already"), "{message}");
    let after = ["one__x.npz", "two__x.npz"].map(file);
    assert!(after[0] != before[0] && after[1] == before[1]);
    assert_code(
        &fixture.program(&["embed", "first", "e.ply", "--out", "x"]),
        1,
    );
}

#[test]
fn frozen_parts_keep_their_bytes_and_others_change() {
    let fixture = Fixture::new();
    let start = "first/checkpoints/step-parts-0/model.safetensors";
    let freeze = r#"train.freeze=["stem", "encoder.0"]"#;
    assert_code(
        &fixture.train("tuned", &["--init", start, "--set", freeze]),
        0,
    );
    let (before, after) = (
        tensors(&fixture.weights("first")),
        tensors(&fixture.weights("tuned")),
    );
    assert!(before.len() > 10 && before.len() == after.len());
    for (name, bytes) in &before {
        let is_frozen = ["backbone.stem.", "backbone.encoder.0."]
            .iter()
            .any(|part| name.starts_with(part));
        assert_eq!(&after[name] == bytes, is_frozen, "{name}");
    }
    let output = fixture.train("misspelt", &["--set", r#"train.freeze=["encodr.0"]"#]);
    assert_code(&output, 2);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        message.contains("no part `encodr.0`; did you mean `encoder.0`?"),
        "{message}"
    );
    assert!(!fixture.path("misspelt").exists());
}

/// The bytes of each tensor of a safetensors file: a length, a JSON header of that length, and the data.
fn tensors(file: &[u8]) -> std::collections::BTreeMap<String, Vec<u8>> {
    let length = u64::from_le_bytes(file[..8].try_into().unwrap()) as usize;
    let (header, data) = file[8..].split_at(length);
    let header: serde_json::Map<String, serde_json::Value> =
        serde_json::from_slice(header).unwrap();
    let entries = header
        .into_iter()
        .filter(|(name, _)| name != "__metadata__");
    entries
        .map(|(name, entry)| {
            let at = |idx: usize| entry["data_offsets"][idx].as_u64().unwrap() as usize;
            (name, data[at(0)..at(1)].to_vec())
        })
        .collect()
}

#[test]
fn a_longer_training_has_the_bytes_of_one_of_that_length() {
    let fixture = Fixture::new();
    for (name, first, then) in [
        ("constant", r#"{type="constant"}"#, r#"{type="constant"}"#),
        (
            "trapezoid",
            r#"{type="trapezoid", warmup_steps=2, cooldown_steps=0}"#,
            r#"{type="trapezoid", warmup_steps=2, cooldown_steps=3}"#,
        ),
    ] {
        let schedule = |text: &str| format!("optim.schedule={text}");
        let (first, then) = (schedule(first), schedule(then));
        assert_code(&fixture.train(name, &["--set", &first]), 0);
        let short = fixture.weights(name);
        let longer = ["--set", &then, "--set", "train.steps=9"];
        assert_code(
            &fixture.train(name, &[&longer[..], &["--resume"]].concat()),
            0,
        );
        let through = format!("{name}-through");
        assert_code(&fixture.train(&through, &longer), 0);
        assert!(fixture.weights(name) == fixture.weights(&through), "{name}");
        assert!(fixture.weights(name) != short, "{name}");
        let back = fixture.train(
            name,
            &["--set", &then, "--set", "train.steps=6", "--resume"],
        );
        assert_code(&back, 2);
    }
}

#[test]
fn a_longer_training_has_the_validations_of_one_of_that_length() {
    let fixture = Fixture::new();
    let constant = r#"optim.schedule={type="constant"}"#;
    let longer = |keep: &str, valid_every: &str, n_steps: &str, more: &[&str]| {
        let sets = [
            constant,
            &format!("train.keep={keep}"),
            &format!("train.valid_every={valid_every}"),
            &format!("train.steps={n_steps}"),
        ]
        .map(str::to_owned);
        let sets = sets.iter().flat_map(|set| ["--set", set.as_str()]);
        let arguments: Vec<&str> = sets.chain(more.iter().copied()).collect();
        let out = format!("{keep}-{valid_every}");
        let output = fixture.train(&out, &arguments);
        let validations = format!("{out}/checkpoints/step-parts-0/validations.json");
        (
            output,
            fs::read_to_string(fixture.path(&validations)).unwrap(),
        )
    };
    // The validation at the former end was not due, so it does not stay.
    assert_code(&longer("last", "4", "6", &[]).0, 0);
    let (output, after) = longer("last", "4", "9", &["--resume"]);
    assert_code(&output, 0);
    assert!(!after.contains("\"step\": 6"), "{after}");
    assert!(after.contains("\"step\": 8"), "{after}");

    assert_code(&longer("best", "4", "6", &[]).0, 0);
    let (refused, _) = longer("best", "4", "9", &["--resume"]);
    assert_code(&refused, 2);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        message.contains("a multiple of train.valid_every"),
        "{message}"
    );

    assert_code(&longer("best", "3", "6", &[]).0, 0);
    assert_code(&longer("best", "3", "9", &["--resume"]).0, 0);
}

#[test]
fn a_cool_down_fits_into_the_training_and_into_its_new_updates() {
    let fixture = Fixture::new();
    let train = |schedule: &str, n_steps: &str, more: &[&str]| {
        let (schedule, steps) = (
            format!("optim.schedule={schedule}"),
            format!("train.steps={n_steps}"),
        );
        let sets = ["--set", &schedule, "--set", &steps];
        let output = fixture.train("cooled", &[&sets[..], more].concat());
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), message)
    };
    let trapezoid = |up: usize, down: usize| {
        format!(r#"{{type="trapezoid", warmup_steps={up}, cooldown_steps={down}}}"#)
    };
    let (code, message) = train(&trapezoid(5, 5), "6", &[]);
    assert_eq!(code, Some(2), "{message}");
    assert!(
        message.contains("optim.schedule must leave room"),
        "{message}"
    );
    assert_eq!(train(&trapezoid(2, 0), "6", &[]).0, Some(0));
    let (code, message) = train(&trapezoid(2, 5), "9", &["--resume"]);
    assert_eq!(code, Some(2), "{message}");
    assert!(
        message.contains("cooldown_steps can be at most 3"),
        "{message}"
    );
}

#[test]
fn a_schedule_that_spans_all_steps_is_not_made_longer() {
    let fixture = Fixture::new();
    let before = fixture.weights("first");
    assert_code(&fixture.train("mine", &[]), 0);
    let output = fixture.train("mine", &["--resume", "--set", "train.steps=9"]);
    assert_code(&output, 2);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    for text in [
        "train.steps is 6, not 9",
        "must give all former updates the same learning rate",
        "--init",
    ] {
        assert!(message.contains(text), "{message}");
    }
    assert!(fixture.weights("mine") == before);
    assert_code(&fixture.train("mine", &["--resume"]), 0);
}
