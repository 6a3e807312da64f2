//! Makes the paths in a config absolute, so that a run folder can be used from any current folder.

use super::merge::LoadedConfig;
use anyhow::{Context, Result};
#[cfg(feature = "train")]
use serde_json::Value as Json;
use std::path;
use toml::{Table, Value};

impl LoadedConfig {
    /// The same config, in which each path to a file or folder is absolute. Relative paths are relative to the current folder.
    ///
    /// # Errors
    /// If the system does not tell the current folder.
    pub(crate) fn with_absolute_paths(&self) -> Result<Self> {
        let mut table: Table = self.merged.parse()?;
        for (name, source) in &self.config.sources {
            for key in source.path_keys() {
                make_absolute(value_at(&mut table, &["sources", name, key]))?;
            }
        }
        // `split.manifest` is read only once, and split.json records how it was written.
        make_absolute(value_at(&mut table, &["train", "init"]))?;
        let paths = value_at(&mut table, &["data", "paths"]);
        for path in paths.and_then(Value::as_array_mut).into_iter().flatten() {
            make_absolute(Some(path))?;
        }
        let endpoints = value_at(&mut table, &["endpoints"]).and_then(Value::as_array_mut);
        for endpoint in endpoints.into_iter().flatten() {
            make_absolute(endpoint.get_mut("data"))?;
        }
        self.with_merged(table)
    }
}

fn value_at<'a>(table: &'a mut Table, keys: &[&str]) -> Option<&'a mut Value> {
    let (last, tables) = keys.split_last()?;
    let mut table = table;
    for key in tables {
        table = table.get_mut(*key)?.as_table_mut()?;
    }
    table.get_mut(*last)
}

/// Replaces a relative path by an absolute one. An empty text means that there is no file.
fn make_absolute(value: Option<&mut Value>) -> Result<()> {
    if let Some(Value::String(text)) = value
        && !text.is_empty()
    {
        let absolute = path::absolute(&*text).with_context(|| text.clone())?;
        *text = absolute.to_string_lossy().into_owned();
    }
    Ok(())
}

/// Whether two values of a key are equal if their texts are taken as paths: two texts that lead to the same file or folder from the
/// current folder, or lists and tables of such texts.
#[cfg(feature = "train")]
pub(crate) fn are_same_place(one: &Json, other: &Json) -> bool {
    match (one, other) {
        (Json::String(one), Json::String(other)) => {
            let absolute = |text: &str| path::absolute(text).ok();
            one == other || absolute(one).is_some_and(|one| Some(one) == absolute(other))
        }
        (Json::Array(one), Json::Array(other)) => {
            one.len() == other.len() && one.iter().zip(other).all(|(a, b)| are_same_place(a, b))
        }
        (Json::Object(one), Json::Object(other)) => {
            let is_same = |(key, value): (&String, &Json)| {
                other
                    .get(key)
                    .is_some_and(|there| are_same_place(value, there))
            };
            one.len() == other.len() && one.iter().all(is_same)
        }
        (one, other) => one == other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;
    #[cfg(feature = "train")]
    use serde_json::json;

    #[test]
    fn every_path_becomes_absolute_and_nothing_else_changes() {
        let set = [
            "sources.mine={ type = \"points\", path = \"labels\", points = \"/clouds\", labels_from = \"seg_id\" }",
            "train.init=\"weights/{source}.safetensors\"",
            "endpoints=[{ name = \"T1\", data = \"t1\" }]",
        ];
        let loaded = load("base", &set.map(str::to_owned)).unwrap();
        let absolute = loaded.with_absolute_paths().unwrap();
        let here = std::env::current_dir().unwrap();
        let here = here.display();
        let expected = loaded
            .merged
            .replace("\"labels\"", &format!("\"{here}/labels\""))
            .replace("\"weights/", &format!("\"{here}/weights/"))
            .replace("\"t1\"", &format!("\"{here}/t1\""));
        assert_eq!(absolute.merged, expected);
        assert_eq!(absolute.with_absolute_paths().unwrap().merged, expected);
    }

    #[cfg(feature = "train")]
    #[test]
    fn a_path_is_the_same_in_both_forms() {
        let here = std::env::current_dir().unwrap();
        let absolute = here.join("labels").to_string_lossy().into_owned();
        let endpoint = |data: &str, noise: f64| json!([{ "data": data, "noise": noise }]);
        for (one, other, expected) in [
            (json!("labels"), json!(absolute), true),
            (json!("./labels"), json!("labels"), true),
            (json!("labels"), json!("other"), false),
            (json!(""), json!("labels"), false),
            (json!(""), json!(""), true),
            (endpoint("labels", 0.5), endpoint(&absolute, 0.5), true),
            (endpoint("labels", 0.5), endpoint(&absolute, 0.1), false),
            (endpoint("labels", 0.5), json!([]), false),
        ] {
            assert_eq!(are_same_place(&one, &other), expected, "{one} {other}");
        }
    }
}
