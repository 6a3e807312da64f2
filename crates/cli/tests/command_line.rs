//! Tests the verbs about the program itself as a user calls them: configs, completions, manual pages, and the groups of the help.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod program;

use program::{check, program};
use std::fs;
use std::path::Path;

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
fn a_wrong_value_is_found_by_the_check_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    // Each text begins in line 3.
    for (text, error) in [
        (
            "[sources.mine]\ntype = \"faces\"\npath = \"x\"\nby = \"stepid\"",
            "line 6: sources.mine: `by` is `stepid`; it must be one of auto, step-id, name, order, name-is-label; did you mean `step-id`?",
        ),
        (
            "[sources.mine]\ntype = \"faces\"",
            "line 4: sources.mine: type `faces` needs the key `path`; set it",
        ),
        (
            "[sources.mine]\ntype = \"mesh\"\npath = \"x\"\nby = \"indexx\"",
            "line 6: sources.mine: `by` is `indexx`",
        ),
        (
            "[sources.mine]\ntype = \"points\"\npath = \"x\"\nmax_distance = 9",
            "line 6: sources.mine: `max_distance` is `9`; it must be a number from 0 to 1",
        ),
        (
            "[sources.mine]\ntype = \"partfield\"\npath = \"x\"\nk = \"most\"",
            "line 6: sources.mine: `k` is `most`",
        ),
        (
            "[sources.mine]\ntype = \"onnx\"\npath = \"x\"\npoints = \"many\"",
            "line 6: sources.mine: `points` is `many`",
        ),
        (
            "[sources.mine]\ntype = \"faces\"\npath = [\"x\"]",
            "line 3: sources.mine: a key has a value that is not a text in quotes",
        ),
        (
            "[sources.mine]\ntype = \"face\"\npath = \"x\"",
            "line 4: sources.mine.type: `face` is not a type of label file",
        ),
        (
            "[sources.mine]\npath = \"x\"",
            "line 3: sources.mine: missing field `type`; the keys of such a table have no defaults",
        ),
        (
            "[sources.step-parts]\ntype = \"faces\"\npath = \"x\"",
            "line 3: sources.step-parts has the name of a built-in label source",
        ),
        (
            "[[endpoints]]\nname = \"T1\"\nposition_noise = 3.0",
            "line 5: endpoints.T1.position_noise must be from 0 to 1",
        ),
        (
            "[[endpoints]]\nname = \"T1\"\nreferences = [\"steps\"]",
            "line 5: endpoints.T1: `steps` is not a label source",
        ),
        (
            "[[endpoints]]\nname = \"T1\"\n[[endpoints]]\nname = \"T2\"\nshapes = \"some\"",
            "line 7: endpoints[1].shapes: unknown variant `some`",
        ),
        (
            "[sources.mine]\ntype = \"faces\"\npath = 3",
            "line 5: sources.mine: `path` must be a text in quotes",
        ),
        (
            "[sources.mine]\ntype = \"mesh\"\npath = \"x\"\nmeshes = \"\"",
            "line 6: sources.mine: `meshes` is empty; name a file or folder",
        ),
        (
            "[sources.\"my labels\"]\ntype = \"faces\"\npath = \"x\"",
            "line 3: sources.my labels: a name consists of the letters a to z",
        ),
    ] {
        check_config(path, text, error);
    }
}

#[cfg(feature = "train")]
#[test]
fn what_a_run_would_refuse_is_found_by_the_check_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (text, error) in [
        (
            "[compare]\nprimary = [\"a/b\"]",
            "line 4: compare.primary: `a/b` is not an endpoint",
        ),
        (
            "[compare]\nprimary = [\"step-part.miou\"]",
            "line 4: compare.primary names `step-part.miou`, but nothing is scored against `step-part`, only against step-parts, \
             normal-kmeans-20; did you mean `step-parts`?",
        ),
        (
            "[compare]\nprimary = [\"step-parts.miu\"]",
            "count_error; did you mean `miou`?",
        ),
        (
            "[expect]\nmiou = \">= 0.5\"",
            "line 4: expect: `miou` does not name a score",
        ),
        (
            "[expect]\n\"step-part/step-parts.miou\" = \">= 0.5\"",
            "line 4: expect: `step-part/step-parts.miou` names `step-part`",
        ),
        (
            "[expect]\n\"step-parts/step-parts.miu\" = \">= 0.5\"",
            "did you mean `miou`?",
        ),
        (
            "[expect]\n\"step-parts/step-parts.miou\" = 0.5",
            "line 4: expect.step-parts/step-parts.miou: invalid type",
        ),
        (
            "[train]\nfreeze = [\"stemm\"]",
            "line 4: train.freeze: the network has no part `stemm`; did you mean `stem`?",
        ),
    ] {
        check_config(path, text, error);
    }
}

#[test]
fn a_wrong_key_in_the_file_is_not_blamed_on_another_assignment() {
    let folder = tempfile::tempdir().unwrap();
    let text = "base = \"base\"\n[sources.mine]\ntype = \"faces\"\nby = \"ordered\"\n";
    fs::write(folder.path().join("mine.toml"), text).unwrap();
    let check_set = |set: &str, error: &str| {
        let arguments = ["config", "check", "mine.toml", "--set", set];
        check(folder.path(), &arguments, 2, error);
    };
    check_set(
        "sources.mine.path=x",
        "error: mine.toml, line 4: sources.mine: `by` is `ordered`",
    );
    check_set(
        "sources.mine.by=stepid",
        "error: --set sources.mine.by=stepid: sources.mine: `by`",
    );
}

#[test]
fn the_assignments_that_the_config_probe_advises_are_valid() {
    let folder = tempfile::tempdir().unwrap();
    let probe = check(
        folder.path(),
        &["config", "show", "probe", "--source"],
        0,
        "",
    );
    let comment: Vec<&str> = probe.lines().take_while(|l| l.starts_with('#')).collect();
    let comment = comment.join(" ");
    let assignments = comment
        .split("--set '")
        .skip(1)
        .filter_map(|rest| rest.split_once('\''));
    let mut arguments = vec!["config", "check", "probe"];
    arguments.extend(assignments.flat_map(|(assignment, _)| ["--set", assignment]));
    assert_eq!(arguments.len(), 9, "{comment}");
    check(folder.path(), &arguments, 0, "");
}

#[track_caller]
fn check_config(folder: &Path, text: &str, error: &str) {
    fs::write(
        folder.join("mine.toml"),
        format!("base = \"base\"\n\n{text}\n"),
    )
    .unwrap();
    check(folder, &["config", "check", "mine.toml"], 2, error);
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
