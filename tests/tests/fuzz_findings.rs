//! Labels every text again that a fuzz target has stumbled over: none may panic, and each ends soon.

// The same labeling as the fuzz targets', which stand in a workspace of their own.
#[allow(
    unreachable_pub,
    reason = "there it is public, here it is private to the test"
)]
#[path = "../fuzz/src/labeling.rs"]
mod labeling;

use std::fs;
use std::path::{Path, PathBuf};

fn findings() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/findings");
    let entries =
        fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

#[test]
fn fixed_fuzz_findings_do_not_fail_again() {
    let paths = findings();
    assert!(!paths.is_empty());
    for path in paths {
        println!("{}", path.display());
        let text = fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        labeling::label(&text);
    }
}
