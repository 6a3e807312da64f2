//! Writes the commands that messages about a run advise. A user can copy them into a shell as they are.

use super::data_path::remembered_data;
use super::folder::RunFolder;
use crate::config::{Config, Difference};
use anyhow::Result;
use std::fs;
use std::path::{self, Path, PathBuf};

/// The command that starts the run of a folder again in a new folder, where one more label source is compared.
///
/// # Errors
/// If the config of the folder cannot be read.
pub(super) fn with_source_in_new_folder(
    root: &Path,
    config: &Config,
    source: &str,
) -> Result<String> {
    let config_file = root.join("config.toml");
    let stored: Config = toml::from_str(&fs::read_to_string(&config_file)?)?;
    let data = RunFolder::open_read_only(root).and_then(|folder| remembered_data(&folder));
    let data = data.unwrap_or_else(|_| PathBuf::from("DATASET"));
    let mut supervision = stored.compare.supervision;
    supervision.push(source.to_owned());
    let mut sets = vec![format!(
        "compare.supervision={}",
        toml::Value::from(supervision)
    )];
    for (name, table) in &config.sources {
        if !stored.sources.contains_key(name) {
            let table = toml::Value::try_from(table)?;
            sets.push(format!("sources.{name}={table}"));
        }
    }
    let out = new_folder(root, source)?;
    Ok(format!(
        "partprobe run {} --data {} --out {}{}",
        shell_word(&config_file.to_string_lossy()),
        shell_word(&data.to_string_lossy()),
        shell_word(&out.to_string_lossy()),
        set_arguments(&sets)
    ))
}

/// The folder beside a run folder that has its name and the name of a source.
fn new_folder(root: &Path, source: &str) -> Result<PathBuf> {
    let named = if root.file_name().is_some() {
        root.to_owned()
    } else {
        path::absolute(root)?
    };
    let name = named.file_name().unwrap_or_default().to_string_lossy();
    Ok(named.with_file_name(format!("{name}-{source}")))
}

/// The call of `eval` that gives a run the second value of each difference. Returns `None` if `--set` cannot give one of them.
pub(super) fn eval_with(root: &Path, differences: &[Difference]) -> Option<String> {
    let set = |difference: &Difference| {
        // The names in this table contain points.
        let key = match difference.key.strip_prefix("expect.") {
            Some(name) => format!("expect.{}", toml::Value::from(name)),
            None => difference.key.clone(),
        };
        let value = toml::Value::try_from(&difference.there).ok()?;
        Some(format!("{key}={value}"))
    };
    let sets: Vec<String> = differences.iter().map(set).collect::<Option<_>>()?;
    Some(format!(
        "partprobe eval {}{}",
        shell_word(&root.to_string_lossy()),
        set_arguments(&sets)
    ))
}

fn set_arguments(sets: &[String]) -> String {
    sets.iter()
        .map(|set| format!(" --set {}", shell_word(set)))
        .collect()
}

/// A text as one word of a shell.
fn shell_word(text: &str) -> String {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/._-=+:,@%".contains(&byte);
    if !text.is_empty() && text.bytes().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, json};

    #[test]
    fn a_text_is_one_word_of_a_shell() {
        for (text, expected) in [
            ("runs/a-1", "runs/a-1"),
            ("my runs", "'my runs'"),
            ("it's", r"'it'\''s'"),
            ("", "''"),
            (r#"a=["b"]"#, r#"'a=["b"]'"#),
        ] {
            assert_eq!(shell_word(text), expected);
        }
    }

    #[test]
    fn a_new_folder_is_beside_the_run() {
        for (root, expected) in [("runs/a/", "runs/a-s"), ("a", "a-s"), ("/r/a/.", "/r/a-s")] {
            let found = new_folder(Path::new(root), "s").unwrap();
            assert_eq!(found, Path::new(expected), "{root}");
        }
        assert!(new_folder(Path::new("."), "s").unwrap().is_absolute());
    }

    #[test]
    fn values_are_written_as_set_reads_them() {
        #[track_caller]
        fn check(key: &str, there: Value, expected: Option<&str>) {
            let differences = [Difference {
                key: key.to_owned(),
                here: Value::Null,
                there,
            }];
            let found = eval_with(Path::new("r"), &differences);
            let expected = expected.map(|set| format!("partprobe eval r --set {set}"));
            assert_eq!(found, expected);
        }
        check("eval.restarts", json!(3), Some("eval.restarts=3"));
        check(
            "compare.references",
            json!(["a", "b"]),
            Some(r#"'compare.references=["a", "b"]'"#),
        );
        check(
            "expect.a/b.miou",
            json!(">= 1"),
            Some(r#"'expect."a/b.miou"=">= 1"'"#),
        );
        check(
            "endpoints",
            json!([{ "name": "t" }]),
            Some(r#"'endpoints=[{ name = "t" }]'"#),
        );
        check("sources.m.k", Value::Null, None);
    }
}
