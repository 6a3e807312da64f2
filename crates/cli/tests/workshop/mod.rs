//! A folder with a tiny finished training, and the real program in it.
#![allow(dead_code, reason = "each test binary uses what it needs")]

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

/// Parts that the program generates, one supervision, small tokens.
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
valid_every = 2
checkpoint_every = 1
[eval]
restarts = 1
bootstrap = 20
"#;

/// A folder with the config and, as `data`, its labeled parts.
pub(crate) struct Workshop {
    root: tempfile::TempDir,
}

impl Workshop {
    pub(crate) fn empty() -> Self {
        Self {
            root: tempfile::tempdir().unwrap(),
        }
    }

    pub(crate) fn new() -> Self {
        let shop = Self::empty();
        fs::write(shop.path("tiny.toml"), TINY).unwrap();
        let output = shop.program(&["run", "tiny.toml", "--out", "first"]);
        assert_code(&output, 0);
        shop
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.root.path().join(name)
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_partprobe"));
        command
            .args(args)
            .current_dir(self.root.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    pub(crate) fn program(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }
}

#[track_caller]
pub(crate) fn assert_code(output: &Output, code: i32) {
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{told}\n{}",
        String::from_utf8_lossy(&output.stdout)
    );
}
