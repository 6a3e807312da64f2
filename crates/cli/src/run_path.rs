//! Finds the run folder that a path of the command line means.

use std::path::{Path, PathBuf};

/// The folder of the run in the folder of a verdict.
pub(crate) const RUN_OF_VERDICT: &str = "run";

/// The run folder at a path. The folder of a verdict means the run in it; all other paths mean themselves.
pub(crate) fn run_path(path: &Path) -> PathBuf {
    let inside = path.join(RUN_OF_VERDICT);
    let is_run = |folder: &Path| folder.join("config.toml").is_file();
    if !is_run(path) && is_run(&inside) {
        inside
    } else {
        path.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_folder_of_a_verdict_means_its_run() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        assert_eq!(run_path(root), root);

        fs::create_dir(root.join("run")).unwrap();
        fs::write(root.join("run/config.toml"), "").unwrap();
        assert_eq!(run_path(root), root.join("run"));
        assert_eq!(run_path(&root.join("run")), root.join("run"));

        fs::write(root.join("config.toml"), "").unwrap();
        assert_eq!(run_path(root), root);
    }
}
