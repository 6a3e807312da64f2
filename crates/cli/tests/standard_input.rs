//! Tests what the real program reads from the standard input, and the form of the tables that it prints.

#![allow(
    clippy::unwrap_used,
    reason = "a helper of a test may panic like the test itself"
)]

mod program;

use partprobe_synth::fixtures;
use program::{check, index, program};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Stdio;

/// Runs the program with these bytes as standard input; stdout, or stderr if it fails, must contain the text.
#[track_caller]
fn check_piped(folder: &Path, arguments: &str, bytes: &[u8], code: i32, text: &str) {
    let words: Vec<&str> = arguments.split_whitespace().collect();
    let mut command = program(folder, &words);
    command.stdin(Stdio::piped());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    // A program that refuses its arguments does not read.
    let _ = child.stdin.take().unwrap().write_all(bytes);
    let output = child.wait_with_output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said);
    assert_eq!(output.status.code(), Some(code), "{arguments}: {said}");
    assert!(
        said.contains(text),
        "{arguments}: `{text}` is not in {said}"
    );
}

#[test]
fn a_file_may_come_from_another_program() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let step = fixtures::cylinder(3.0, 4.0, fixtures::FullTurn::Halved);
    let step = step.as_bytes();
    let mesh = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    check_piped(path, "inspect -", step, 0, "cylinder");
    check_piped(path, "inspect -", mesh, 0, "mesh of 1 triangle");
    check_piped(path, "label - --out d", step, 0, "1 labeled");
    assert_eq!(index(&path.join("d"))[0]["id"], "stdin");
    check_piped(
        path,
        "label - --out n --stdin-name bracket",
        step,
        0,
        "1 labeled",
    );
    let row = &index(&path.join("n"))[0];
    assert_eq!(
        (&row["id"], &row["source"]),
        (&"bracket".into(), &"bracket.step".into())
    );
    check_piped(
        path,
        "label - --out n --stdin-name bracket --resume",
        step,
        0,
        "1 labeled",
    );
    check_piped(path, "label - --out m", mesh, 0, "1 labeled");
    check_piped(
        path,
        "render - -o a.png --size 64",
        step,
        0,
        "1 shape drawn",
    );
    check_piped(
        path,
        "sample - --out s --format npz --n-points 10",
        step,
        0,
        "1 of 1 shape sampled",
    );
    check_piped(
        path,
        "sources step-parts brep-face --data -",
        step,
        0,
        "| `step-parts` | 1 |",
    );
    fs::write(path.join("a.step"), step).unwrap();
    check_piped(path, "label --list - --out l", b"a.step\n", 0, "1 labeled");
}

#[test]
fn what_cannot_be_read_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (arguments, bytes, code, text) in [
        ("inspect -", &b""[..], 1, "the standard input is empty"),
        ("label - --out d", b"", 1, "the standard input is empty"),
        (
            "inspect -",
            b"hello",
            1,
            "the standard input: the file is not a STEP file",
        ),
        ("label - --out e", b"hello", 1, "no file could be labeled"),
        ("label - - --out d", b"", 2, "`-` is given twice"),
        (
            "label - --list - --out d",
            b"",
            2,
            "as a file and as a list",
        ),
        (
            "label - --out d --stdin-name a/b",
            b"x",
            2,
            "is not the name of a file",
        ),
        (
            "label . --out d --stdin-name a",
            b"",
            2,
            "the standard input, which is not read",
        ),
        (
            "run smoke --data - --out r",
            b"x",
            2,
            "`-` is the standard input, and this argument is a file or a folder",
        ),
        (
            "score -",
            b"hello",
            1,
            "the standard input: not a readable NPZ archive",
        ),
        (
            "config check -",
            b"base = \"probe\"\n[train]\nstepz = 3\n",
            2,
            "standard input, line 3: train.stepz: unknown field",
        ),
        (
            "config check - --set train.steps=5",
            b"base = \"probe\"\n",
            0,
            "every key and value is valid",
        ),
    ] {
        check_piped(path, arguments, bytes, code, text);
    }
    assert!(!path.join("d").exists());
}

#[test]
fn tables_are_markdown_in_a_pipe_unless_text_is_requested() {
    let folder = tempfile::tempdir().unwrap();
    let piped = check(folder.path(), &["config", "list"], 0, "");
    assert!(
        piped.starts_with("| config | about |\n|---|---|\n| base |"),
        "{piped}"
    );
    let markdown = check(
        folder.path(),
        &["config", "list", "--tables", "markdown"],
        0,
        "",
    );
    assert_eq!(markdown, piped);
    let text = check(
        folder.path(),
        &["config", "list", "--tables", "text"],
        0,
        "",
    );
    assert!(text.starts_with("config") && !text.contains('|'), "{text}");
    let json = check(
        folder.path(),
        &["sources", "--json", "--tables", "text"],
        0,
        "",
    );
    assert!(serde_json::from_str::<serde_json::Value>(&json).is_ok());
}
