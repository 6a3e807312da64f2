//! The cross-check of the CPU backend: the same checkpoint says the same through burn-ndarray.
#![cfg(feature = "ndarray")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

use partprobe_formats::{Values, arrays_from_npz};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const TINY: &str = r#"
base = "base.toml"
[data]
source = "synth"
[synth]
n = 14
max_parts = 8
[sample]
n_points = 600
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
steps = 6
batch_shapes = 2
[eval]
restarts = 1
bootstrap = 20
"#;

/// A folder with a finished run, `first`.
struct Fixture {
    root: tempfile::TempDir,
}

impl Fixture {
    fn new() -> Self {
        let fixture = Self {
            root: tempfile::tempdir().unwrap(),
        };
        fs::write(fixture.path("tiny.toml"), TINY).unwrap();
        fixture.program(&["run", "tiny.toml", "--out", "first"], 0);
        fixture
    }

    fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    #[track_caller]
    fn program(&self, args: &[&str], code: i32) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_partprobe"));
        let output = command
            .args(args)
            .current_dir(self.root.path())
            .output()
            .unwrap();
        assert_eq!(
            output.status.code(),
            Some(code),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        output
    }

    /// The mIoU of each shape of the run.
    fn scores(&self) -> Vec<f64> {
        let text = fs::read_to_string(self.path("first/scores.jsonl")).unwrap();
        let rows = text
            .lines()
            .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
        rows.filter(|row| row["supervision"] == "step-parts")
            .map(|row| row["miou"].as_f64().unwrap())
            .collect()
    }
}

fn embeddings(file: &Path) -> Vec<f32> {
    match arrays_from_npz(&fs::read(file).unwrap())
        .unwrap()
        .array("embeddings")
        .unwrap()
        .values()
    {
        Values::F32(values) => values.clone(),
        _ => Vec::new(),
    }
}

fn mean(scores: &[f64]) -> f64 {
    scores.iter().sum::<f64>() / scores.len() as f64
}

#[test]
fn the_ndarray_backend_scores_and_embeds_the_same_checkpoint_alike() {
    let fixture = Fixture::new();
    let shape = fs::read_dir(fixture.path("first/data/step"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let embed = |backend: &str| {
        let args = [
            "embed",
            "first",
            shape.to_str().unwrap(),
            "--backend",
            backend,
            "--out",
            backend,
        ];
        let output = fixture.program(&args, 0);
        let written = String::from_utf8(output.stdout).unwrap();
        embeddings(&fixture.path(written.lines().next().unwrap()))
    };
    let (flex, ndarray) = (embed("flex"), embed("ndarray"));
    assert!(!flex.is_empty() && flex.len() == ndarray.len());
    let apart = flex
        .iter()
        .zip(ndarray)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(apart < 1e-4, "{apart}");

    let flex = fixture.scores();
    fixture.program(&["eval", "first", "--backend", "ndarray"], 0);
    assert!(!flex.is_empty() && (mean(&flex) - mean(&fixture.scores())).abs() < 0.005);
}

#[test]
fn a_run_is_not_resumed_on_ndarray() {
    let fixture = Fixture::new();
    let output = fixture.program(
        &[
            "run",
            "tiny.toml",
            "--out",
            "first",
            "--resume",
            "--backend",
            "ndarray",
        ],
        2,
    );
    assert!(String::from_utf8_lossy(&output.stderr).contains("resume with the same"));
}
