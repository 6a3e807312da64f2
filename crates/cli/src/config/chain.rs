//! Finds the configs on which a config is based. A config goes in, and a list comes out: the config, its base, the base of the
//! base, and so on.
//!
//! A base is a file in the folder of the config that names it, or a shipped config. Nothing is merged here.

use super::merge::shipped;
use super::problem::{line_of, parsed};
use anyhow::{Context, Result, anyhow, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use toml::Table;

/// A config as its author wrote it.
pub(super) struct ConfigText {
    /// The path as the user wrote it, or the name of a shipped config.
    pub(super) name: String,
    pub(super) text: String,
    /// Its own settings, without `base`.
    pub(super) table: Table,
    /// Its path, or `None` for a shipped config.
    path: Option<PathBuf>,
    base: Option<String>,
}

impl ConfigText {
    fn new(name: String, text: String, path: Option<PathBuf>) -> Result<Self> {
        let mut table = parsed(&text, &name)?;
        let base = match table.remove("base") {
            None => None,
            Some(base) => {
                let base = base.as_str().map(str::to_owned);
                let place = place_of_base(&name, &text);
                Some(base.ok_or_else(|| anyhow!("{place}: `base` must be a file name"))?)
            }
        };
        Ok(Self {
            name,
            text,
            table,
            path,
            base,
        })
    }

    /// Whether it is a file that the user can change, and not a shipped config.
    pub(super) fn is_file(&self) -> bool {
        self.path.is_some()
    }

    /// The config that this one names as its base.
    fn read_base(&self) -> Result<Option<Self>> {
        let Some(base) = &self.base else {
            return Ok(None);
        };
        let folder = self.path.as_deref().and_then(Path::parent);
        let sibling = folder.map(|folder| folder.join(base));
        if let Some(path) = sibling.filter(|path| path.is_file()) {
            return of_file(&path).map(Some);
        }
        let name = base.trim_end_matches(".toml");
        let text = shipped(name).with_context(|| {
            format!(
                "{}: `base = \"{base}\"`: there is neither a file of that name in the folder of the config nor a shipped config",
                place_of_base(&self.name, &self.text)
            )
        })?;
        Self::new(name.to_owned(), text.to_owned(), None).map(Some)
    }

    /// A key that distinguishes it from every other config.
    fn identity(&self) -> (bool, PathBuf) {
        match &self.path {
            Some(path) => (true, path.canonicalize().unwrap_or_else(|_| path.clone())),
            None => (false, PathBuf::from(&self.name)),
        }
    }
}

/// The file and the line of the key `base`.
fn place_of_base(name: &str, text: &str) -> String {
    match line_of("base", "", text) {
        Some(line) => format!("{name}, line {line}"),
        None => name.to_owned(),
    }
}

fn of_file(path: &Path) -> Result<ConfigText> {
    let text = fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
    ConfigText::new(path.display().to_string(), text, Some(path.to_owned()))
}

/// The config and then all configs on which it is based.
///
/// # Errors
/// If one of them is missing, is not TOML, or is based on itself.
pub(super) fn chain(name: &str, text: &str, path: Option<&Path>) -> Result<Vec<ConfigText>> {
    let first = ConfigText::new(name.to_owned(), text.to_owned(), path.map(Path::to_owned))?;
    let mut chain = vec![first];
    while let Some(next) = chain
        .last()
        .map(ConfigText::read_base)
        .transpose()?
        .flatten()
    {
        ensure!(
            chain
                .iter()
                .all(|above| above.identity() != next.identity()),
            "{name}: {} builds on itself; remove a `base`",
            next.name
        );
        chain.push(next);
    }
    Ok(chain)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes files and returns the names in the chain of the first one, or the error.
    fn names(files: &[(&str, &str)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            match name.strip_suffix('/') {
                Some(name) => fs::create_dir(folder.path().join(name)).unwrap(),
                None => fs::write(folder.path().join(name), text).unwrap(),
            }
        }
        let path = folder.path().join(files[0].0);
        let found = match chain(&path.display().to_string(), files[0].1, Some(&path)) {
            Ok(chain) => {
                let names: Vec<String> = chain.into_iter().map(|config| config.name).collect();
                names.join(" > ")
            }
            Err(error) => format!("{error:#}"),
        };
        found.replace(&format!("{}/", folder.path().display()), "")
    }

    #[test]
    fn a_config_builds_on_files_and_shipped_configs_at_any_depth() {
        let on = |base: &str| format!("base = \"{base}\"\n");
        for (files, expected) in [
            (vec![("a.toml", String::new())], "a.toml"),
            (vec![("a.toml", on("probe"))], "a.toml > probe > base"),
            (
                vec![("a.toml", on("b.toml")), ("b.toml", on("hour.toml"))],
                "a.toml > b.toml > hour > base",
            ),
            // A file in the folder of the config has priority over a shipped config with the same name.
            (
                vec![("a.toml", on("base.toml")), ("base.toml", String::new())],
                "a.toml > base.toml",
            ),
            // A folder is not a config, for example that of a run.
            (
                vec![("a.toml", on("base")), ("base/", String::new())],
                "a.toml > base",
            ),
            (
                vec![("a.toml", on("b.toml")), ("b.toml", on("a.toml"))],
                "a.toml: a.toml builds on itself; remove a `base`",
            ),
            (
                vec![("a.toml", on("nowhere"))],
                "a.toml, line 1: `base = \"nowhere\"`: there is neither a file of that name in the folder of the config nor a shipped config",
            ),
            (
                vec![("a.toml", on("b.toml")), ("b.toml", "x =".to_owned())],
                "b.toml, line 1: ",
            ),
            (
                vec![("a.toml", "base = 3".to_owned())],
                "a.toml, line 1: `base` must be a file name",
            ),
        ] {
            let files: Vec<(&str, &str)> = files
                .iter()
                .map(|(name, text)| (*name, text.as_str()))
                .collect();
            let found = names(&files);
            assert!(found.starts_with(expected), "{found}, not {expected}");
        }
    }
}
