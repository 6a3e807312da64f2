//! Stores the path of the data set in a run folder.

use super::folder::RunFolder;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// Stores the path of the data set for `eval`. It is relative to the run folder if the data set is inside it.
pub(crate) fn remember_data(folder: &RunFolder, data: &Path) -> Result<()> {
    let canonical = |path: &Path| {
        path.canonicalize()
            .with_context(|| path.display().to_string())
    };
    let (data, root) = (canonical(data)?, canonical(folder.root())?);
    folder.write_json("data.json", &data.strip_prefix(&root).unwrap_or(&data))
}

/// The path of the data set of a run.
///
/// # Errors
/// If the folder does not contain it.
pub(crate) fn remembered_data(folder: &RunFolder) -> Result<PathBuf> {
    let advice = "say with --data DATASET where the data set is";
    let path: PathBuf = folder
        .read_json("data.json", advice)
        .context("give --data DATASET")?;
    // Joining an absolute path gives that path.
    Ok(folder.root().join(path))
}
