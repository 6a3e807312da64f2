//! Tests golden runs of the real program on a tiny config: the same bytes for any number of threads, resumed or not,
//! scores that anybody can compute again, and expectations that decide the exit code.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

use partprobe_formats::arrays_from_npz;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Sixteen parts, four updates, small tokens: seconds, but every stage is there.
const TINY: &str = r#"
base = "base.toml"
[data]
source = "synth"
[synth]
n = 16
max_parts = 12
[net]
refine = { type = "mean-shift", kappa = 20.0, steps = 3 }
[sample]
n_points = 800
[split]
train = 0.5
valid = 0.25
test = 0.25
[tokens]
train_tokens = 64
test_tokens = 96
[train]
steps = 4
batch_shapes = 2
valid_every = 2
checkpoint_every = 1
[eval]
clusterers = ["k-means", "average-link"]
restarts = 3
bootstrap = 50
embeddings = true
"#;

fn program(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_partprobe"))
        .args(args)
        .output()
        .unwrap()
}

#[track_caller]
fn run_tiny(folder: &Path, out: &str, more: &[&str]) -> (PathBuf, Output) {
    let config = folder.join("tiny.toml");
    fs::write(&config, TINY).unwrap();
    let out = folder.join(out);
    let mut args = vec![
        "run",
        config.to_str().unwrap(),
        "--out",
        out.to_str().unwrap(),
    ];
    args.extend(more);
    let output = program(&args);
    (out, output)
}

#[track_caller]
fn assert_code(output: &Output, code: i32) {
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{message}\n{}",
        String::from_utf8_lossy(&output.stdout)
    );
}

/// Every file of a run whose bytes may depend on nothing but config and data.
fn reproducible_files(root: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut open = vec![root.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path
                .strip_prefix(root)
                .unwrap()
                .to_string_lossy()
                .into_owned();
            let is_timed = name.starts_with("tensorboard")
                || ["run.json", "log.jsonl", "report.html", "timing.jsonl"]
                    .iter()
                    .any(|timed| name.ends_with(timed));
            match path.is_dir() {
                true => open.push(path),
                false if is_timed => {}
                false => {
                    files.insert(name, fs::read(&path).unwrap());
                }
            }
        }
    }
    files
}

#[track_caller]
fn assert_same_files(a: &Path, b: &Path) {
    let (a, b) = (reproducible_files(a), reproducible_files(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(b[name] == *bytes, "{name} differs");
    }
}

#[test]
fn threads_and_resuming_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let (one, output) = run_tiny(folder.path(), "one", &["--jobs", "1"]);
    assert_code(&output, 0);
    let (two, output) = run_tiny(folder.path(), "two", &["--jobs", "2"]);
    assert_code(&output, 0);
    assert_same_files(&one, &two);

    // What a killed run leaves: a checkpoint before the end, no weights, no scores.
    let (_, output) = run_tiny(folder.path(), "two", &["--jobs", "2"]);
    assert_code(&output, 2);
    for lost in [
        "checkpoints/normal-kmeans-20-0/model.safetensors",
        "scores.jsonl",
        "tables.md",
    ] {
        fs::remove_file(two.join(lost)).unwrap();
    }
    let (_, output) = run_tiny(folder.path(), "two", &["--resume"]);
    assert_code(&output, 0);
    assert_same_files(&one, &two);
    scores_follow_from_the_files(&one);
    weights_alone_embed_like_the_run(&one);
}

/// The layer `net.refine` is in the file of weights, too, so both ways give the same bytes, and others than the head.
#[track_caller]
fn weights_alone_embed_like_the_run(run: &Path) {
    let shape = fs::read_dir(run.join("test")).unwrap().next().unwrap();
    let shape = shape.unwrap().path();
    let embedded = |model: &Path, out: &str| {
        let out = run.join(out);
        let arguments = [model, &shape, Path::new("--out"), &out];
        let arguments = arguments.map(|argument| argument.to_str().unwrap());
        let output = program(&[&["embed"], &arguments[..]].concat());
        assert_code(&output, 0);
        fs::read(out.join(shape.file_name().unwrap())).unwrap()
    };
    let of_run = embedded(run, "by-run");
    let weights = run.join("checkpoints/step-parts-0/model.safetensors");
    assert!(of_run == embedded(&weights, "by-weights"));

    let head = Path::new("embeddings/step-parts-0").join(shape.file_name().unwrap());
    let [head, refined] =
        [fs::read(run.join(head)).unwrap(), of_run].map(|bytes| arrays_from_npz(&bytes).unwrap());
    assert!(head.array("token_of_point") == refined.array("token_of_point"));
    assert!(head.array("embeddings") != refined.array("embeddings"));
}

/// Computes accuracy again from `test/` and `predictions/` alone, by exhaustive search over the matchings of small cases.
#[track_caller]
fn scores_follow_from_the_files(root: &Path) {
    let mut n_checked: BTreeMap<String, usize> = BTreeMap::new();
    for line in fs::read_to_string(root.join("scores.jsonl"))
        .unwrap()
        .lines()
    {
        let row: serde_json::Value = serde_json::from_str(line).unwrap();
        let text = |key: &str| row[key].as_str().unwrap().to_owned();
        let member = match text("clusterer").as_str() {
            "k-means" => format!("predicted_{}", text("reference")),
            "mean-shift+k-means" => format!("predicted_{}__mean-shift+k-means", text("reference")),
            _ => continue,
        };
        if row["k"].as_u64().unwrap() > 6 {
            continue;
        }
        let reference = text("reference");
        let labels = integers(
            &root.join(format!("test/{}.npz", text("shape"))),
            &format!("reference_{reference}"),
        );
        let predictions = root.join(format!(
            "predictions/{}-{}/{}.npz",
            text("supervision"),
            row["seed"],
            text("shape")
        ));
        let clusters = integers(&predictions, &member);
        let accuracy = best_agreement(&labels, &clusters) as f64 / labels.len() as f64;
        assert!(
            (accuracy - row["accuracy"].as_f64().unwrap()).abs() < 1e-12,
            "{line}: {accuracy}"
        );
        *n_checked.entry(text("clusterer")).or_insert(0) += 1;
    }
    assert!(
        n_checked.len() == 2 && n_checked.values().all(|&n| n >= 8),
        "too few rows were small enough to check: {n_checked:?}"
    );
}

fn integers(path: &Path, member: &str) -> Vec<i32> {
    let mut members = arrays_from_npz(&fs::read(path).unwrap()).unwrap();
    members.vector::<i32>(member).unwrap()
}

/// The most points that any one-to-one assignment of clusters to labels can make agree.
fn best_agreement(labels: &[i32], clusters: &[i32]) -> usize {
    fn best(counts: &[Vec<usize>], row: usize, used: &mut Vec<bool>) -> usize {
        if row == counts.len() {
            return 0;
        }
        let mut most = best(counts, row + 1, used);
        for column in 0..used.len() {
            if !used[column] {
                used[column] = true;
                most = most.max(counts[row][column] + best(counts, row + 1, used));
                used[column] = false;
            }
        }
        most
    }
    let size = |ids: &[i32]| *ids.iter().max().unwrap() as usize + 1;
    let mut counts = vec![vec![0; size(clusters)]; size(labels)];
    for (&label, &cluster) in labels.iter().zip(clusters) {
        counts[label as usize][cluster as usize] += 1;
    }
    counts.retain(|row| row.iter().any(|&count| count > 0));
    best(&counts, 0, &mut vec![false; size(clusters)])
}

#[test]
fn separate_stages_give_the_same_result_as_run() {
    let folder = tempfile::tempdir().unwrap();
    let (run, output) = run_tiny(folder.path(), "run", &[]);
    assert_code(&output, 0);
    let scores = fs::read(run.join("scores.jsonl")).unwrap();
    fs::remove_file(run.join("scores.jsonl")).unwrap();
    assert_code(&program(&["eval", run.to_str().unwrap()]), 0);
    assert_eq!(fs::read(run.join("scores.jsonl")).unwrap(), scores);

    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (config, data, staged) = (path("tiny.toml"), path("run/data/carriers"), path("staged"));
    let train = |supervision: &str, more: &[&str]| {
        let fixed = [
            "train",
            &config,
            "--data",
            &data,
            "--out",
            &staged,
            "--supervision",
            supervision,
        ];
        assert_code(&program(&[&fixed[..], more].concat()), 0);
    };
    train("step-parts", &[]);
    train("normal-kmeans-20", &["--resume"]);
    assert_code(&program(&["eval", &staged]), 0);
    assert_eq!(
        fs::read(Path::new(&staged).join("scores.jsonl")).unwrap(),
        scores
    );

    let step = fs::read_dir(run.join("data/step"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let output = program(&[
        "embed",
        &staged,
        step.to_str().unwrap(),
        "--out",
        &path("embedded"),
    ]);
    assert_code(&output, 0);
    let file = String::from_utf8(output.stdout).unwrap();
    let members = arrays_from_npz(&fs::read(file.trim()).unwrap()).unwrap();
    assert_eq!(members.array("embeddings").unwrap().shape()[1], 128);
    assert_eq!(members.array("token_of_point").unwrap().shape(), [800]);
}

#[test]
fn a_run_is_resumed_with_its_original_data() {
    let folder = tempfile::tempdir().unwrap();
    let (out, output) = run_tiny(folder.path(), "run", &["--data", "no-such-folder"]);
    assert_code(&output, 2);
    assert!(!out.exists(), "a mistyped path left a folder behind");
    let (_, output) = run_tiny(folder.path(), "run", &[]);
    assert_code(&output, 0);
    let steps = out.join("data/step");
    let (_, output) = run_tiny(
        folder.path(),
        "run",
        &["--resume", "--data", steps.to_str().unwrap()],
    );
    assert_code(&output, 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("resume with the same"));
}

#[test]
fn a_missed_expectation_is_named_and_ends_in_3() {
    let folder = tempfile::tempdir().unwrap();
    let expect = r#"expect."step-parts/step-parts.miou"=">= 1.01""#;
    let (missed, output) = run_tiny(folder.path(), "missed", &["--set", expect]);
    assert_code(&output, 3);
    let message = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        message.contains("missed: ") && message.contains("step-parts/step-parts.miou"),
        "{message}"
    );
    let outcomes = fs::read(missed.join("expectations.json")).unwrap();
    let outcomes: serde_json::Value = serde_json::from_slice(&outcomes).unwrap();
    assert_eq!(outcomes[0]["bound"], "step-parts/step-parts.miou >= 1.01");
    assert_eq!(outcomes[0]["passed"], false);
    let report = fs::read_to_string(missed.join("expectations.xml")).unwrap();
    assert!(report.contains("tests=\"1\" failures=\"1\""), "{report}");
}

/// Executes the commands of the example workflow that call partprobe, on a folder as its first lines ask for.
#[test]
fn the_example_workflow_trains_and_keeps_files_that_exist() {
    let workflow = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/training_gate.yml");
    let workflow = fs::read_to_string(workflow).unwrap();
    let lines = || workflow.lines().map(str::trim);
    let commands: Vec<&str> = lines()
        .filter_map(|line| line.strip_prefix("run: partprobe "))
        .collect();
    assert_eq!(commands.len(), 2, "the workflow has other steps now");

    let folder = tempfile::tempdir().unwrap();
    let call = |arguments: &str| {
        Command::new(env!("CARGO_BIN_EXE_partprobe"))
            .args(arguments.split(' '))
            .current_dir(folder.path())
            .output()
            .unwrap()
    };
    assert_code(&call("synth --out parts -n 16 --max-parts 12 --quiet"), 0);
    let bound = "[expect]\n\"step-parts/step-parts.miou\" = \">= 0.0\"\n";
    fs::write(folder.path().join("gate.toml"), format!("{TINY}{bound}")).unwrap();
    for command in commands {
        assert_code(&call(command), 0);
    }
    let kept: Vec<&str> = lines().filter(|line| line.starts_with("run/")).collect();
    assert!(!kept.is_empty());
    for file in kept {
        assert!(folder.path().join(file).is_file(), "no {file}");
    }
}

#[test]
fn wrong_usage_is_refused_before_any_work() {
    let folder = tempfile::tempdir().unwrap();
    for (set, expected) in [
        ("train.stepz=1", "stepz"),
        ("compare.supervision=[\"partfield\"]", "partfield"),
        (r#"expect."step-parts/step-parts.mioo"=">= 0.5""#, "mioo"),
    ] {
        let (out, output) = run_tiny(folder.path(), "refused", &["--set", set]);
        assert_code(&output, 2);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains(expected), "{message}");
        assert!(!out.join("data").exists(), "work was done for {set}");
    }
    assert_code(&program(&["run"]), 2);
    assert_code(&program(&["run", "smoke", "--jobs", "0"]), 2);
    assert_code(&program(&["run", "no-such-config"]), 2);
}
