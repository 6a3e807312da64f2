//! Tests `partprobe run implicit` as a user runs it: files that do not depend on the number of threads or on an interruption, and
//! shapes that cannot be fitted.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod folder;
mod program;

use folder::contents;
use partprobe_synth::fixtures;
use program::check;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// A block, a plate with a chamfer, and a box without a lid, whose surface is open.
fn corpus() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("parts")).unwrap();
    for (name, text) in [
        ("block", fixtures::cuboid([4.0, 3.0, 2.0])),
        ("chamfered", fixtures::chamfered_block([4.0, 3.0, 1.5], 0.5)),
        ("open", fixtures::open_box([4.0, 3.0, 2.0])),
    ] {
        fs::write(folder.path().join(format!("parts/{name}.step")), text).unwrap();
    }
    check(folder.path(), &["label", "parts", "--out", "data"], 0, "");
    folder
}

/// A run with small numbers: two seeds of three arms.
fn run(folder: &Path, out: &str, more: &[&str], code: i32, error: &str) -> String {
    let small = [
        "implicit.trunk=siren-64x4",
        "implicit.iterations=60",
        "implicit.points=[192,192,96]",
        "implicit.resolution=32",
        "implicit.score_points=2000",
        "implicit.picture_size=64",
        "compare.seeds=[0,1]",
    ];
    let mut arguments = vec!["run", "implicit", "--data", "data", "--out", out];
    arguments.extend(small.iter().flat_map(|setting| ["--set", setting]));
    arguments.extend(more);
    check(folder, &arguments, code, error)
}

/// What a run has made, without the times.
fn results(run: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = contents(run);
    for file in ["log.jsonl", "run.json", ".lock"] {
        files.remove(Path::new(file));
    }
    files
}

/// Names the files in which two runs differ.
#[track_caller]
fn check_equal(expected: &BTreeMap<PathBuf, Vec<u8>>, found: &BTreeMap<PathBuf, Vec<u8>>) {
    let differing: Vec<_> = expected
        .keys()
        .chain(found.keys())
        .filter(|file| expected.get(*file) != found.get(*file))
        .collect();
    assert!(differing.is_empty(), "{differing:?}");
}

#[test]
fn a_run_is_the_same_for_any_threads_and_after_an_interruption() {
    let corpus = corpus();
    let message = run(
        corpus.path(),
        "one",
        &["--jobs", "1"],
        0,
        "warning: parts__open, step-parts, seed 0: the surface is not closed",
    );
    assert!(
        message.contains("2 of 3 shapes, 2 seeds") && message.contains("- parts__open: "),
        "{message}"
    );
    run(corpus.path(), "three", &["--jobs", "3"], 0, "");
    let (one, three) = (corpus.path().join("one"), corpus.path().join("three"));
    let expected = results(&one);
    for file in [
        "tables.md",
        "tables.json",
        "tables.csv",
        "report.html",
        "fits/parts__block/control-1.json",
        "meshes/parts__block/ward-20-0.ply",
        "pictures/parts__chamfered/step-parts.png",
    ] {
        assert!(expected.contains_key(Path::new(file)), "{file}");
    }
    check_equal(&expected, &results(&three));

    for file in [
        "tables.md",
        "fits/parts__block/control-1.json",
        "fits/parts__chamfered/step-parts-0.json",
        "meshes/parts__block/ward-20-0.ply",
    ] {
        fs::remove_file(three.join(file)).unwrap();
    }
    run(corpus.path(), "three", &["--resume"], 0, "");
    let mut resumed = results(&three);
    // Its fit was finished, so its mesh is not made again.
    let mesh = Path::new("meshes/parts__block/ward-20-0.ply").to_owned();
    resumed.insert(mesh.clone(), expected[&mesh].clone());
    check_equal(&expected, &resumed);
}

#[test]
fn a_run_without_backbones_is_listed_and_not_trained_or_scored() {
    let corpus = corpus();
    run(corpus.path(), "runs/faces", &[], 0, "");
    let listed = check(corpus.path(), &["runs"], 0, "");
    assert!(listed.contains("| faces | scored |"), "{listed}");

    let refusal = "it fits a network to each shape and trains no backbone";
    for arguments in [
        &[
            "train",
            "implicit",
            "--data",
            "data",
            "--supervision",
            "ward-20",
            "--out",
            "refused",
        ][..],
        &["eval", "runs/faces"],
        &["rerun", "runs/faces"],
    ] {
        check(corpus.path(), arguments, 2, refusal);
    }
    assert!(!corpus.path().join("refused").exists());
}

#[test]
fn impossible_settings_are_refused() {
    let corpus = corpus();
    for (setting, error) in [
        (
            "implicit.trunk=siren",
            "choose one of siren-256x4, siren-128x4",
        ),
        (
            "implicit.resolution=100",
            "implicit.resolution must be a multiple of 32",
        ),
        (
            "implicit.iterations=0",
            "implicit.iterations must be positive",
        ),
        ("implicit.points=[0,1,1]", "implicit.points"),
        (
            "implicit.learning_rate=0.0",
            "implicit.learning_rate must be positive",
        ),
    ] {
        run(corpus.path(), "refused", &["--set", setting], 2, error);
    }
    assert!(!corpus.path().join("refused").exists());
}
