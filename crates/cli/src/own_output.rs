//! Recognizes what an earlier call of a verb wrote, so that `--force` replaces that and removes nothing else.

use crate::folder_lock::FolderLock;
use crate::output_folder::{
    ensure_empty, files_below, is_empty, make_folder, remove_content, remove_if_all_unfinished,
};
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_dataset::is_unfinished;
use std::path::{Path, PathBuf};

/// The output of a verb.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnOutput {
    /// The name of the verb.
    pub(crate) verb: &'static str,
    /// A file that each output has from the beginning, if the other names could also be those of a user's files.
    pub(crate) marker: Option<&'static str>,
    /// Whether the verb writes a file with this name.
    pub(crate) is_own: fn(&str) -> bool,
}

impl OwnOutput {
    /// Refuses a folder that is not empty, unless `force` may replace everything in it. `inputs` are files that are read later.
    ///
    /// # Errors
    /// If it is refused, is a file, or cannot be read.
    pub(crate) fn ensure_free(&self, folder: &Path, force: bool, inputs: &[PathBuf]) -> Result<()> {
        if !force {
            return ensure_empty(folder, "choose another folder, or replace it with --force");
        }
        if is_empty(folder)? {
            return Ok(());
        }
        ensure_replaceable(
            folder,
            self.verb,
            inputs.iter().map(PathBuf::as_path),
            |path| self.is_own_file(path),
        )?;
        let Some(marker) = self.marker else {
            return Ok(());
        };
        ensure!(
            folder.join(marker).is_file(),
            UsageError(format!(
                "{} has no {marker}, so it was not written by `{}`, and --force removes nothing",
                folder.display(),
                self.verb
            ))
        );
        Ok(())
    }

    /// Makes and locks a folder, and removes the output of an earlier call if `force` is set. The folder is checked under the lock,
    /// so another program cannot fill it in between. Files that a killed program has not finished do not count.
    ///
    /// # Errors
    /// As for [`ensure_free`](Self::ensure_free), or if the folder cannot be made, or another program holds the lock.
    pub(crate) fn take(
        &self,
        folder: &Path,
        doing: &str,
        force: bool,
        inputs: &[PathBuf],
    ) -> Result<FolderLock> {
        make_folder(folder)?;
        let lock = FolderLock::take(folder, doing)?;
        remove_if_all_unfinished(folder)?;
        self.ensure_free(folder, force, inputs)?;
        remove_content(folder, &[])?;
        Ok(lock)
    }

    fn is_own_file(&self, path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        !path.is_symlink() && ((self.is_own)(&name) || is_unfinished(&name))
    }
}

/// Refuses to replace a folder that has an input, or a file that the verb does not write.
///
/// # Errors
/// If it is refused, or cannot be read.
pub(crate) fn ensure_replaceable<'a>(
    folder: &Path,
    verb: &str,
    inputs: impl IntoIterator<Item = &'a Path>,
    is_own: impl Fn(&Path) -> bool,
) -> Result<()> {
    let folder = &folder
        .canonicalize()
        .with_context(|| folder.display().to_string())?;
    let is_inside = |path: &&Path| {
        path.canonicalize()
            .is_ok_and(|path| path.starts_with(folder))
    };
    if let Some(path) = inputs.into_iter().find(is_inside) {
        bail!(UsageError(format!(
            "{} lies in --out; --force would remove it",
            path.display()
        )));
    }
    if let Some(path) = files_below(folder)?.iter().find(|path| !is_own(path)) {
        bail!(UsageError(format!(
            "{} was not written by `{verb}`, so --force removes nothing",
            path.display()
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const OUTPUT: OwnOutput = OwnOutput {
        verb: "embed",
        marker: Some("embed.json"),
        is_own: |name| name == "embed.json" || name.ends_with(".npz"),
    };

    #[test]
    fn only_own_output_is_replaced() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("out");
        let refusal = |force, inputs: &[PathBuf]| {
            let refused = OUTPUT.take(&folder, "embedding into", force, inputs);
            refused.unwrap_err().to_string()
        };
        drop(OUTPUT.take(&folder, "embedding into", false, &[]).unwrap());
        fs::create_dir(folder.join("a")).unwrap();
        for name in ["a/mine.npz", "thesis.tex"] {
            fs::write(folder.join(name), "").unwrap();
        }
        assert!(refusal(false, &[]).contains("is not empty; choose another folder, or replace"));
        assert!(refusal(true, &[]).contains("thesis.tex was not written by `embed`"));
        fs::remove_file(folder.join("thesis.tex")).unwrap();
        assert!(refusal(true, &[]).contains("has no embed.json"));
        fs::write(folder.join("embed.json"), "").unwrap();
        assert!(refusal(true, &[folder.join("a/mine.npz")]).contains("lies in --out"));

        drop(OUTPUT.take(&folder, "embedding into", true, &[]).unwrap());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    }
}
