//! Finds the label source in question: a source by its name, or files of labels.

use crate::usage::UsageError;
use crate::verbs::check::types_that_join;
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// The name of label files in tables, unless the user gives another one.
const NAME_OF_FILES: &str = "mine";

/// A label source, and the overrides of the config that define it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mine {
    pub(super) name: String,
    pub(super) overrides: Vec<String>,
}

impl Mine {
    /// Finds label files if the path exists, and otherwise the source with this name. The type of the files is found by joining
    /// them.
    ///
    /// # Errors
    /// If the files can be joined by no type, or by several.
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

/// The only type of label files with which all shapes can be joined without a refusal.
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
