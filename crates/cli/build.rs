//! Tells the program the commit from which it is built, for `--version`, the records of runs and the lines below tables.
//!
//! `PARTPROBE_COMMIT` in the environment has priority. Without it, git is asked, but only if this folder is `crates/cli/` of a
//! repository: a copy of the package in another repository must not name that repository's commit. Otherwise, the commit is unknown.

use std::path::PathBuf;
use std::process::Command;

const VARIABLE: &str = "PARTPROBE_COMMIT";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed={VARIABLE}");
    let given = std::env::var(VARIABLE)
        .ok()
        .filter(|commit| !commit.is_empty());
    if let Some(commit) = given.or_else(commit_of_repository) {
        println!("cargo:rustc-env={VARIABLE}={commit}");
    }
}

/// The commit that is checked out. Cargo runs this program again after the next commit.
fn commit_of_repository() -> Option<String> {
    if git(&["rev-parse", "--show-prefix"])? != "crates/cli/" {
        return None;
    }
    let log = PathBuf::from(git(&["rev-parse", "--git-path", "logs/HEAD"])?);
    // Cargo runs this program each time if a file in this list does not exist.
    if log.is_file() {
        println!("cargo:rerun-if-changed={}", log.display());
    }
    git(&["rev-parse", "HEAD"])
}

/// What git prints, without the end of the line. It is called in the folder of the package.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().to_owned())
}
