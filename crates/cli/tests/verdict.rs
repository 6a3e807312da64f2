//! Tests `verdict` and `false-alarms` through the real program, on generated parts.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot read its own files has failed"
)]

mod program;

use program::check;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// Small shapes and networks: the trainings take seconds.
const SMALL: [&str; 12] = [
    "--jobs",
    "2",
    "--set",
    "sample.n_points=400",
    "--set",
    "tokens.train_tokens=48",
    "--set",
    "tokens.test_tokens=64",
    "--set",
    "eval.restarts=1",
    "--set",
    "split={ train = 0.4, valid = 0.1, test = 0.5 }",
];

fn generated_parts(folder: &Path, n: &str) {
    check(folder, &["synth", "-n", n, "--out", "parts"], 0, "");
    check(folder, &["label", "parts", "--out", "dataset"], 0, "");
}

#[test]
fn a_verdict_is_a_sentence_with_its_evidence_and_can_be_resumed() {
    let root = tempfile::tempdir().unwrap();
    generated_parts(root.path(), "40");
    let mut args = vec![
        "verdict",
        "--mine",
        "brep-face",
        "--data",
        "dataset",
        "--updates",
        "2",
        "--out",
        "v",
    ];
    args.extend(SMALL);

    let printed = check(root.path(), &args, 0, "");
    assert!(
        ["better: ", "worse: ", "cannot tell "]
            .iter()
            .any(|verdict| printed.starts_with(verdict)),
        "{printed}"
    );
    assert!(
        printed.contains("the mean over the referees `step-parts` and `brep-face`"),
        "{printed}"
    );

    let read = || -> Value {
        serde_json::from_slice(&fs::read(root.path().join("v/verdict.json")).unwrap()).unwrap()
    };
    let first = read();
    assert_eq!(first["updates"], 2);
    let looks = first["looks"].as_array().unwrap();
    assert!((1..=3).contains(&looks.len()));
    assert_eq!(looks[0]["difference"]["n_seeds"], 1);

    check(root.path(), &args, 2, "holds a verdict that was started");
    args.push("--resume");
    let again = check(root.path(), &args, 0, "");
    assert!(
        printed.contains("Δ mIoU ") && again.contains("Δ mIoU "),
        "{printed}\n{again}"
    );
    assert_eq!(read(), first);
}

#[test]
fn wrong_questions_are_refused() {
    let root = tempfile::tempdir().unwrap();
    generated_parts(root.path(), "4");
    let verdict =
        |more: &[&'static str]| [&["verdict", "--data", "dataset", "--out", "v"], more].concat();
    for (args, expected) in [
        (
            verdict(&["--mine", "step-parts"]),
            "`step-parts` is compared with itself",
        ),
        (
            verdict(&["--mine", "step-part"]),
            "there is no file or folder step-part, and `step-part` is not a label source",
        ),
        (
            verdict(&["--mine", "typo/"]),
            "there is no file or folder typo/; give an existing path of labels",
        ),
        (
            verdict(&["--mine", "brep-face", "--budget", "1"]),
            "is not a time",
        ),
        (verdict(&["--mine", "parts"]), "do not join to the shapes"),
    ] {
        check(root.path(), &args, 2, expected);
        assert!(!root.path().join("v").exists(), "{expected}");
    }
}

#[test]
fn data_that_cannot_decide_are_refused_before_a_training() {
    let root = tempfile::tempdir().unwrap();
    generated_parts(root.path(), "40");
    let verdict = |mine: &'static str, split: &'static str| {
        let mut args = vec!["verdict", "--mine", mine, "--data", "dataset", "--out", "v"];
        args.extend(SMALL);
        args.extend(["--set", split]);
        args
    };
    let half = "split={ train = 0.4, valid = 0.1, test = 0.5 }";
    let tenth = "split={ train = 0.8, valid = 0.1, test = 0.1 }";
    for (args, expected) in [
        (
            verdict("ward-20", tenth),
            "files or repositories, and a verdict needs at least 10. With this split, about ",
        ),
        (
            verdict("capped-step-parts", half),
            "`capped-step-parts` and `step-parts` label all ",
        ),
    ] {
        check(root.path(), &args, 2, expected);
        assert!(!root.path().join("v").exists(), "{expected}");
    }
}

#[test]
fn trainings_that_differ_only_in_their_seeds_are_counted() {
    let root = tempfile::tempdir().unwrap();
    generated_parts(root.path(), "40");
    let run = |out: &str, seeds: &str| {
        let seeds = format!("compare.seeds={seeds}");
        let mut args = vec![
            "run", "verdict", "--data", "dataset", "--out", out, "--set", &seeds,
        ];
        args.extend([
            "--set",
            "compare.supervision=[\"step-parts\"]",
            "--set",
            "train.steps=2",
        ]);
        args.extend(SMALL);
        check(root.path(), &args, 0, "");
    };
    run("aa", "[0, 1, 2, 3, 4, 5]");
    let expected = "of 3 pairs of trainings differ with p < 0.05";
    let printed = check(root.path(), &["false-alarms", "aa"], 0, "");
    assert!(printed.contains(expected), "{printed}");
    let json = check(root.path(), &["false-alarms", "aa", "--json"], 0, "");
    let found: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(found["n_seeds"], 6);

    run("few", "[0]");
    let expected = "six seeds and ten files are needed";
    check(root.path(), &["false-alarms", "few"], 2, expected);
}
