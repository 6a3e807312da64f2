//! Runs the real program in a folder, and reads the index of the data set that it wrote.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// The program, with a folder to run in.
pub(crate) fn program(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_partprobe"));
    command.args(arguments).current_dir(folder);
    command
}

/// Runs the program and expects this exit code; the error must contain the text.
#[track_caller]
pub(crate) fn check(folder: &Path, arguments: &[&str], code: i32, error: &str) -> String {
    let Output {
        status,
        stdout,
        stderr,
    } = program(folder, arguments).output().unwrap();
    let stderr = String::from_utf8_lossy(&stderr);
    assert_eq!(status.code(), Some(code), "{arguments:?}: {stderr}");
    assert!(
        stderr.contains(error) && !stderr.contains("panicked"),
        "{arguments:?}: {stderr}"
    );
    String::from_utf8(stdout).unwrap()
}

/// The lines of a data set's index.
#[allow(dead_code, reason = "each test binary uses what it needs")]
pub(crate) fn index(folder: &Path) -> Vec<serde_json::Value> {
    let text = fs::read_to_string(folder.join("index.jsonl")).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}
