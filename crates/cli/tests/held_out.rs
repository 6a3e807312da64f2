//! Tests what could make a run lie, through the real program: other settings, other shapes, other carriers, other
//! backbones, two programs at once, a disk that is full.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

use partprobe_formats::{Array, Compression, arrays_from_npz, arrays_to_npz};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// Sixteen parts, two updates, small tokens.
const TINY: &str = r#"
base = "base.toml"
[data]
source = "synth"
[synth]
n = 16
max_parts = 12
[sample]
n_points = 500
[split]
train = 0.5
valid = 0.25
test = 0.25
[compare]
supervision = ["step-parts"]
[tokens]
train_tokens = 48
test_tokens = 64
[train]
steps = 2
batch_shapes = 2
valid_every = 0
checkpoint_every = 1
[eval]
restarts = 1
bootstrap = 20
"#;

const WEIGHTS: &str = "checkpoints/step-parts-0/model.safetensors";

/// A folder with the config, a finished run as `run`, and its data set as `data`.
struct Fixture {
    root: tempfile::TempDir,
}

impl Fixture {
    /// A copy of one run that all tests share.
    fn new() -> Self {
        static FIRST: OnceLock<Fixture> = OnceLock::new();
        let first = FIRST.get_or_init(|| {
            let first = Self {
                root: tempfile::tempdir().unwrap(),
            };
            fs::write(first.path("tiny.toml"), TINY).unwrap();
            first.check(&["run", "tiny.toml", "--out", "made"], 0, "");
            fs::rename(first.path("made/data/carriers"), first.path("data")).unwrap();
            first.check(
                &["run", "tiny.toml", "--data", "data", "--out", "run"],
                0,
                "",
            );
            first
        });
        let copy = Self {
            root: tempfile::tempdir().unwrap(),
        };
        copy_folder(first.root.path(), copy.root.path());
        // Where the data lie is kept as an absolute path.
        let data = copy.path("data").canonicalize().unwrap();
        fs::write(
            copy.path("run/data.json"),
            serde_json::to_vec(&data).unwrap(),
        )
        .unwrap();
        copy
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_partprobe"));
        command
            .args(args)
            .current_dir(self.root.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Runs the program; stderr must hold the texts that `message` gives, with `|` between them. Gives stdout.
    #[track_caller]
    fn check(&self, args: &[&str], code: i32, message: &str) -> String {
        let output = self.command(args).output().unwrap();
        assert_outcome(args, &output, code, message);
        String::from_utf8(output.stdout).unwrap()
    }

    /// Puts another training, with all that it says of itself, in the place of the run's own.
    fn replace_training(&self, checkpoints: &str) {
        for file in ["model.safetensors", "training.json"] {
            let from = self.path(checkpoints).join(file);
            fs::copy(from, self.path("run/checkpoints/step-parts-0").join(file)).unwrap();
        }
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap()
    }

    fn lines(&self, name: &str) -> Vec<Value> {
        let text = String::from_utf8(self.read(name)).unwrap();
        text.lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect()
    }

    /// The ids on a side of a run's split.
    fn side(&self, run: &str, side: &str) -> Vec<String> {
        let split = self.json(&format!("{run}/split.json"));
        split[side]
            .as_array()
            .unwrap()
            .iter()
            .map(|id| id.as_str().unwrap().to_owned())
            .collect()
    }

    /// Replaces a member of a carrier by what it becomes, and leaves out members of these names.
    fn rewrite(&self, file: &str, left_out: &[&str], change: impl Fn(&mut Vec<i32>)) {
        let mut members = arrays_from_npz(&self.read(file)).unwrap();
        let names: Vec<String> = members.names().map(str::to_owned).collect();
        let mut label = members.vector::<i32>("face_label").unwrap();
        change(&mut label);
        let mut arrays = vec![("face_label", partprobe_formats::Array::vector(label))];
        for name in &names {
            let is_kept = !["face_label", "format_version"].contains(&name.as_str())
                && !left_out.contains(&&**name);
            arrays.extend(
                members
                    .array(name)
                    .filter(|_| is_kept)
                    .map(|array| (name.as_str(), array.clone())),
            );
        }
        fs::write(
            self.path(file),
            arrays_to_npz(&arrays, Compression::Stored).unwrap(),
        )
        .unwrap();
    }
}

#[track_caller]
fn assert_outcome(args: &[&str], output: &Output, code: i32, message: &str) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{args:?}: {stderr}{}",
        String::from_utf8_lossy(&output.stdout)
    );
    for text in message.split('|') {
        assert!(
            stderr.contains(text) && !stderr.contains("panicked"),
            "{args:?} does not say `{text}`: {stderr}"
        );
    }
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy_folder(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), &target).unwrap();
        }
    }
}

/// Resumes the run of the fixture.
const RESUMED: [&str; 7] = [
    "run",
    "tiny.toml",
    "--data",
    "data",
    "--out",
    "run",
    "--resume",
];

#[test]
fn a_new_reference_is_scored_on_the_test_shapes_and_on_no_other() {
    let fixture = Fixture::new();
    let split = fixture.read("run/split.json");
    let test: BTreeSet<String> = fixture.side("run", "test").into_iter().collect();
    // One of the parts has planes only.
    for (references, clusterers, n_left_out) in [
        (r#"["step-parts","primitive"]"#, r#"["k-means"]"#, 1),
        (r#"["brep-face"]"#, r#"["average-link","k-means"]"#, 0),
    ] {
        let (references, clusterers) = (
            format!("compare.references={references}"),
            format!("eval.clusterers={clusterers}"),
        );
        let args = ["eval", "run", "--set", &references, "--set", &clusterers];
        let output = fixture.command(&args).output().unwrap();
        assert_outcome(&args, &output, 0, "labeled shapes take part");
        let message = String::from_utf8(output.stderr).unwrap();
        let rows = fixture.lines("run/scores.jsonl");
        let scored: BTreeSet<String> = rows
            .iter()
            .map(|row| row["shape"].as_str().unwrap().to_owned())
            .collect();
        assert!(
            scored.is_subset(&test) && scored.len() + n_left_out == test.len(),
            "{scored:?} of {test:?}"
        );
        assert_eq!(
            message.contains("1 left out: one label by `primitive`"),
            n_left_out == 1,
            "{message}"
        );
        // The tables say so too, when they are made and when they are made again.
        let tables = String::from_utf8(fixture.read("run/tables.md")).unwrap();
        for tables in [tables, fixture.check(&["report", "run"], 0, "")] {
            let sentence = format!(
                "Only {} of the {} held-out shapes",
                scored.len(),
                test.len()
            );
            assert_eq!(tables.contains(&sentence), n_left_out == 1, "{tables}");
        }
        assert_eq!(fixture.read("run/split.json"), split);
        // What stands in the folder is of this evaluation alone.
        let files = fs::read_dir(fixture.path("run/predictions/step-parts-0"))
            .unwrap()
            .count();
        assert_eq!(files, scored.len());
    }
}

#[test]
fn a_layer_that_refines_can_be_switched_on_after_the_training() {
    let fixture = Fixture::new();
    let refine = r#"net.refine={ type = "mean-shift", kappa = 20.0, steps = 8 }"#;
    fixture.check(&["eval", "run", "--set", refine], 0, "");
    let rows = fixture.lines("run/scores.jsonl");
    let of = |column: &str| {
        let rows = rows.iter().filter(|row| row["clusterer"] == column);
        rows.map(|row| row["miou"].as_f64().unwrap())
            .collect::<Vec<_>>()
    };
    let (raw, refined) = (of("k-means"), of("mean-shift+k-means"));
    assert_eq!(raw.len(), rows.len() / 2);
    assert_eq!(refined.len(), rows.len() / 2);
    assert_ne!(raw, refined);
}

#[test]
fn a_later_reference_does_not_influence_the_training() {
    let fixture = Fixture::new();
    let references = ["--set", r#"compare.references=["step-parts","primitive"]"#];
    fixture.check(&[&["eval", "run"][..], &references].concat(), 0, "");
    let (scores, weights) = (
        fixture.read("run/scores.jsonl"),
        fixture.read(&format!("run/{WEIGHTS}")),
    );
    fs::remove_dir_all(fixture.path("run/checkpoints")).unwrap();
    fixture.check(
        &RESUMED,
        2,
        r#"compare.references is ["step-parts","primitive"], not ["step-parts"]"#,
    );
    fixture.check(&[&RESUMED[..], &references].concat(), 0, "");
    assert!(
        fixture.read(&format!("run/{WEIGHTS}")) == weights
            && fixture.read("run/scores.jsonl") == scores
    );

    let supervision = r#"compare.supervision=["step-parts","brep-face"]"#;
    let files = ["run/split.json", "run/config.toml", "run/scores.jsonl"];
    let before = files.map(|file| fixture.read(file));
    let unknown = "`brep-face` was not compared when this run's shapes were chosen";
    fixture.check(&["eval", "run", "--set", supervision], 2, unknown);
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "brep-face",
        "--out",
        "run",
        "--resume",
    ];
    let sets = [&references[..], &["--set", supervision]].concat();
    for sets in [&[][..], &references, &sets] {
        fixture.check(&[&train[..], sets].concat(), 2, unknown);
    }
    let mut mistyped = train;
    mistyped[5] = "brep-fac";
    fixture.check(&mistyped, 2, "did you mean `brep-face`?");
    assert_eq!(files.map(|file| fixture.read(file)), before);

    check_advice(&fixture, &train, "new run folder: ");
    assert!(fixture.path("run-brep-face/scores.jsonl").exists());
}

#[test]
fn a_reference_of_the_run_can_be_trained_on_later_by_the_advised_command() {
    let fixture = Fixture::new();
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "brep-face",
        "--out",
        "second",
        "--resume",
        "--set",
        r#"compare.references=["step-parts","brep-face"]"#,
    ];
    let mut first = train;
    first[5] = "step-parts";
    fixture.check(&first, 0, "");
    fixture.check(
        &train,
        2,
        r#"add it with --set 'compare.supervision=["step-parts", "brep-face"]'"#,
    );
    let both = r#"compare.supervision=["step-parts", "brep-face"]"#;
    let train = [&train[..], &["--set", both]].concat();
    check_advice(&fixture, &train, "in the folder first: ");
    fixture.check(&train, 0, "");
    assert!(
        fixture
            .path("second/checkpoints/brep-face-0/model.safetensors")
            .exists()
    );
}

/// Runs the command that follows this text in the message of a refused call, as a shell reads it.
#[track_caller]
fn check_advice(fixture: &Fixture, refused: &[&str], before: &str) {
    let refusal = fixture.command(refused).output().unwrap();
    let message = String::from_utf8_lossy(&refusal.stderr);
    let (_, advice) = message.trim_end().split_once(before).unwrap();
    let arguments = advice.strip_prefix("partprobe ").unwrap();
    let call = format!("'{}' {arguments}", env!("CARGO_BIN_EXE_partprobe"));
    let done = Command::new("sh")
        .args(["-c", &call])
        .current_dir(fixture.path(""))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{call}: {said}");
}

#[test]
fn settings_of_the_training_cannot_change_after_it() {
    let fixture = Fixture::new();
    let files = ["run/split.json", "run/config.toml", "run/scores.jsonl"];
    let before = files.map(|file| fixture.read(file));
    for (set, message) in [
        (
            "split.train=0.25",
            "split.train is 0.5 in this run and cannot become 0.25",
        ),
        (
            "split={ train = 0.2, valid = 0.2, test = 0.6, collection_separator = \"\", seed = 0 }",
            "split.test is 0.25",
        ),
        (
            "split.seed=7",
            "split.seed is 0 in this run and cannot become 7",
        ),
        ("select.max_parts=5", "select.max_parts is 20"),
        ("select.max_shapes=5", "select.max_shapes is 0"),
        ("sample.n_points=400", "sample.n_points is 500"),
        ("sample.seed=1", "sample.seed is 0"),
        (
            "label.theta_deg=20",
            "label.theta_deg is 8.0 in this run and cannot become 20.0",
        ),
        (
            "train.steps=9",
            "train.steps is 2 in this run and cannot become 9|make a new run folder",
        ),
        ("loss.pull_weight=3", "loss.pull_weight"),
        ("net.embedding_dim=64", "net.embedding_dim"),
        ("tokens.train_tokens=96", "tokens.train_tokens"),
    ] {
        let sets: Vec<&str> = if set == "split.train=0.25" {
            vec!["eval", "run", "--set", set, "--set", "split.test=0.5"]
        } else {
            vec!["eval", "run", "--set", set]
        };
        fixture.check(&sets, 2, message);
        assert!(
            files.map(|file| fixture.read(file)) == before,
            "{set} changed a file"
        );
    }
    for set in [
        "eval.restarts=2",
        "tokens.test_tokens=48",
        "eval.bootstrap=30",
        "eval.seed=3",
    ] {
        fixture.check(&["eval", "run", "--set", set], 0, "");
        assert_eq!(fixture.read("run/split.json"), before[0]);
    }
}

#[test]
fn a_config_that_was_changed_by_hand_does_not_fit_its_split() {
    let fixture = Fixture::new();
    let config = String::from_utf8(fixture.read("run/config.toml")).unwrap();
    let changed = config.replace("n_points = 500", "n_points = 501");
    assert_ne!(changed, config);
    fs::write(fixture.path("run/config.toml"), changed).unwrap();
    fixture.check(
        &["eval", "run"],
        2,
        "split.json was made with other settings|sample.n_points is 501, not 500",
    );
    fs::write(
        fixture.path("run/config.toml"),
        config.replace("steps = 2", "steps = 3"),
    )
    .unwrap();
    fixture.check(
        &["eval", "run"],
        1,
        "trained with other settings than this run's: train.steps is 2, not 3",
    );
    fs::write(fixture.path("run/config.toml"), config).unwrap();
    fs::remove_file(fixture.path("run/split.json")).unwrap();
    fixture.check(&["eval", "run"], 1, "no split.json");
    fixture.check(&RESUMED, 1, "trainings without their split.json");
}

#[test]
fn a_damaged_file_of_the_run_is_named_with_the_position_of_the_damage() {
    let fixture = Fixture::new();
    let whole = fixture.read("run/split.json");
    let advice = "put back a copy of the file, or make a new run folder";
    let damages: [(&[u8], &str); 6] = [
        (&whole[..whole.len() / 2], "the file ends too early"),
        (b"", "line 1, column 0: the file ends too early"),
        (
            b"{\n  \"format_version\": 3,\n  seed",
            "line 3, column 3: this is not JSON",
        ),
        (
            b"{\"format_version\": 3}",
            "a value is missing, or is of another kind than expected",
        ),
        (
            b"[]",
            "a value is missing, or is of another kind than expected",
        ),
        (b"{\"format_version\": \"\xff\"}", "this is not JSON"),
    ];
    for (bytes, reason) in damages {
        fs::write(fixture.path("run/split.json"), bytes).unwrap();
        let message = format!("run/split.json is damaged at line |{reason}|{advice}");
        fixture.check(&["eval", "run"], 1, &message);
        fixture.check(
            &[
                "run",
                "tiny.toml",
                "--data",
                "data",
                "--out",
                "run",
                "--resume",
            ],
            1,
            &message,
        );
    }
    fs::write(fixture.path("run/split.json"), b"{\"format_version\": 1}").unwrap();
    fixture.check(
        &["eval", "run"],
        1,
        "was written by another version of partprobe",
    );
    fs::write(fixture.path("run/split.json"), whole).unwrap();
    fs::write(fixture.path("run/data.json"), "\"da").unwrap();
    fixture.check(
        &["eval", "run"],
        1,
        "run/data.json is damaged at line 1, column 3: the file ends too early|--data",
    );
    fixture.check(&["eval", "run", "--data", "data"], 0, "");
}

#[test]
fn a_backbone_that_has_seen_a_test_shape_is_refused() {
    let fixture = Fixture::new();
    let scores = fixture.read("run/scores.jsonl");
    let test = fixture.side("run", "test");
    let other = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "other",
    ];
    fixture.check(&[&other[..], &["--set", "split.seed=3"]].concat(), 0, "");
    let seen = fixture
        .side("other", "train")
        .into_iter()
        .find(|id| test.contains(id))
        .unwrap();
    fixture.replace_training("other/checkpoints/step-parts-0");
    fixture.check(
        &["eval", "run"],
        1,
        &format!("{WEIGHTS}: |test shapes were in its training|{seen}"),
    );
    let resumed = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "run",
        "--resume",
    ];
    fixture.check(&resumed, 1, "was not trained on this run's shapes");
    assert_eq!(fixture.read("run/scores.jsonl"), scores);

    // The same shapes under other names, in other texts and in a data set of their own.
    copy_folder(&fixture.path("made/data/step"), &fixture.path("renamed"));
    for (idx, entry) in fs::read_dir(fixture.path("renamed")).unwrap().enumerate() {
        let path = entry.unwrap().path();
        // A comment makes another text of the same shape.
        let text =
            fs::read_to_string(&path)
                .unwrap()
                .replacen("DATA;", "DATA;\n/* another copy */", 1);
        fs::write(path.with_file_name(format!("n{idx}.step")), text).unwrap();
        fs::remove_file(path).unwrap();
    }
    let most = "split={ train = 0.8, valid = 0.1, test = 0.1 }";
    fixture.check(
        &[
            "run",
            "tiny.toml",
            "--data",
            "renamed",
            "--out",
            "elsewhere",
            "--set",
            most,
        ],
        0,
        "",
    );
    fixture.replace_training("elsewhere/checkpoints/step-parts-0");
    fixture.check(&["eval", "run"], 1, "test shapes were in its training");
}

/// Trains on `step-parts` into `out` from the weights of the run, or from others that `change` names.
#[track_caller]
fn check_started(fixture: &Fixture, out: &str, change: &[&str], code: i32, message: &str) {
    let from_run = r#"train.init="run/checkpoints/{source}-{seed}/model.safetensors""#;
    let train = ["train", "tiny.toml", "--data", "data", "--out", out];
    let mut args = [
        &train[..],
        &["--supervision", "step-parts", "--set", from_run],
    ]
    .concat();
    for set in change {
        args.extend(["--set", set]);
    }
    fixture.check(&args, code, message);
}

#[test]
fn a_training_starts_from_the_weights_of_another() {
    let fixture = Fixture::new();
    check_started(&fixture, "tuned", &[], 0, "");
    let tuned = fixture.read("tuned/checkpoints/step-parts-0/model.safetensors");
    assert_ne!(tuned, fixture.read(&format!("run/{WEIGHTS}")));

    // The weights say from which weights they come, and that is followed through every training.
    let two = r#"train.init="tuned/checkpoints/step-parts-0/model.safetensors""#;
    check_started(&fixture, "twice", &[two], 0, "");
    fixture.check(&["eval", "twice"], 0, "");

    let interrupted = ["train.steps=4", "train.checkpoint_every=1"];
    check_started(&fixture, "long", &interrupted, 0, "");
    let whole = fixture.read("long/checkpoints/step-parts-0/model.safetensors");
    assert_ne!(whole, tuned);
}

#[test]
fn weights_that_would_make_a_comparison_unfair_start_no_training() {
    let fixture = Fixture::new();
    let init = |path: &str| format!("train.init=\"{path}\"");
    check_started(
        &fixture,
        "split",
        &["split.seed=3"],
        1,
        "train.init: these weights cannot be used here|test shapes were in their training or validation",
    );
    check_started(
        &fixture,
        "net",
        &["net.embedding_dim=64"],
        1,
        "train.init: run/checkpoints/step-parts-0/model.safetensors|net.embedding_dim is 128 in the file and 64 here",
    );
    check_started(
        &fixture,
        "none",
        &[&init("nowhere.safetensors")],
        1,
        "train.init: nowhere.safetensors",
    );
    // A mistake that is found without the shapes leaves no folder.
    for out in ["net", "none"] {
        assert!(!fixture.path(out).exists(), "{out}");
    }
    // Nothing has started from the weights that were refused, so others may be named.
    let other = r#"train.init="run/checkpoints/step-parts-0/model.safetensors""#;
    fixture.check(
        &[
            "train",
            "tiny.toml",
            "--data",
            "data",
            "--supervision",
            "step-parts",
            "--out",
            "split",
            "--resume",
            "--set",
            "split.seed=3",
            "--set",
            other,
        ],
        1,
        "train.init: these weights cannot be used here",
    );

    let both = r#"compare.supervision=["step-parts", "brep-face"]"#;
    let fixed = init(&format!("run/{WEIGHTS}"));
    let train = ["train", "tiny.toml", "--data", "data", "--out", "both"];
    let faces = ["--supervision", "brep-face", "--set", both, "--set", &fixed];
    fixture.check(
        &[&train[..], &faces].concat(),
        1,
        "was trained on `step-parts`, and would start a training on `brep-face`|write {source} in the path",
    );
    // A run looks at the weights of all sources before it trains on the first.
    fixture.check(
        &[
            "run",
            "tiny.toml",
            "--data",
            "data",
            "--out",
            "all",
            "--set",
            both,
            "--set",
            &fixed,
        ],
        1,
        "would start a training on `brep-face`",
    );
    assert!(!fixture.path("all").exists());
}

#[test]
fn a_backbone_labels_the_shapes_that_it_has_not_seen() {
    let fixture = Fixture::new();
    let weights = format!("run/{WEIGHTS}");
    let check = ["check", "labels", &weights, "--data", "data", "--json"];
    let typed = [
        "--type",
        "backbone",
        "--set",
        "k=4",
        "--set",
        "cluster=ward-faces",
    ];
    let message = fixture.check(
        &[&check[..], &typed].concat(),
        1,
        "not every label could be joined",
    );
    let checked: Value = serde_json::from_str(&message).unwrap();

    let seen: BTreeSet<String> = ["train", "valid"]
        .into_iter()
        .flat_map(|side| fixture.side("run", side))
        .collect();
    let shapes = checked[0]["shapes"].as_array().unwrap();
    assert!(!shapes.is_empty());
    for shape in shapes {
        let is_seen = seen.contains(shape["id"].as_str().unwrap());
        let refused = shape.to_string().contains("was trained on this shape");
        assert_eq!(refused, is_seen, "{shape}");
    }
}

#[test]
fn a_run_is_repeated_from_its_folder() {
    let fixture = Fixture::new();
    for run in ["run", "made"] {
        let message = fixture.check(&["rerun", run, "--jobs", "1"], 0, "");
        assert!(message.contains(" compared, 0 of them differ"), "{message}");
    }
    // So is a run that was scored against other references later.
    let references = r#"compare.references=["step-parts","primitive"]"#;
    fixture.check(&["eval", "run", "--set", references], 0, "");
    let message = fixture.check(&["rerun", "run", "--out", "second"], 0, "");
    assert!(message.contains(" compared, 0 of them differ"), "{message}");

    // A training that the run does not have is not made up for.
    let left_out = "step-parts, seed 1: not trained yet, left out";
    fixture.check(
        &["eval", "run", "--set", "compare.seeds=[0, 1]"],
        0,
        left_out,
    );
    let without = "step-parts, seed 1: the run has no weights of it, so it is not trained";
    let message = fixture.check(&["rerun", "run", "--out", "one"], 0, without);
    assert!(message.contains(" compared, 0 of them differ"), "{message}");
    assert!(!fixture.path("one/checkpoints/step-parts-1").exists());
    fixture.check(&["eval", "run", "--set", "compare.seeds=[0]"], 0, "");

    // Weights record the settings of the evaluation, which `eval` may have changed.
    fixture.check(&["eval", "run", "--set", "tokens.test_tokens=50"], 0, "");
    let message = fixture.check(&["rerun", "run", "--out", "fewer"], 1, "");
    assert!(
        message.contains("in the settings that it records, not in its values: checkpoints/")
            && message.contains(", 1 of them differ"),
        "{message}"
    );
    fixture.check(
        &RESUMED,
        2,
        "change it in the folder first: partprobe eval run --set | --set tokens.test_tokens=",
    );

    // A prediction that was changed is noticed.
    let changed = fs::read_dir(fixture.path("run/predictions/untrained-0")).unwrap();
    let changed = changed.map(|entry| entry.unwrap().path()).min().unwrap();
    fs::write(&changed, "other").unwrap();
    let message = fixture.check(&["rerun", "run", "--out", "third"], 1, "");
    assert!(
        message.contains("differs: predictions/untrained-0/"),
        "{message}"
    );
    fixture.check(
        &["rerun", "run", "--set", "train.steps=3"],
        2,
        "unexpected argument '--set' found",
    );
    fixture.check(&["rerun", "data"], 2, "data is not a run folder");
}

#[test]
fn bounds_about_what_is_not_trained_yet_are_named() {
    let fixture = Fixture::new();
    let config = TINY.replace(
        r#"supervision = ["step-parts"]"#,
        r#"supervision = ["step-parts", "normal-kmeans-20"]"#,
    );
    let difference = "step-parts/step-parts.miou - normal-kmeans-20/step-parts.miou";
    let bounds = format!(
        "[expect]\n\"{difference}\" = \">= -1\"\n\"step-parts/step-parts.miou\" = \">= 0\"\n"
    );
    fs::write(fixture.path("pair.toml"), config + &bounds).unwrap();
    let train = |supervision: &str| {
        let given = [
            "--data",
            "data",
            "--supervision",
            supervision,
            "--out",
            "pair",
            "--resume",
        ];
        fixture.check(&[&["train", "pair.toml"][..], &given].concat(), 0, "");
    };
    train("step-parts");
    let message = format!("not checked: {difference} >= -1: not all of its label sources");
    let printed = fixture.check(&["eval", "pair"], 0, &message);
    assert!(
        printed.contains("holds: step-parts/step-parts.miou >= 0"),
        "{printed}"
    );
    fixture.check(&["report", "pair", "--html", "pair.html"], 0, "");
    train("normal-kmeans-20");
    let printed = fixture.check(&["eval", "pair"], 0, "");
    assert!(
        printed.contains(&format!("holds: {difference} >= -1")),
        "{printed}"
    );
}

#[test]
fn bounds_follow_from_several_seeds() {
    let fixture = Fixture::new();
    fixture.check(&["expect", "run"], 2, "one seed has no standard deviation");
    fixture.check(&["expect", "run", "./run"], 2, "./run is given twice");
    // A metric that is named twice is not two seeds.
    let twice = ["expect", "run", "--metrics", "miou,all,miou"];
    fixture.check(&twice, 2, "one seed has no standard deviation");
    for (set, message) in [
        (r#"split.manifest="gone.jsonl""#, "split.manifest: "),
        (
            r#"endpoints=[{name="other", data="gone"}]"#,
            "endpoints.other.data: ",
        ),
    ] {
        let run = [
            "run",
            "tiny.toml",
            "--data",
            "data",
            "--out",
            "early",
            "--set",
            set,
        ];
        fixture.check(&run, 2, message);
        assert!(!fixture.path("early").exists(), "{set}");
    }
    let seeds = [
        "--data",
        "data",
        "--out",
        "seeds",
        "--set",
        "compare.seeds=[0,1,2]",
    ];
    fixture.check(&[&["run", "tiny.toml"], &seeds[..]].concat(), 0, "");
    let bounds = fixture.check(&["expect", "seeds"], 0, "");
    let table: toml::Table = toml::from_str(&bounds).unwrap();
    let names: Vec<&String> = table["expect"].as_table().unwrap().keys().collect();
    assert_eq!(names.len(), 4, "{bounds}");
    let named = ["expect", "--from", "seeds", "--metrics"];
    let further = fixture.check(&[&named[..], &["ari,count_error"]].concat(), 0, "");
    let lines: Vec<&str> = further.lines().collect();
    assert!(
        matches!(lines[..], ["[expect]", ari, count]
            if ari.contains(r#".ari" = ">= 0."#) && count.contains(r#".count_error" = "<= "#)),
        "{further}"
    );
    fixture.check(
        &[&named[..], &["iou"]].concat(),
        2,
        "--metrics: `iou` is not a metric",
    );
    let further = fixture.check(&[&named[..], &["all"]].concat(), 0, "");
    assert!(
        bounds.lines().all(|line| further.contains(line)),
        "{further}"
    );
    let bounds = further;

    // The runs that they come from meet them.
    fs::write(fixture.path("bounded.toml"), format!("{TINY}\n{bounds}")).unwrap();
    let bounded = ["run", "bounded.toml", "--data", "data", "--out", "bounded"];
    fixture.check(&bounded, 0, "");
}

#[test]
fn runs_are_listed_and_reported_together() {
    let fixture = Fixture::new();
    copy_folder(&fixture.path("run"), &fixture.path("copy"));
    fs::remove_file(fixture.path("copy/scores.jsonl")).unwrap();
    let listed = fixture.check(&["runs", ".", "--json"], 0, "");
    let listed: Value = serde_json::from_str(&listed).unwrap();
    let states: Vec<[&str; 2]> = listed
        .as_array()
        .unwrap()
        .iter()
        .map(|run| ["run", "state"].map(|key| run[key].as_str().unwrap()))
        .collect();
    assert_eq!(
        states,
        [["copy", "trained"], ["made", "scored"], ["run", "scored"]]
    );
    assert!(listed[2]["miou"].as_f64().is_some(), "{listed}");
    let text = fixture.check(&["runs", "."], 0, "");
    assert!(text.contains("step-parts"), "{text}");

    let unscored = "left out: the run in copy has no scores; finish it with --resume";
    let report = fixture.check(&["report", "run", "copy"], 1, unscored);
    assert!(report.contains("| `run:step-parts` |"), "{report}");
    fixture.check(&["report", "copy"], 2, "the run in copy has no scores");
    fs::copy(
        fixture.path("run/scores.jsonl"),
        fixture.path("copy/scores.jsonl"),
    )
    .unwrap();
    let report = fixture.check(&["report", "run", "copy"], 0, "");
    for message in [
        "| `run:step-parts` |",
        "| `copy:step-parts` |",
        "| Δ `run:step-parts` − `copy:step-parts` | +0.000",
        "that all 2 runs were scored on.",
    ] {
        assert!(report.contains(message), "{message}: {report}");
    }
    assert_eq!(
        report.matches("| `untrained` |").count(),
        2,
        "once in each table: {report}"
    );
    fixture.check(&["report", "run", "run"], 2, "two runs are called run");

    // Settings that differ are listed.
    let config = String::from_utf8(fixture.read("copy/config.toml")).unwrap();
    let changed = config
        .replace("\nsteps = ", "\nsteps = 1")
        .replace("\nrestarts = ", "\nrestarts = 1");
    assert_ne!(config, changed);
    fs::write(fixture.path("copy/config.toml"), changed).unwrap();
    let report = fixture.check(&["report", "run", "copy"], 0, "");
    for message in [
        "were trained with different settings, in their order: train.steps (",
        "were scored with different settings: eval.restarts (",
    ] {
        assert!(report.contains(message), "{message}: {report}");
    }
    fs::write(fixture.path("copy/config.toml"), config).unwrap();

    // A table that lacks a run says so.
    let rows = fixture.read("copy/scores.jsonl");
    let rows = String::from_utf8(rows).unwrap();
    let other = rows.replace("\"clusterer\":\"k-means\"", "\"clusterer\":\"modes\"");
    assert_ne!(rows, other);
    fs::write(fixture.path("copy/scores.jsonl"), format!("{rows}{other}")).unwrap();
    let report = fixture.check(&["report", "run", "copy"], 0, "");
    assert!(
        report.contains("By modes, only copy was scored."),
        "{report}"
    );
    fs::write(fixture.path("copy/scores.jsonl"), rows).unwrap();

    // The same name and the same reference, but another mesh or other labels.
    let text = String::from_utf8(fixture.read("copy/split.json")).unwrap();
    let mut split: Value = serde_json::from_str(&text).unwrap();
    let id = split["test"][0].as_str().unwrap().to_owned();
    split["shapes"][&id]["content_hash"] = "other".into();
    fs::write(fixture.path("copy/split.json"), split.to_string()).unwrap();
    let report = fixture.check(&["report", "run", "copy"], 0, "");
    let message = "1 shape is left out, whose mesh or labels differ between the runs";
    assert!(report.contains(message), "{report}");
    for shape in split["shapes"].as_object_mut().unwrap().values_mut() {
        shape["content_hash"] = "other".into();
    }
    fs::write(fixture.path("copy/split.json"), split.to_string()).unwrap();
    fixture.check(
        &["report", "run", "copy"],
        1,
        "no test shape in common with the same mesh and the same labels",
    );
    // The tables of one run are those that it printed.
    let alone = fixture.check(&["report", "run"], 0, "");
    let tables = String::from_utf8(fixture.read("run/tables.md")).unwrap();
    assert!(alone.starts_with(tables.trim_end()), "{alone}");
}

/// Takes the faces out of the files of test shapes, which earlier versions did not store.
fn forget_faces(test: &Path) {
    for entry in fs::read_dir(test).unwrap() {
        let path = entry.unwrap().path();
        let members = arrays_from_npz(&fs::read(&path).unwrap()).unwrap();
        let names: Vec<&str> = members.names().collect();
        assert!(names.contains(&"face"), "{names:?}");
        let is_written_anew = |name: &&str| *name == "format_version";
        let kept = names
            .into_iter()
            .filter(|name| !name.starts_with("face") && !is_written_anew(name));
        let kept: Vec<(&str, Array)> = kept
            .map(|name| (name, members.array(name).unwrap().clone()))
            .collect();
        fs::write(&path, arrays_to_npz(&kept, Compression::Stored).unwrap()).unwrap();
    }
}

#[test]
fn the_page_of_a_run_is_written_again() {
    let fixture = Fixture::new();
    let page = |file: &str| fs::read_to_string(fixture.path(file)).unwrap();
    fixture.check(&["report", "run", "--html", "again.html"], 0, "");
    assert!(
        page("again.html") == page("run/report.html"),
        "the page differs"
    );
    assert!(
        page("again.html").contains("<section id=\"types\""),
        "types are known"
    );

    let charts = ["report", "run", "--charts", "made/charts"];
    fixture.check(&charts, 0, "");
    // Charts of two runs in one folder could not be distinguished.
    fixture.check(
        &charts,
        2,
        "is not empty; choose another folder, or replace",
    );
    fixture.check(&[&charts[..], &["--force"]].concat(), 0, "");
    for (chart, text) in [
        ("means", ">step-parts</text>"),
        ("numbers-of-parts", "reference parts (K)"),
        ("types-step-parts", "Trained on step-parts: % of the points"),
        ("scores-step-parts", "mIoU per shape: step-parts"),
    ] {
        let svg = page(&format!("made/charts/{chart}.svg"));
        assert!(
            svg.starts_with("<svg xmlns=") && svg.contains(text) && !svg.contains("var("),
            "{chart}: {svg}"
        );
    }

    // The faces of a run of an earlier version are those of the data set, or unknown.
    copy_folder(&fixture.path("run"), &fixture.path("old/run"));
    forget_faces(&fixture.path("old/run/test"));
    let old = ["report", "old/run", "--html", "old.html"];
    fixture.check(&[&old[..], &["--data", "data"]].concat(), 0, "");
    assert!(
        page("old.html") == page("run/report.html"),
        "the page differs"
    );
    fs::remove_file(fixture.path("old/run/data.json")).unwrap();
    fixture.check(&old, 0, "");
    let without = page("old.html");
    assert!(
        !without.contains("<section id=\"types\"") && without.contains("say with --data DATASET")
    );
    fixture.check(
        &["report", "run", "old/run", "--html", "x.html"],
        2,
        "name one run folder",
    );
    fixture.check(
        &["report", "run", "--data", "data"],
        2,
        "--html <FILE>|--charts <FOLDER>",
    );
}

#[test]
fn a_backbone_at_the_path_of_another_is_refused() {
    let fixture = Fixture::new();
    let train = |supervision: &str, seeds: &str, out: &str| {
        let sets = [
            r#"compare.supervision=["step-parts","normal-kmeans-20"]"#,
            seeds,
        ];
        let args = [
            "train",
            "tiny.toml",
            "--data",
            "data",
            "--supervision",
            supervision,
            "--out",
            out,
        ];
        fixture.check(
            &[&args[..], &["--set", sets[0], "--set", sets[1]]].concat(),
            0,
            "",
        );
    };
    train("normal-kmeans-20", "compare.seeds=[0]", "kmeans");
    let (own, record) = (
        fixture.read(&format!("run/{WEIGHTS}")),
        fixture.read("run/checkpoints/step-parts-0/training.json"),
    );
    let place = fixture.path("run").join(WEIGHTS);
    fixture.replace_training("kmeans/checkpoints/normal-kmeans-20-0");
    fixture.check(
        &["eval", "run"],
        1,
        "trained on `normal-kmeans-20` with seed 0, but its place is that of `step-parts`",
    );
    train("step-parts", "compare.seeds=[4]", "seeds");
    fixture.replace_training("seeds/checkpoints/step-parts-4");
    fixture.check(
        &["eval", "run"],
        1,
        "trained on `step-parts` with seed 4, but its place is that of",
    );
    fs::write(
        fixture.path("run/checkpoints/step-parts-0/training.json"),
        record,
    )
    .unwrap();
    fs::write(&place, &own[..own.len() / 2]).unwrap();
    fixture.check(&["eval", "run"], 1, WEIGHTS);
    fs::write(&place, own).unwrap();
    fixture.check(&["eval", "run"], 0, "");
}

#[test]
fn weights_that_were_changed_after_the_training_are_refused_by_name() {
    let fixture = Fixture::new();
    let (place, record) = (
        fixture.path("run").join(WEIGHTS),
        fixture.path("run/checkpoints/step-parts-0/training.json"),
    );
    let (own, scores) = (fs::read(&place).unwrap(), fixture.read("run/scores.jsonl"));
    let step = fs::read_dir(fixture.path("made/data/step"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let step = step.to_str().unwrap();
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "run",
        "--resume",
    ];
    let verbs = [
        &["eval", "run"][..],
        &["embed", "run", step, "--out", "embedded"],
        &train,
    ];

    // The last number of the last tensor: the file is as sound as before.
    let mut changed = own.clone();
    *changed.last_mut().unwrap() ^= 1;
    fs::write(&place, changed).unwrap();
    for args in verbs {
        fixture.check(
            args,
            1,
            &format!("run/{WEIGHTS} was changed after its training ended"),
        );
    }
    assert!(fixture.read("run/scores.jsonl") == scores);

    // A run of an earlier version has no hash.
    fs::write(&place, own).unwrap();
    let mut without_hash: Value = serde_json::from_slice(&fs::read(&record).unwrap()).unwrap();
    assert!(
        without_hash
            .as_object_mut()
            .unwrap()
            .remove("weights_sha256")
            .is_some()
    );
    fs::write(&record, without_hash.to_string()).unwrap();
    for args in verbs {
        fixture.check(
            args,
            0,
            &format!("warning: an earlier version of partprobe trained run/{WEIGHTS}"),
        );
    }
}

#[test]
fn a_run_keeps_its_original_shapes() {
    let fixture = Fixture::new();
    let test = fixture.side("run", "test")[0].clone();
    // Labeled again meanwhile, with other settings; then with the same ones and another content.
    fixture.check(
        &[
            "label",
            "made/data/step",
            "--out",
            "other",
            "--set",
            "label.theta_deg=20",
        ],
        0,
        "",
    );
    let message = "label.theta_deg is 8.0 in the config and 20.0 in the data set";
    fixture.check(&["eval", "run", "--data", "other"], 2, message);
    fixture.check(
        &["synth", "--out", "steps", "--seed", "5", "-n", "16"],
        0,
        "",
    );
    fs::rename(
        fixture.path("made/data/step"),
        fixture.path("made/data/old"),
    )
    .unwrap();
    fs::rename(fixture.path("steps"), fixture.path("made/data/step")).unwrap();
    fixture.check(&["label", "made/data/step", "--out", "another"], 0, "");
    let refused = |args: &[&str], message: &str| fixture.check(args, 1, message);
    refused(
        &["eval", "run", "--data", "another"],
        "make a new run folder",
    );
    let resumed = [
        "train",
        "tiny.toml",
        "--supervision",
        "step-parts",
        "--out",
        "run",
        "--resume",
        "--data",
    ];
    fs::remove_file(fixture.path("run").join(WEIGHTS)).unwrap();
    refused(
        &[&resumed[..], &["another"]].concat(),
        "make a new run folder",
    );
    fixture.check(&[&resumed[..], &["other"]].concat(), 2, "label.theta_deg");
    // A single shape that says something else than it did, by its file and by its index.
    let mut rows = fixture.lines("data/index.jsonl");
    let row = rows
        .iter_mut()
        .find(|row| row["id"] == test.as_str())
        .unwrap();
    let file = format!("data/{}", row["file"].as_str().unwrap());
    fixture.rewrite(&file, &["content_hash"], |labels| labels.reverse());
    row.as_object_mut().unwrap().remove("content_hash");
    let text: String = rows.iter().map(|row| format!("{row}\n")).collect();
    fs::write(fixture.path("data/index.jsonl"), text).unwrap();
    refused(
        &[&resumed[..], &["data"]].concat(),
        &format!("shape {test}"),
    );
}

#[test]
fn carriers_that_were_changed_cut_off_or_exchanged_are_named() {
    let fixture = Fixture::new();
    let rows = fixture.lines("data/index.jsonl");
    let ids: Vec<&str> = rows.iter().map(|row| row["id"].as_str().unwrap()).collect();
    assert!(
        rows.iter()
            .all(|row| row["content_hash"].as_str().unwrap().len() == 32)
    );
    let file = |idx: usize| {
        fixture
            .path("data")
            .join(rows[idx]["file"].as_str().unwrap())
    };
    fixture.check(&["status", "data"], 0, "");
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
    ];
    type Damage<'a> = (&'a str, &'a dyn Fn(), &'a str);
    let damages: [Damage<'_>; 5] = [
        (
            "labels",
            &|| {
                fixture.rewrite(
                    &format!("data/{}", rows[0]["file"].as_str().unwrap()),
                    &[],
                    |l| l.reverse(),
                )
            },
            "changed after",
        ),
        (
            "hash",
            &|| {
                let name = format!("data/{}", rows[0]["file"].as_str().unwrap());
                fixture.rewrite(&name, &["content_hash"], |labels| labels.reverse());
            },
            "changed after it was labeled",
        ),
        (
            "cut",
            &|| fs::write(file(0), &fs::read(file(0)).unwrap()[..900]).unwrap(),
            "NPZ",
        ),
        (
            "exchanged",
            &|| assert!(fs::copy(file(1), file(0)).is_ok()),
            "not of",
        ),
        ("missing", &|| fs::remove_file(file(0)).unwrap(), "reading"),
    ];
    let whole = fs::read(file(0)).unwrap();
    for (name, damage, message) in damages {
        damage();
        let out = |verb: &str| format!("{verb}-{name}");
        let stdout = fixture.check(
            &["status", "data"],
            1,
            "1 carrier of data is not the one that was labeled",
        );
        assert!(
            stdout.contains(ids[0]) && stdout.contains(message),
            "{name}: {stdout}"
        );
        fixture.check(&["status", "data", "--quick"], 0, "");
        fixture.check(
            &[&train[..], &[&out("train")]].concat(),
            1,
            &format!("{}|{message}", ids[0]),
        );
        for verb in [
            &["sample", "data", "--format", "npz", "--out"][..],
            &["export", "glb", "data", "--out"],
        ] {
            let output = fixture
                .command(&[verb, &[&out(verb[0])]].concat())
                .output()
                .unwrap();
            let stderr = String::from_utf8_lossy(&output.stderr);
            assert!(
                stderr.contains(ids[0]) && stderr.contains(message),
                "{name}, {}: {stderr}",
                verb[0]
            );
        }
        fs::write(file(0), &whole).unwrap();
    }
    fixture.check(&["status", "data"], 0, "");
}

#[test]
fn data_sets_of_earlier_versions_are_read() {
    let fixture = Fixture::new();
    let mut rows = fixture.lines("data/index.jsonl");
    for row in &mut rows {
        fixture.rewrite(
            &format!("data/{}", row["file"].as_str().unwrap()),
            &["content_hash"],
            |_| {},
        );
        row.as_object_mut().unwrap().remove("content_hash");
    }
    let text: String = rows.iter().map(|row| format!("{row}\n")).collect();
    fs::write(fixture.path("data/index.jsonl"), text).unwrap();
    let message = fixture.check(&["status", "data"], 0, "");
    assert!(
        message.contains("16 of an earlier version, without a hash"),
        "{message}"
    );
    // The content is the same, so its hash is also the same, although it is not recorded.
    let scores = fixture.read("run/scores.jsonl");
    fixture.check(&["eval", "run"], 0, "");
    assert_eq!(fixture.read("run/scores.jsonl"), scores);
}

#[test]
fn labels_of_the_config_and_of_the_data_set_must_agree() {
    let fixture = Fixture::new();
    fixture.check(
        &[
            "label",
            "made/data/step",
            "--out",
            "twenty",
            "--set",
            "label.theta_deg=20",
        ],
        0,
        "",
    );
    let run = ["run", "tiny.toml", "--data", "twenty", "--out"];
    let message = "label.theta_deg is 8.0 in the config and 20.0 in the data set";
    fixture.check(
        &[&run[..], &["said", "--set", "label.theta_deg=8"]].concat(),
        2,
        message,
    );
    assert!(!fixture.path("said").exists());
    fs::write(
        fixture.path("own.toml"),
        format!("{TINY}[label]\ntheta_deg = 8.0\n"),
    )
    .unwrap();
    let train = [
        "train",
        "own.toml",
        "--data",
        "twenty",
        "--supervision",
        "step-parts",
        "--out",
        "said",
    ];
    fixture.check(&train, 2, message);
    // What nobody has said is the data set's.
    fixture.check(&[&run[..], &["unsaid"]].concat(), 0, "");
    let config: toml::Table = String::from_utf8(fixture.read("unsaid/config.toml"))
        .unwrap()
        .parse()
        .unwrap();
    assert_eq!(config["label"]["theta_deg"].as_float(), Some(20.0));
    assert_eq!(config["data"]["source"].as_str(), Some("paths"));
    assert_eq!(
        fixture.json("unsaid/run.json")["data_set"]["label"]["theta_deg"],
        20.0
    );
    fixture.check(&["eval", "unsaid"], 0, "");
    fixture.check(&[&run[..], &["unsaid", "--resume"]].concat(), 0, "");
}

#[test]
fn the_number_of_shapes_is_taken_for_any_order_of_the_index() {
    let fixture = Fixture::new();
    let sides = |run: &str| ["train", "valid", "test"].map(|side| fixture.side(run, side));
    let chosen = |run: &str| {
        sides(run)
            .concat()
            .into_iter()
            .collect::<BTreeSet<String>>()
    };
    let train = |n: &str, jobs: &str, out: &str| {
        let args = [
            "train",
            "tiny.toml",
            "--data",
            "data",
            "--supervision",
            "step-parts",
            "--set",
            n,
            "--out",
            out,
        ];
        fixture.check(
            &[&args[..], &["--set", "train.steps=1", "--jobs", jobs]].concat(),
            0,
            "beyond select.max_shapes",
        );
    };
    train("select.max_shapes=8", "1", "a");
    let rows = fixture.lines("data/index.jsonl");
    let text: String = rows.iter().rev().map(|row| format!("{row}\n")).collect();
    fs::write(fixture.path("data/index.jsonl"), text).unwrap();
    train("select.max_shapes=8", "2", "b");
    assert_eq!(sides("a"), sides("b"));
    assert_eq!(chosen("a").len(), 8);
    assert_eq!(fixture.json("a/split.json")["selection"]["taking_part"], 8);
    train("select.max_shapes=5", "2", "c");
    assert!(chosen("c").len() == 5 && chosen("c").is_subset(&chosen("a")));
    let other = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "d",
    ];
    let sets = [
        "--set",
        "select.max_shapes=8",
        "--set",
        "split.seed=1",
        "--set",
        "train.steps=1",
    ];
    fixture.check(&[&other[..], &sets].concat(), 0, "");
    assert_ne!(chosen("d"), chosen("a"));
}

#[test]
fn two_at_once_in_one_folder_are_refused() {
    let fixture = Fixture::new();
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "run",
        "--resume",
    ];
    let lock = File::options()
        .write(true)
        .open(fixture.path("run/.lock"))
        .unwrap();
    lock.lock().unwrap();
    for args in [&RESUMED[..], &train, &["eval", "run"]] {
        fixture.check(args, 2, "another partprobe is working in run");
    }
    // A lock goes with its program, and the file that it leaves is in nobody's way.
    drop(lock);
    for args in [&RESUMED[..], &train, &["eval", "run"]] {
        fixture.check(args, 0, "");
    }
}

#[cfg(unix)]
#[test]
fn output_that_cannot_be_written_ends_with_1_and_leaves_no_mark_of_completion() {
    let fixture = Fixture::new();
    let program = env!("CARGO_BIN_EXE_partprobe");
    // The shell counts in blocks of 512 or 1024 bytes. Both limits are less than a checkpoint and more than a carrier.
    let limited = |blocks: u32, args: &str, message: &str| {
        let script = format!("ulimit -f {blocks}; exec {program} {args}");
        let output = Command::new("sh")
            .args(["-c", &script])
            .current_dir(fixture.root.path())
            .output()
            .unwrap();
        assert_outcome(&[args], &output, 1, message);
    };
    limited(
        1000,
        "run tiny.toml --data data --out full",
        "writing full/checkpoints/step-parts-0/last",
    );
    limited(
        1000,
        "train tiny.toml --data data --supervision step-parts --out full2",
        "writing full2/checkpoints",
    );
    for run in ["full", "full2"] {
        assert!(
            !fixture.path(run).join(WEIGHTS).exists()
                && !fixture.path(run).join("scores.jsonl").exists()
        );
    }
    // What is missing is made up for when there is room again.
    fixture.check(
        &[
            "run",
            "tiny.toml",
            "--data",
            "data",
            "--out",
            "full",
            "--resume",
        ],
        0,
        "",
    );
    assert_eq!(
        fixture.read(&format!("full/{WEIGHTS}")),
        fixture.read(&format!("run/{WEIGHTS}"))
    );

    let scores = fixture.read("run/scores.jsonl");
    limited(4, "eval run", "writing run/");
    assert!(!fixture.path("run/scores.jsonl").exists() && !fixture.path("run/tables.md").exists());
    fixture.check(&["eval", "run"], 0, "");
    assert_eq!(fixture.read("run/scores.jsonl"), scores);

    let step = fs::read_dir(fixture.path("made/data/step"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    limited(
        8,
        &format!("embed run {} no-such.step --out embedded", step.display()),
        "writing embedded/",
    );
    assert_eq!(fs::read_dir(fixture.path("embedded")).unwrap().count(), 0);

    // A file where a folder belongs: for the superuser too, nothing can be written there.
    fs::write(fixture.path("blocked"), "").unwrap();
    fixture.check(
        &["run", "tiny.toml", "--data", "data", "--out", "blocked/run"],
        1,
        "making blocked/run",
    );
    fixture.check(
        &[
            "embed",
            "run",
            step.to_str().unwrap(),
            "--out",
            "blocked/embedded",
        ],
        1,
        "making the folder blocked/embedded",
    );
    fs::remove_dir_all(fixture.path("run/predictions")).unwrap();
    fs::write(fixture.path("run/predictions"), "").unwrap();
    fixture.check(&["eval", "run"], 1, "run/predictions");
    assert!(!fixture.path("run/scores.jsonl").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_output_is_an_error_and_a_closed_pipe_is_not() {
    let fixture = Fixture::new();
    let step = fs::read_dir(fixture.path("made/data/step"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let missed = r#"expect."step-parts/step-parts.miou"=">= 1.01""#;
    let train = [
        "train",
        "tiny.toml",
        "--data",
        "data",
        "--supervision",
        "step-parts",
        "--out",
        "seeds",
    ];
    let embed = ["embed", "run", step.to_str().unwrap(), "--out", "embedded"];
    for args in [&["eval", "run"][..], &embed] {
        let output = fixture
            .command(args)
            .stdout(File::options().write(true).open("/dev/full").unwrap())
            .output()
            .unwrap();
        assert_outcome(args, &output, 1, "writing to stdout");
    }
    let without_reader = |args: &[&str], code: i32| {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        assert_outcome(
            args,
            &fixture.command(args).stdout(writer).output().unwrap(),
            code,
            "",
        );
    };
    // The exit code still tells of a missed expectation, and the second seed is trained.
    without_reader(&["eval", "run", "--set", missed], 3);
    without_reader(&[&train[..], &["--set", "compare.seeds=[0,1]"]].concat(), 0);
    assert!(
        fixture
            .path("seeds/checkpoints/step-parts-1/model.safetensors")
            .exists()
    );
}
