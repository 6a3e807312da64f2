//! Tests the messages for users who make a mistake: one line on stderr, the right exit code, and no files left behind. Also tests
//! what happens to work that cannot be written.

#![cfg(unix)]
#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod program;

use partprobe_synth::{SynthSettings, fixtures, part};
use program::{check, index, program};
use std::fs;
use std::path::Path;
use std::process::Stdio;

/// `steps/` with parts, and a data set of them.
fn parts() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let steps = folder.path().join("steps");
    fs::create_dir(&steps).unwrap();
    let settings = SynthSettings {
        seed: 3,
        min_parts: 3,
        max_parts: 12,
    };
    for index in 0..12 {
        fs::write(
            steps.join(format!("p{index:02}.step")),
            part(&settings, index).step,
        )
        .unwrap();
    }
    check(folder.path(), &["label", "steps", "--out", "d"], 0, "");
    folder
}

/// Runs the program with files of this many KiB at most, and gives its exit code and what it said on stderr.
fn limited(folder: &Path, kib: u64, arguments: &[&str]) -> (i32, String) {
    // The shell counts in blocks of 512 bytes; a write beyond the limit fails, as on a full disk.
    let script = format!("trap '' XFSZ; ulimit -f {}; exec \"$@\"", kib * 2);
    let shell = ["-c", &script, "sh", env!("CARGO_BIN_EXE_partprobe")];
    let output = std::process::Command::new("sh")
        .args(shell)
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap();
    (
        output.status.code().unwrap(),
        String::from_utf8_lossy(&output.stderr).into_owned(),
    )
}

#[test]
fn what_cannot_be_written_ends_the_work_without_a_mark_of_completeness() {
    let folder = parts();
    let path = folder.path();
    let points = ["--points", "20000"];
    for (arguments, mark) in [
        (
            vec!["label", "steps", "--out", "o", "--emit", "points"],
            "o/index.jsonl",
        ),
        (
            vec!["sample", "d", "--out", "o", "--format", "npz"],
            "o/none",
        ),
        (
            vec!["sample", "steps", "--out", "o", "--format", "ply"],
            "o/none",
        ),
        (vec!["export", "glb", "d", "--out", "o"], "o/shapes.jsonl"),
        (vec!["export", "ply", "d", "--out", "o"], "o/shapes.jsonl"),
        (vec!["export", "obj", "d", "--out", "o"], "o/shapes.jsonl"),
        (vec!["export", "parts", "d", "--out", "o"], "o/shapes.jsonl"),
        (
            [
                vec!["export", "pointcept", "d", "--out", "o"],
                points.to_vec(),
            ]
            .concat(),
            "o/shapes.jsonl",
        ),
        (
            vec!["render", "d", "-o", "o/x.png", "--size", "600"],
            "o/x.png",
        ),
        (
            vec!["synth", "--out", "o", "-n", "200", "--min-parts", "20"],
            "o/none",
        ),
    ] {
        if arguments[0] == "render" {
            fs::create_dir(path.join("o")).unwrap();
        }
        let (code, said) = limited(path, 4, &arguments);
        assert_eq!(code, 1, "{arguments:?}: {said}");
        assert!(
            said.contains("writing ") && said.contains("free some space"),
            "{arguments:?}: {said}"
        );
        assert!(
            !said.contains("panicked") && !path.join(mark).exists(),
            "{arguments:?}: {said}"
        );
        let _ = fs::remove_dir_all(path.join("o"));
    }
}

#[test]
fn an_unwritable_stdout_fails_and_an_unwritable_stderr_does_not() {
    let folder = parts();
    let path = folder.path();
    let full = || {
        Stdio::from(
            fs::OpenOptions::new()
                .write(true)
                .open("/dev/full")
                .unwrap(),
        )
    };
    for arguments in [
        vec!["inspect", "steps/p00.step"],
        vec!["status", "d"],
        vec!["models"],
    ] {
        let code = program(path, &arguments)
            .stdout(full())
            .stderr(Stdio::null())
            .status()
            .unwrap()
            .code();
        assert_eq!(code, Some(1), "{arguments:?}");
    }
    fs::write(path.join("steps/bad.step"), "no STEP").unwrap();
    let sample = [
        "sample",
        "steps",
        "--out",
        "s",
        "--format",
        "npz",
        "--n-points",
        "10",
    ];
    let code = program(path, &sample)
        .stdout(Stdio::null())
        .stderr(full())
        .status()
        .unwrap()
        .code();
    assert_eq!(code, Some(0));
    let code = program(path, &["inspect", "gone"])
        .stderr(full())
        .status()
        .unwrap()
        .code();
    assert_eq!(code, Some(2));
}

#[test]
fn mistakes_are_reported_on_one_line_before_any_work() {
    let folder = parts();
    let path = folder.path();
    fs::write(path.join("file"), "x").unwrap();
    fs::write(path.join("x.npz"), "x").unwrap();
    fs::create_dir(path.join("empty")).unwrap();
    for (arguments, code, words) in [
        ("label gone --out o", 2, "gone does not exist"),
        ("label empty --out o", 2, "there is no .step"),
        ("label steps --out file", 2, "file is a file, not a folder"),
        (
            "label steps --out /dev/null",
            2,
            "/dev/null is a file, not a folder",
        ),
        (
            "label steps --out o --layers foo",
            2,
            "error: --layers: label.layers: ",
        ),
        (
            "synth --out o -n 3 --min-parts 1",
            2,
            "error: --min-parts: synth.min_parts",
        ),
        (
            "sample steps --out file --format npz",
            2,
            "file is a file, not a folder",
        ),
        (
            "export ply steps --out file",
            2,
            "file is a file, not a folder",
        ),
        ("synth --out file -n 3", 2, "file is a file, not a folder"),
        ("label steps --out d", 2, "--force"),
        ("label steps --out file/o", 1, "file/o"),
        ("inspect gone", 2, "gone does not exist"),
        ("inspect steps", 2, "steps is a folder"),
        ("inspect file", 1, "file: the file is"),
        (
            "render steps -o x.gif",
            2,
            "pictures are written as PNG, SVG or PDF",
        ),
        (
            "render steps -o x.jpg",
            2,
            "pictures are written as PNG, SVG or PDF",
        ),
        (
            "render steps -o x",
            2,
            "pictures are written as PNG, SVG or PDF",
        ),
        ("render steps -o gone/x.png", 2, "its folder does not exist"),
        ("render empty -o x.png", 2, "there is no .step"),
        ("sample gone --out o --format npz", 2, "gone does not exist"),
        ("sample empty --out o --format npz", 2, "there is no .step"),
        ("sample steps --out d --format npz", 2, "is not empty"),
        ("export ply gone --out o", 2, "gone does not exist"),
        ("export ply steps --out d", 2, "is not empty"),
        ("status gone", 2, "gone is not a data set; make one with"),
        ("status empty", 2, "empty is not a data set; make one with"),
        (
            "merge gone --out o",
            2,
            "gone is not a data set; make one with",
        ),
        (
            "train base --supervision step-parts --data empty --out o",
            2,
            "empty is not a data set; make one with",
        ),
        (
            "check labels steps --data empty",
            2,
            "empty is not a data set; make one with",
        ),
        (
            "inspect x.npz",
            2,
            "`inspect` reads STEP files; `render` and `export` read carriers",
        ),
        (
            "check pointcept empty",
            2,
            "has no shape in train, val or test",
        ),
        ("verify --reference gone steps", 2, "gone"),
        ("verify --reference file gone", 2, "gone is not a folder"),
        ("calibrate gone", 2, "gone does not exist"),
        ("synth --out d -n 3", 2, "is not empty"),
        ("synth --out o -n 0", 2, "-n"),
    ] {
        let words_of: Vec<&str> = arguments.split(' ').collect();
        let output = program(path, &words_of).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
        assert!(said.contains(words), "{arguments}: {said}");
        let n_lines = said.lines().filter(|line| !line.is_empty()).count();
        assert!(
            n_lines == 1 || said.contains("--help"),
            "{arguments}: {said}"
        );
        assert!(
            output.stdout.is_empty() && !path.join("o").exists(),
            "{arguments}"
        );
    }
}

#[test]
fn config_errors_name_the_position_the_allowed_values_and_the_nearest_key() {
    let folder = parts();
    let path = folder.path();
    let mine = |text: &str| fs::write(path.join("mine.toml"), text).unwrap();
    let with_file = ["label", "steps", "--out", "o", "--config", "mine.toml"];
    for (text, words) in [
        (
            "base = \"base\"\n[label]\n\ntehta_deg = 9\n",
            &[
                "mine.toml, line 4: label.tehta_deg",
                "did you mean `label.theta_deg`?",
                "`tau_min`",
            ][..],
        ),
        (
            "base = \"base\"\n[compare]\nsupervision = [\"step-part\"]\n",
            &[
                "mine.toml, line 3: compare.supervision: `step-part` is not a label source",
                "did you mean `step-parts`?",
            ],
        ),
        (
            "base = \"base\"\n[labl]\ntheta_deg = 9\n",
            &["mine.toml, line 2: labl", "did you mean `label`?"],
        ),
        (
            "base = \"base\"\n[train]\ntheta_deg = 9\n",
            &["mine.toml, line 3", "did you mean `label.theta_deg`?"],
        ),
        (
            "base = \"base\"\n[label]\nunit = \"solids\"\n",
            &["mine.toml, line 3: label.unit", "did you mean `solid`?"],
        ),
        (
            "base = \"base\"\n[label]\ntau_min = \"many\"\n",
            &[
                "mine.toml, line 3: label.tau_min",
                "a whole number from 0 up",
            ],
        ),
        (
            "base = \"base\"\nlabel.theta_deg = 900\n",
            &["mine.toml, line 2: label.theta_deg must be from 0 to 180"],
        ),
        (
            "base = \"base\"\n[label]\ntheta_deg = = 3\n",
            &["mine.toml, line 3"],
        ),
        (
            "base = \"base\"\n[label]\nemit = [\"carier\"]\n",
            &["mine.toml, line 3", "did you mean `carrier`?"],
        ),
        (
            "[label]\nunit = \"file\"\n",
            &[
                "mine.toml, line 1: label: missing field",
                "at the top of the file",
            ],
        ),
        (
            "base = \"gone\"\n",
            &["mine.toml, line 1: `base = \"gone\"`"],
        ),
    ] {
        mine(text);
        for words in words {
            check(path, &with_file, 2, words);
        }
    }
    for (assignment, words) in [
        (
            "label.thet_deg=9",
            "--set label.thet_deg=9: label.thet_deg: unknown field `thet_deg`",
        ),
        ("label.thet_deg=9", "did you mean `label.theta_deg`?"),
        (
            "label.theta_deg=900",
            "--set label.theta_deg=900: label.theta_deg must be from 0 to 180",
        ),
        (
            "label.theta_deg",
            "--set label.theta_deg: expected key=value, for example",
        ),
        ("a b=5", "--set a b=5: `a b` is not a key"),
        (
            "split.train=0.9",
            "--set split.train=0.9: split: train, valid and test must add up to 1",
        ),
        ("label.unit=files", "did you mean `file`?"),
    ] {
        check(
            path,
            &["label", "steps", "--out", "o", "--set", assignment],
            2,
            words,
        );
    }
    check(
        path,
        &["label", "steps", "--out", "o", "--config", "bsae"],
        2,
        "did you mean `base`?",
    );
    // The file's own base is looked through, too.
    fs::write(path.join("below.toml"), "[label]\ntheta_dge = 9\n").unwrap();
    mine("base = \"below.toml\"\n");
    check(path, &with_file, 2, "below.toml, line 2: label.theta_dge");
    assert!(!path.join("o").exists());
}

#[test]
fn ctrl_c_ends_with_130_and_with_advice_that_exists() {
    let folder = parts();
    let path = folder.path();
    let settings = SynthSettings {
        seed: 4,
        min_parts: 20,
        max_parts: 40,
    };
    for index in 0..20 {
        fs::write(
            path.join(format!("steps/q{index:02}.step")),
            part(&settings, index).step,
        )
        .unwrap();
    }
    let fine = [
        "--set",
        "label.angle_rad=0.03",
        "--set",
        "label.chord_fraction=0.0001",
    ];
    for (arguments, words) in [
        (
            vec!["label", "steps", "--out", "o", "--jobs", "1"],
            "continue with --resume",
        ),
        (
            vec!["export", "ply", "steps", "--out", "e", "--jobs", "1"],
            "nothing was written",
        ),
    ] {
        let arguments = [arguments, fine.to_vec()].concat();
        let child = program(path, &arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let journal = if arguments[0] == "label" {
            "o/.unfinished.jsonl"
        } else {
            "e/.labelled/.unfinished.jsonl"
        };
        while !path.join(journal).exists() {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        assert!(
            std::process::Command::new("kill")
                .args(["-INT", &child.id().to_string()])
                .status()
                .unwrap()
                .success()
        );
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(130), "{said}");
        assert!(said.contains(words), "{said}");
    }
    assert!(!path.join("e").exists());
    check(
        path,
        &[&["label", "steps", "--out", "o", "--resume"][..], &fine].concat(),
        0,
        "",
    );
    assert_eq!(index(&path.join("o")).len(), 32);
}

#[test]
fn reasons_keep_their_numbers_where_all_agree() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::create_dir(path.join("d")).unwrap();
    fs::write(path.join("d/a.step"), fixtures::cuboid([3.0, 4.0, 5.0])).unwrap();
    for name in ["b", "c"] {
        fs::write(path.join(format!("d/{name}.step")), "hello").unwrap();
    }
    let summary = check(path, &["label", "d", "--out", "o"], 0, "");
    assert!(
        summary.contains(
            "  2 failed: the file is not a STEP file: it does not begin with ISO-10303-21\n"
        ),
        "{summary}"
    );
    assert!(
        check(path, &["status", "o"], 0, "").contains("| d/b.step | the file is not a STEP file")
    );
}

#[test]
fn sentences_of_the_help_break_where_the_width_ends() {
    let folder = tempfile::tempdir().unwrap();
    let help = |arguments: &[&str]| check(folder.path(), &[arguments, &["--help"]].concat(), 0, "");
    let verbs = help(&[]);
    // A verb has two blanks before its name, and the rest of its sentence has more.
    let names: Vec<&str> = verbs
        .lines()
        .take_while(|line| *line != "Options:")
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(
        names.contains(&"label") && names.contains(&"embed"),
        "{names:?}"
    );
    for name in names.iter().filter(|name| **name != "help") {
        let text = help(&[name]);
        let lines: Vec<&str> = text.lines().collect();
        assert!(
            lines.iter().all(|line| line.chars().count() <= 100),
            "{text}"
        );
        let is_prose =
            |line: &str| !line.is_empty() && !line.starts_with(' ') && !line.starts_with("Example");
        for pair in lines
            .windows(2)
            .filter(|pair| is_prose(pair[0]) && is_prose(pair[1]))
        {
            let next = pair[1].split_whitespace().next().unwrap();
            let would_fit = pair[0].chars().count() + 1 + next.chars().count() <= 100;
            assert!(
                !would_fit || pair[0].ends_with(['.', ':']),
                "{name}: {} / {}",
                pair[0],
                pair[1]
            );
        }
    }
}
