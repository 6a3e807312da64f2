//! Reads `[sources.NAME]`: labels of another program or of a model, with a name that is used like that of a built-in source.

use super::problem::{ConfigProblem, suggestion};
use crate::source_types::source_type;
use anyhow::{Result, anyhow, bail, ensure};
use partprobe_imports::ImportError;
use partprobe_sources::{SourceContext, source_named};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The supervision of weights that were not trained on parts. Every source of a comparison may start with them, so no source may
/// have this name.
pub(crate) const FOREIGN_SUPERVISION: &str = "pointcept";

/// The word in the name of a source that uses the reference to choose its labels.
const OPTIMISTIC: &str = "optimistic";

/// One table: the type of the labels, and its keys.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct SourceTable {
    #[serde(rename = "type")]
    pub(crate) import_type: String,
    #[serde(flatten)]
    parameters: BTreeMap<String, ParameterValue>,
}

/// A value of a key. The type of the labels determines the valid values.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "a key has a value that is not a text in quotes, a number, `true` or `false`"
)]
enum ParameterValue {
    Text(String),
    Switch(bool),
    Integer(i64),
    Number(f64),
}

impl SourceTable {
    /// The keys and their values, in the form that a source reads.
    pub(crate) fn context(&self) -> SourceContext {
        let parameters = self.parameters.iter();
        parameters.fold(SourceContext::default(), |context, (key, value)| {
            let text = match value {
                ParameterValue::Text(text) => text.clone(),
                ParameterValue::Switch(switch) => switch.to_string(),
                ParameterValue::Integer(number) => number.to_string(),
                ParameterValue::Number(number) => number.to_string(),
            };
            context.with(key, text)
        })
    }

    /// Refuses a name that cannot be distinguished from others, an unknown type, and keys that the type does not have.
    ///
    /// # Errors
    /// If there is one. The message names the key.
    pub(crate) fn check(&self, name: &str) -> Result<()> {
        let is_plain =
            |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || byte == b'-';
        ensure!(
            !name.is_empty() && name.bytes().all(is_plain),
            ConfigProblem::of_key(
                format!("sources.{name}"),
                format!("sources.{name}: a name consists of the letters a to z, digits and `-`")
            )
        );
        ensure!(
            source_named(name).is_err(),
            "sources.{name} has the name of a built-in label source; choose another name"
        );
        ensure!(
            name != FOREIGN_SUPERVISION,
            "sources.{name} has the name that converted weights of Pointcept have; choose another name"
        );
        let picks_the_best = self.context().parameter("k") == Some("best");
        ensure!(
            !picks_the_best || name.contains(OPTIMISTIC),
            "sources.{name}.k = \"best\" picks the level that agrees best with the STEP parts, so its scores are optimistic, and \
             every table must say so; choose a name with `{OPTIMISTIC}` in it, for example `{name}-{OPTIMISTIC}`"
        );
        let known = source_type(&self.import_type)
            .map_err(|error| anyhow!("sources.{name}.type: {error}{}", meant(&error)))?;
        known
            .check(&self.context())
            .map_err(|error| anyhow!("sources.{name}: {error}{}", meant(&error)))?;
        self.check_paths(name)
    }

    /// Refuses a path that is not a text, or is empty. Whether there is a file is not checked.
    fn check_paths(&self, name: &str) -> Result<()> {
        for key in self.path_keys() {
            match self.parameters.get(key) {
                None => {}
                Some(ParameterValue::Text(path)) => ensure!(
                    !path.is_empty(),
                    "sources.{name}: `{key}` is empty; name a file or folder"
                ),
                Some(_) => bail!(
                    "sources.{name}: `{key}` must be a text in quotes, which names a file or folder"
                ),
            }
        }
        Ok(())
    }

    /// The keys whose values are paths.
    pub(super) fn path_keys(&self) -> Vec<&'static str> {
        let keys = source_type(&self.import_type).map_or(&[][..], |known| known.keys);
        let paths = keys.iter().filter(|key| key.is_path);
        paths.map(|key| key.name).collect()
    }
}

/// The name that may have been meant, as the end of a message. It is empty if no name is similar.
fn meant(error: &ImportError) -> String {
    let (name, known) = match error {
        ImportError::UnknownType { name, known } => (name, known.as_str()),
        ImportError::UnknownKey { key, known, .. } => (key, known.as_str()),
        ImportError::Value {
            value, expected, ..
        } => (value, expected.strip_prefix("one of ").unwrap_or_default()),
        _ => return String::new(),
    };
    suggestion(name, known)
}
