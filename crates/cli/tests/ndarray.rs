//! Tests the CPU backend against burn-ndarray: the same checkpoint says the same.
#![cfg(feature = "ndarray")]
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

mod fixture;

use fixture::{Fixture, assert_code};
use partprobe_formats::{Values, arrays_from_npz};
use std::fs;
use std::path::Path;

/// The mIoU of each shape of the run.
fn scores(fixture: &Fixture) -> Vec<f64> {
    let text = fs::read_to_string(fixture.path("first/scores.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|row| row["supervision"] == "step-parts")
        .map(|row| row["miou"].as_f64().unwrap())
        .collect()
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
        let output = fixture.program(&args);
        assert_code(&output, 0);
        let written = String::from_utf8(output.stdout).unwrap();
        embeddings(&fixture.path(written.lines().next().unwrap()))
    };
    let (flex, ndarray) = (embed("flex"), embed("ndarray"));
    assert!(!flex.is_empty() && flex.len() == ndarray.len());
    let difference = flex
        .iter()
        .zip(ndarray)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(difference < 1e-4, "{difference}");

    let flex = scores(&fixture);
    assert_code(
        &fixture.program(&["eval", "first", "--backend", "ndarray"]),
        0,
    );
    assert!(!flex.is_empty() && (mean(&flex) - mean(&scores(&fixture))).abs() < 0.005);
}

#[test]
fn a_run_is_not_resumed_on_ndarray() {
    let fixture = Fixture::new();
    let args = [
        "run",
        "tiny.toml",
        "--out",
        "first",
        "--resume",
        "--backend",
        "ndarray",
    ];
    let output = fixture.program(&args);
    assert_code(&output, 2);
    assert!(String::from_utf8_lossy(&output.stderr).contains("resume with the same"));
}
