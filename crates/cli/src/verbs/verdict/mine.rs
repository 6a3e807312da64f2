//! Finds the label source in question: one that is known by name, or files of labels.

use crate::usage::UsageError;
use crate::verbs::check::types_that_join;
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// What label files are called in tables, unless the user says otherwise.
const NAME_OF_FILES: &str = "mine";

/// A label source, and the overrides of the config that define it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mine {
    pub(super) name: String,
    pub(super) overrides: Vec<String>,
}

impl Mine {
    /// Label files if there is something at the path, and else the name of a source. The type of the files is found by joining them.
    ///
    /// # Errors
    /// If files join by no type, or by several.
    pub(super) fn find(text: &str, type_name: Option<&str>, dataset: &Path) -> Result<Self> {
        let path = PathBuf::from(text);
        if !path.exists() {
            return Ok(Self {
                name: text.to_owned(),
                overrides: Vec::new(),
            });
        }
        let type_name = match type_name {
            Some(name) => name.to_owned(),
            None => only_type(text, dataset)?,
        };
        let path = path.canonicalize()?.display().to_string();
        let table = toml::toml! {
            type = type_name
            path = path
        };
        Ok(Self {
            name: NAME_OF_FILES.to_owned(),
            overrides: vec![format!(
                "sources.{NAME_OF_FILES}={{ type = {}, path = {} }}",
                table["type"], table["path"]
            )],
        })
    }
}

/// The one type of label files that joins to all shapes without a refusal.
fn only_type(labels: &str, dataset: &Path) -> Result<String> {
    let types = types_that_join(labels, dataset)?;
    let advice = format!(
        "`partprobe check labels {labels} --data {}` says why",
        dataset.display()
    );
    match types.as_slice() {
        [one] => Ok((*one).to_owned()),
        [] => bail!(UsageError(format!(
            "the labels of {labels} do not join to the shapes; {advice}"
        ))),
        several => bail!(UsageError(format!(
            "the labels of {labels} could be of the types {}; choose one with --type; {advice}",
            several.join(", ")
        ))),
    }
}
