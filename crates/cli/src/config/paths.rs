//! Makes the paths in a config absolute, so that a run folder can be used from any current folder.

use super::merge::LoadedConfig;
use anyhow::{Context, Result};
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

/// Whether two texts lead to the same file or folder from the current folder.
pub(crate) fn are_same_place(one: &str, other: &str) -> bool {
    matches!((path::absolute(one), path::absolute(other)), (Ok(one), Ok(other)) if one == other)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

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

    #[test]
    fn a_path_is_the_same_in_both_forms() {
        let here = std::env::current_dir().unwrap();
        let absolute = here.join("labels");
        assert!(are_same_place("labels", &absolute.to_string_lossy()));
        assert!(are_same_place("./labels", "labels"));
        assert!(!are_same_place("labels", "other"));
        assert!(!are_same_place("", "labels"));
    }
}
