//! Remembers in a run folder where its data set is.

use super::folder::RunFolder;
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};

/// Notes where the data set stands, for `eval`: relative to the run folder if it stands inside it.
pub(crate) fn remember_data(folder: &RunFolder, data: &Path) -> Result<()> {
    let canonical = |path: &Path| {
        path.canonicalize()
            .with_context(|| path.display().to_string())
    };
    let (data, root) = (canonical(data)?, canonical(folder.root())?);
    folder.write_json("data.json", &data.strip_prefix(&root).unwrap_or(&data))
}

/// Where the data set of a run is.
///
/// # Errors
/// If the folder does not say it.
pub(crate) fn remembered_data(folder: &RunFolder) -> Result<PathBuf> {
    let advice = "say with --data DATASET where the data set is";
    let path: PathBuf = folder
        .read_json("data.json", advice)
        .context("give --data DATASET")?;
    // Joining an absolute path gives that path.
    Ok(folder.root().join(path))
}
