//! Compares the settings with which a data set was labeled and those of a config: a run records the former, and a config with
//! different settings is refused.

use crate::config::{LoadedConfig, explicit_table, with_table};
use crate::dataset_settings::NEUTRAL_LABEL_KEYS;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{Dataset, SETTINGS_FILE};
use serde_json::{Map, Value};
use std::fs;
use std::path::{Path, PathBuf};

/// The unchanged `dataset.json`, because that of an earlier program may lack settings.
///
/// # Errors
/// If it does not exist or cannot be read.
pub(crate) fn settings_of(data: &Path) -> Result<Value> {
    let path = data.join(SETTINGS_FILE);
    let without = || {
        format!(
            "reading {}, which says how the data set was labeled; label again",
            path.display()
        )
    };
    let bytes = fs::read(&path).with_context(without)?;
    serde_json::from_slice(&bytes).with_context(|| path.display().to_string())
}

/// The config with the facts about its data: that data were given and, if they are a labeled data set, its settings instead of
/// the defaults.
///
/// # Errors
/// If the caller has set other values. Each setting is named, with both values.
pub(crate) fn with_data(
    data: &[PathBuf],
    loaded: LoadedConfig,
    name_or_path: &str,
    set: &[String],
) -> Result<LoadedConfig> {
    if data.is_empty() {
        return Ok(loaded);
    }
    // The config may wrongly say that parts are generated.
    let source = Map::from_iter([("source".to_owned(), Value::from("paths"))]);
    let loaded = with_table(&loaded, "data", &source)?;
    match data {
        [path] if Dataset::is_at(path) => with_settings_of(path, &loaded, name_or_path, set),
        _ => Ok(loaded),
    }
}

fn with_settings_of(
    data: &Path,
    loaded: &LoadedConfig,
    name_or_path: &str,
    set: &[String],
) -> Result<LoadedConfig> {
    let label = label_settings_of(data)?;
    let explicit = explicit_table(name_or_path, set, "label")?;
    refuse_others(data, loaded, &label, |key| explicit.contains_key(key))?;
    with_table(loaded, "label", &label)
}

/// Refuses a data set that was labeled with other settings than those of the config.
///
/// # Errors
/// If this is so. Each setting is named, with both values.
pub(crate) fn ensure_settings_of(data: &Path, loaded: &LoadedConfig) -> Result<()> {
    refuse_others(data, loaded, &label_settings_of(data)?, |_| true)
}

fn label_settings_of(data: &Path) -> Result<Map<String, Value>> {
    let settings = settings_of(data)?;
    let label = settings["label"].as_object().cloned();
    label.with_context(|| {
        format!(
            "{} has no settings of labeling; label again",
            data.join(SETTINGS_FILE).display()
        )
    })
}

fn refuse_others(
    data: &Path,
    loaded: &LoadedConfig,
    label: &Map<String, Value>,
    counts: impl Fn(&str) -> bool,
) -> Result<()> {
    let config = serde_json::to_value(&loaded.config.label)?;
    let differs = |key: &str, value: &Value| config.get(key).is_some_and(|own| own != value);
    let others: Vec<String> = label
        .iter()
        .filter(|(key, value)| {
            counts(key) && !NEUTRAL_LABEL_KEYS.contains(&key.as_str()) && differs(key, value)
        })
        .map(|(key, value)| {
            format!(
                "label.{key} is {} in the config and {value} in the data set",
                config[key]
            )
        })
        .collect();
    ensure!(
        others.is_empty(),
        UsageError(format!(
            "{} was labeled with other settings: {}; take those of the data set into the config, or label again",
            data.display(),
            others.join("; ")
        ))
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

    /// The folder of a data set with the default settings except for these.
    fn data_set(changes: &[(&str, Value)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let mut label = serde_json::to_value(load("base", &[]).unwrap().config.label).unwrap();
        for (key, value) in changes {
            label[key] = value.clone();
        }
        let settings = serde_json::json!({ "format_version": 1, "label": label });
        fs::write(folder.path().join(SETTINGS_FILE), settings.to_string()).unwrap();
        folder
    }

    fn adopted(changes: &[(&str, Value)], set: &[&str]) -> Result<LoadedConfig> {
        let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
        let folder = data_set(changes);
        with_settings_of(folder.path(), &load("smoke", &set)?, "smoke", &set)
    }

    #[test]
    fn defaults_are_replaced_and_explicit_values_are_not() {
        let twelve = [("theta_deg", Value::from(12.0))];
        assert_eq!(adopted(&twelve, &[]).unwrap().config.label.theta_deg, 12.0);
        assert_eq!(
            adopted(&twelve, &["label.theta_deg=12"])
                .unwrap()
                .config
                .label
                .theta_deg,
            12.0
        );
        let message = adopted(&twelve, &["label.theta_deg=8"]).unwrap_err();
        assert!(message.is::<UsageError>());
        assert!(
            message
                .to_string()
                .contains("label.theta_deg is 8.0 in the config and 12.0 in the data set"),
            "{message}"
        );
    }

    #[test]
    fn a_budget_that_differs_is_ignored() {
        let adopted = adopted(&[("watchdog_s", Value::from(7))], &["label.watchdog_s=9"]).unwrap();
        assert_eq!(adopted.config.label.watchdog_s, 7);
    }

    #[test]
    fn a_folder_without_settings_is_not_a_data_set() {
        let folder = tempfile::tempdir().unwrap();
        let message = format!("{:#}", settings_of(folder.path()).unwrap_err());
        assert!(
            message.contains("dataset.json") && message.contains("label again"),
            "{message}"
        );
    }

    #[test]
    fn a_run_is_held_to_all_settings() {
        let loaded = load("smoke", &[]).unwrap();
        assert!(ensure_settings_of(data_set(&[]).path(), &loaded).is_ok());
        assert!(
            ensure_settings_of(data_set(&[("unit", Value::from("solid"))]).path(), &loaded)
                .is_err()
        );
    }
}
