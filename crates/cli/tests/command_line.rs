//! Tests the verbs about the program itself as a user calls them: configs, completions, manual pages, and the groups of the help.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod program;

use program::{check, program};
use std::fs;

#[test]
fn a_config_builds_on_others_and_an_error_names_its_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(
        path.join("lower.toml"),
        "base = \"probe\"\n\n[train]\nsteps = 77\n",
    )
    .unwrap();
    fs::write(
        path.join("upper.toml"),
        "base = \"lower.toml\"\n[label]\ntheta_deg = 12.5\n",
    )
    .unwrap();

    let shown = check(path, &["config", "show", "upper.toml"], 0, "");
    // One value of each layer: the file, its base, the shipped config below that, and the defaults.
    for value in [
        "theta_deg = 12.5",
        "steps = 77",
        "cell_exchange = true",
        "embedding_dim = 128",
    ] {
        assert!(shown.lines().any(|line| line == value), "{value}\n{shown}");
    }
    fs::write(path.join("shown.toml"), &shown).unwrap();
    assert_eq!(check(path, &["config", "show", "shown.toml"], 0, ""), shown);
    check(path, &["config", "check", "upper.toml"], 0, "");

    for (text, error) in [
        (
            "base = \"probe\"\n[train]\nstepz = 3\n",
            "lower.toml, line 3: train.stepz: unknown field",
        ),
        (
            "base = \"probe\"\n[train]\nsteps = \"many\"\n",
            "lower.toml, line 3: train.steps: invalid type",
        ),
        (
            "base = \"upper.toml\"\n",
            "builds on itself; remove a `base`",
        ),
    ] {
        fs::write(path.join("lower.toml"), text).unwrap();
        check(path, &["config", "check", "upper.toml"], 2, error);
    }
    check(
        path,
        &["config", "show", "smok"],
        2,
        "did you mean `smoke`?",
    );
}

#[test]
fn shipped_configs_are_listed_and_printed_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let listed = check(folder.path(), &["config", "list"], 0, "");
    assert!(
        listed
            .lines()
            .any(|line| line == "| hour | An hour of training for one label source |"),
        "{listed}"
    );
    for line in listed.lines().skip(2) {
        let name = line.split(' ').nth(1).unwrap();
        let source = check(folder.path(), &["config", "show", name, "--source"], 0, "");
        assert!(source.starts_with("# "), "{source}");
    }
}

#[test]
fn completions_and_manual_pages_are_written() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = check(folder.path(), &["completions", shell], 0, "");
        assert!(
            script.contains("false-alarms") || cfg!(not(feature = "train")),
            "{shell}"
        );
        assert!(script.contains("retry"), "{shell}");
    }
    check(folder.path(), &["man", "--out", "man1"], 0, "");
    let page = fs::read_to_string(folder.path().join("man1/partprobe-label.1")).unwrap();
    assert!(
        page.starts_with(".ie") && page.contains("\\-\\-retry"),
        "{page}"
    );
    assert!(!folder.path().join("man1/partprobe-worker.1").exists());
}

#[test]
fn the_help_lists_verbs_in_groups_and_breaks_lines_at_the_width_of_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    for width in [60_usize, 100] {
        let output = program(folder.path(), &["--help"])
            .env("COLUMNS", width.to_string())
            .output()
            .unwrap();
        let help = String::from_utf8(output.stdout).unwrap();
        let listed = help.split("\nOptions:").next().unwrap();
        assert!(listed.contains("\nLabel STEP files:\n  label  "), "{help}");
        let widest = listed
            .lines()
            .map(|line| line.chars().count())
            .max()
            .unwrap();
        assert!(
            (width - 20..=width.max(100)).contains(&widest),
            "{widest}\n{help}"
        );
    }
}

#[test]
fn quiet_work_prints_only_results_and_warnings() {
    let folder = tempfile::tempdir().unwrap();
    check(
        folder.path(),
        &["synth", "--out", "steps", "-n", "4"],
        0,
        "",
    );
    fs::write(folder.path().join("steps/not-step.step"), "nothing").unwrap();
    let stderr_of = |more: &[&str]| {
        let fixed = [
            "sources",
            "step-parts",
            "brep-face",
            "--data",
            "steps",
            "--shapes",
            "2",
            "--out",
        ];
        let output = program(folder.path(), &[&fixed[..], more].concat())
            .output()
            .unwrap();
        assert!(!output.stdout.is_empty());
        String::from_utf8(output.stderr).unwrap()
    };
    let note = "2 left out: beyond --shapes";
    let loud = stderr_of(&["loud"]);
    assert!(loud.contains(note), "{loud}");
    let quiet = stderr_of(&["quiet", "--quiet"]);
    assert!(!quiet.contains(note), "{quiet}");
    let kept = |text: &str| {
        text.lines()
            .filter(|line| line.starts_with("warning:"))
            .count()
    };
    assert_eq!(kept(&quiet), kept(&loud));
}
