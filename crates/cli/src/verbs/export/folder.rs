//! Prepares the folder of an export: new or empty, or one that an earlier export wrote and `--force` may replace.

use super::outputs::Outputs;
use crate::config::{differences, listed};
use crate::folder_lock::FolderLock;
use crate::output_folder::{
    ensure_still_there, make_folder, remove_content, remove_if_all_unfinished, remove_if_there,
    remove_unfinished,
};
use crate::own_output::ensure_replaceable;
use crate::shape_input::EXPORT_FILE;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_dataset::{json_document, write_atomically};
use serde_json::{Value, json};
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

/// The endings that every export may write: its settings, its list of shapes, and the carriers of files that it labels
/// on the way. The endings of the formats are in their list.
const COMMON_EXTENSIONS: [&str; 3] = ["json", "jsonl", "npz"];

/// The output folder.
#[derive(Debug)]
pub(super) struct ExportFolder {
    root: PathBuf,
    /// The lock, which is held as long as this value exists.
    _lock: FolderLock,
}

impl ExportFolder {
    /// Makes the folder. An existing export is kept until [`clear`](Self::clear).
    ///
    /// # Errors
    /// If another program exports into it, or it has a file that may not be replaced.
    pub(super) fn make(root: &Path, replace: Replace, inputs: &[PathBuf]) -> Result<Self> {
        make_folder(root)?;
        let lock = FolderLock::take(root, "exporting into")?;
        let folder = Self {
            root: root.to_owned(),
            _lock: lock,
        };
        remove_if_all_unfinished(root)?;
        if !folder.is_empty()? {
            match replace {
                Replace::Export(known) => ensure_is_export(root, inputs, known)?,
                Replace::Nothing => bail!(UsageError(format!(
                    "{} is not empty; choose another --out, or replace an earlier export with --force",
                    root.display()
                ))),
            }
        }
        folder.remove_scratch()?;
        Ok(folder)
    }

    /// Removes the former export, and keeps the files that were labeled for the new one. The settings are removed last: without them,
    /// what is left would not be known as an export.
    pub(super) fn clear(&self) -> Result<()> {
        let settings = self.root.join(EXPORT_FILE);
        remove_content(&self.root, &[&self.scratch(), &settings])?;
        remove_if_there(&settings)
    }

    /// Whether it has nothing but what a program that was killed has labeled on the way.
    fn is_empty(&self) -> Result<bool> {
        let scratch = self.scratch();
        let reading = || format!("reading {}", self.root.display());
        for entry in fs::read_dir(&self.root).with_context(reading)? {
            if entry.with_context(reading)?.path() != scratch {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Removes what a program that was killed has labeled on the way.
    fn remove_scratch(&self) -> Result<()> {
        let scratch = self.scratch();
        if scratch.is_dir() {
            fs::remove_dir_all(&scratch)
                .with_context(|| format!("removing {}", scratch.display()))?;
        }
        Ok(())
    }

    /// Opens the folder of an export that was stopped, to add what is missing. An empty or a new folder becomes a new export.
    ///
    /// # Errors
    /// If another program exports into it, or it is not an export with these settings.
    pub(super) fn resume(root: &Path, format: &str, settings: &Value) -> Result<Self> {
        make_folder(root)?;
        let folder = Self {
            root: root.to_owned(),
            _lock: FolderLock::take(root, "exporting into")?,
        };
        remove_if_all_unfinished(root)?;
        if !folder.is_empty()? {
            folder.ensure_settings(format, settings)?;
            remove_unfinished(root)?;
        }
        folder.remove_scratch()?;
        Ok(folder)
    }

    /// Refuses a folder that is not an export with these settings.
    fn ensure_settings(&self, format: &str, settings: &Value) -> Result<()> {
        let root = &self.root;
        let found = fs::read(root.join(EXPORT_FILE)).unwrap_or_default();
        let found: Value = serde_json::from_slice(&found).unwrap_or_default();
        let wanted = settings_document(format, settings);
        ensure!(
            found["format"] == wanted["format"],
            UsageError(format!(
                "{} holds no {EXPORT_FILE} of this export, so it cannot be resumed; choose another --out",
                root.display()
            ))
        );
        ensure!(
            found == wanted,
            UsageError(format!(
                "{} was written with other settings: {}; choose another --out, or start again with --force",
                root.display(),
                listed(&differences(&found, &wanted))
            ))
        );
        Ok(())
    }

    /// The folder for files that are labeled on the way, if there are any.
    pub(super) fn scratch(&self) -> PathBuf {
        self.root.join(".labelled")
    }

    /// Writes a file at once, below the folder.
    pub(super) fn write(&self, relative: &Path, bytes: &[u8]) -> Result<()> {
        let path = self.root.join(relative);
        ensure_still_there(&self.root)?;
        if let Some(parent) = path.parent() {
            make_folder(parent)?;
        }
        Ok(write_atomically(&path, bytes)?)
    }

    /// Writes `export.json`: the format and every setting that determines the bytes of the files.
    pub(super) fn write_settings(&self, format: &str, settings: &Value) -> Result<()> {
        let document = settings_document(format, settings);
        self.write(Path::new(EXPORT_FILE), &json_document(&document)?)
    }

    /// Removes the folder if it is empty, because no shape was found.
    pub(super) fn abandon(&self) {
        // A failed removal does no harm, because the original error is reported.
        let _ = fs::remove_dir(&self.root);
    }

    pub(super) fn root(&self) -> &Path {
        &self.root
    }
}

/// The content of `export.json`.
fn settings_document(format: &str, settings: &Value) -> Value {
    json!({
        "format_version": partprobe_formats::FORMAT_VERSION,
        "program_version": env!("CARGO_PKG_VERSION"),
        "format": format,
        "settings": settings,
    })
}

/// The content of a folder that may be replaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Replace {
    /// It is refused.
    Nothing,
    /// An export with these files may be removed. Anything else is refused.
    Export(&'static [Outputs]),
}

/// Refuses to replace a folder that has anything but an export, finished or not, or that has an input.
fn ensure_is_export(root: &Path, inputs: &[PathBuf], known: &[Outputs]) -> Result<()> {
    let inputs = inputs.iter().map(PathBuf::as_path);
    ensure_replaceable(root, "export", inputs, |path| is_of_an_export(path, known))?;
    let settings = fs::read(root.join(EXPORT_FILE)).unwrap_or_default();
    let is_export = serde_json::from_slice::<Value>(&settings)
        .is_ok_and(|document| document["format"].is_string());
    ensure!(
        is_export,
        UsageError(format!(
            "{} holds no {EXPORT_FILE} of an export, so --force removes nothing",
            root.display()
        ))
    );
    Ok(())
}

/// Whether an export writes such a file, or was writing it when it was killed.
fn is_of_an_export(path: &Path, known: &[Outputs]) -> bool {
    let text = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
    let (name, extension) = (text(path.file_name()), text(path.extension()));
    let belongs_to_export = is_of_an_exporter(&name, &extension, known)
        || (name.starts_with('.') && ["part", "unfinished"].contains(&extension.as_str()));
    belongs_to_export && !path.is_symlink()
}

/// Whether a format, or every export, writes files with this name or ending.
fn is_of_an_exporter(name: &str, extension: &str, known: &[Outputs]) -> bool {
    let is_of = |outputs: &Outputs| {
        outputs.extensions.contains(&extension) || outputs.file_names.contains(&name)
    };
    COMMON_EXTENSIONS.contains(&extension) || known.iter().any(is_of)
}

#[cfg(test)]
mod tests {
    use super::super::formats::OUTPUTS;
    use super::*;

    const EXPORT: Replace = Replace::Export(OUTPUTS);

    #[test]
    fn only_an_export_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("out");
        let make = |replace| ExportFolder::make(&root, replace, &[]);
        let refusal = |replace| make(replace).unwrap_err().to_string();
        make(EXPORT)
            .unwrap()
            .write(Path::new("a/b.ply"), b"ply")
            .unwrap();
        assert!(refusal(Replace::Nothing).contains("is not empty"));
        assert!(refusal(EXPORT).contains("no export.json"));
        fs::write(root.join(EXPORT_FILE), r#"{"format": "ply"}"#).unwrap();
        fs::write(root.join("a/thesis.tex"), "").unwrap();
        assert!(refusal(EXPORT).contains("thesis.tex was not written by `export`"));
        fs::remove_file(root.join("a/thesis.tex")).unwrap();
        let inputs = [root.join("a/b.ply")];
        let error = ExportFolder::make(&root, EXPORT, &inputs).unwrap_err();
        assert!(error.to_string().contains("lies in --out"));

        // The former export stays until there are shapes for the new one.
        let export = make(EXPORT).unwrap();
        assert!(root.join("a/b.ply").is_file());
        fs::create_dir(export.scratch()).unwrap();
        export.clear().unwrap();
        assert_eq!(fs::read_dir(&root).unwrap().count(), 1);
        assert!(export.scratch().is_dir());
        drop(export);
        // A program that was killed leaves what it has labeled on the way.
        make(Replace::Nothing).unwrap();
        assert_eq!(fs::read_dir(&root).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn an_export_that_is_being_written_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("out");
        let make = |replace| ExportFolder::make(&root, replace, &[]);
        let first = make(Replace::Nothing).unwrap();
        first.write_settings("ply", &Value::Null).unwrap();
        first.write(Path::new("a.ply"), b"ply").unwrap();
        for replace in [EXPORT, Replace::Nothing] {
            let message = make(replace).unwrap_err();
            assert!(
                message.is::<UsageError>()
                    && message
                        .to_string()
                        .contains("another partprobe is exporting into"),
                "{message}"
            );
        }
        assert_eq!(fs::read(root.join("a.ply")).unwrap(), b"ply");
        drop(first);
        assert!(make(EXPORT).is_ok());
    }
}
