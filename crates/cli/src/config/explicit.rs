//! Separates the settings that the user set from the defaults, and replaces a table of a config.

use super::chain::chain;
use super::merge::{LoadedConfig, overlay, read_text, set};
use anyhow::{Context, Result};
use serde_json::{Map, Value};
use toml::Table;

/// The keys of one table that are set by an override, by the config, or by a config on which it is based. Keys from the shipped
/// `base` are left out.
///
/// # Errors
/// If the config cannot be read.
pub(crate) fn explicit_table(
    name_or_path: &str,
    overrides: &[String],
    table: &str,
) -> Result<Table> {
    let (_, text, path) = read_text(name_or_path)?;
    let mut own = Table::new();
    for config in chain(name_or_path, &text, path.as_deref())?.iter().rev() {
        let is_defaults = !config.is_file() && config.name == "base";
        if !is_defaults {
            overlay(&mut own, config.table.clone());
        }
    }
    for assignment in overrides {
        set(&mut own, assignment).with_context(|| format!("--set {assignment}"))?;
    }
    Ok(own
        .get(table)
        .and_then(toml::Value::as_table)
        .cloned()
        .unwrap_or_default())
}

/// The config with these values merged over one of its tables.
///
/// # Errors
/// If a key or a value is not one of the table's.
pub(crate) fn with_table(
    loaded: &LoadedConfig,
    table: &str,
    values: &Map<String, Value>,
) -> Result<LoadedConfig> {
    let mut merged: Table = loaded.merged.parse()?;
    let values: Table = serde_json::from_value(Value::Object(values.clone()))?;
    overlay(
        &mut merged,
        Table::from_iter([(table.to_owned(), toml::Value::Table(values))]),
    );
    loaded.with_merged(merged)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;
    use serde_json::json;
    use std::fs;

    #[track_caller]
    fn check(name_or_path: &str, overrides: &[&str], expected: &[&str]) {
        let overrides: Vec<String> = overrides.iter().map(|&text| text.to_owned()).collect();
        let found = explicit_table(name_or_path, &overrides, "label").unwrap();
        assert_eq!(found.keys().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn only_explicit_keys_are_in_the_table() {
        check("base", &[], &[]);
        check("smoke", &[], &[]);
        check("abc-small", &[], &["unit"]);
        check("probe", &[], &["unit"]);
        check(
            "smoke",
            &["label.theta_deg=8", "train.steps=3"],
            &["theta_deg"],
        );

        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        fs::write(
            path("own.toml"),
            "base = \"base.toml\"\n[label]\ntau_min = 20\n",
        )
        .unwrap();
        check(&path("own.toml"), &[], &["tau_min"]);
        fs::write(path("base.toml"), "[label]\nunit = \"solid\"\n").unwrap();
        check(&path("own.toml"), &[], &["tau_min", "unit"]);
    }

    #[test]
    fn a_table_is_laid_over_and_checked() {
        let loaded = load("smoke", &[]).unwrap();
        let with = |values: Value| with_table(&loaded, "label", values.as_object().unwrap());
        let other = with(json!({ "theta_deg": 12.0, "unit": "solid" })).unwrap();
        assert_eq!(other.config.label.theta_deg, 12.0);
        assert_eq!(other.config.label.tau_min, loaded.config.label.tau_min);
        assert!(other.merged.contains("theta_deg = 12.0"));
        assert!(with(json!({ "theta": 12.0 })).is_err());
    }
}
