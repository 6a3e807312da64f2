//! Finds the label source in question: a source by its name, or files of labels.

use crate::config::load;
use crate::label_sources::source_named;
use crate::usage::UsageError;
use crate::verbs::check::{JoiningType, types_that_join};
use anyhow::{Result, bail};
use std::path::{Path, PathBuf};

/// The name of label files in tables, unless the user gives another one.
const NAME_OF_FILES: &str = "mine";

/// A label source, and the overrides of the config that define it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mine {
    pub(super) name: String,
    pub(super) overrides: Vec<String>,
    /// Advice if the labels seem to be classes.
    pub(super) hint: Option<String>,
}

impl Mine {
    /// Finds label files if the path exists, and otherwise the source with this name. The type of the files is found by joining
    /// them.
    ///
    /// # Errors
    /// If there is neither a path nor a source of this name, or the files can be joined by no type, or by several.
    pub(super) fn find(
        text: &str,
        type_name: Option<&str>,
        dataset: &Path,
        set: &[String],
    ) -> Result<Self> {
        let path = PathBuf::from(text);
        if !path.exists() {
            ensure_is_source(text, set)?;
            return Ok(Self {
                name: text.to_owned(),
                overrides: Vec::new(),
                hint: None,
            });
        }
        let (type_name, hint) = match type_name {
            Some(name) => (name.to_owned(), None),
            None => {
                let JoiningType { name, hint } = only_type(text, dataset)?;
                (name.to_owned(), hint)
            }
        };
        let instances_key = format!("sources.{NAME_OF_FILES}.instances");
        let hint = hint.filter(|_| !set.iter().any(|key| key.starts_with(&instances_key)));
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
            hint: hint.map(|hint| format!("{hint}. Here, the key is --set {instances_key}=true")),
        })
    }
}

/// Refuses a text that is not the name of a label source. `set` may define more of them.
fn ensure_is_source(text: &str, set: &[String]) -> Result<()> {
    let missing = format!("there is no file or folder {text}");
    if text.contains(std::path::is_separator) {
        bail!(UsageError(format!(
            "{missing}; give an existing path of labels, or the name of a label source"
        )));
    }
    let config = load("verdict", set)?.config;
    match source_named(&config, text) {
        Ok(_) => Ok(()),
        Err(error) => bail!(UsageError(format!("{missing}, and {error:#}"))),
    }
}

/// The only type of label files with which all shapes can be joined without a refusal.
fn only_type(labels: &str, dataset: &Path) -> Result<JoiningType> {
    let mut types = types_that_join(labels, dataset)?;
    let advice = format!(
        "`partprobe check labels {labels} --data {}` says why",
        dataset.display()
    );
    match types.len() {
        1 => Ok(types.swap_remove(0)),
        0 => bail!(UsageError(format!(
            "the labels of {labels} do not join to the shapes; {advice}"
        ))),
        _ => {
            let names: Vec<&str> = types.iter().map(|joining| joining.name).collect();
            bail!(UsageError(format!(
                "the labels of {labels} could be of the types {}; choose one with --type; {advice}",
                names.join(", ")
            )))
        }
    }
}
