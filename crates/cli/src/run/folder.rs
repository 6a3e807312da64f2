//! Names the files of a run folder, and controls write access to it.

use super::damaged_json::damaged_json;
use super::longer::{ensure_longer, is_of_length};
use super::next_command::eval_with;
use super::scoring_keys::is_scoring;
use crate::config::{Config, Difference, are_same_place, differences, listed};
use crate::run_path::run_path;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_dataset::{is_locked_elsewhere, write_atomically};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The file that a program locks while it works in the folder. The lock ends with the program.
const LOCK_FILE: &str = ".lock";
/// The files of a run before its first result: its config, its facts, and its labeled shapes.
const PREPARED: [&str; 4] = [LOCK_FILE, "config.toml", "run.json", "data"];
/// The files that an evaluation writes at its end. A folder that has the last of them is complete.
const RESULTS: [&str; 8] = [
    "scores.jsonl",
    "expectations.json",
    "expectations.xml",
    "tables.md",
    "tables.csv",
    "tables.json",
    "paper.md",
    "report.html",
];
/// The folders that an evaluation fills.
const EVALUATED: [&str; 4] = ["test", "predictions", "embeddings", "endpoints"];

/// A run's folder, in which no other program works. Every file in it is written at once, by rename. Only `log.jsonl` is appended
/// to.
#[derive(Debug)]
pub(crate) struct RunFolder {
    root: PathBuf,
    /// The lock file, which is locked as long as this value exists; `None` if the folder is only read.
    _lock: Option<File>,
}

impl RunFolder {
    /// Makes a new folder, or opens one with the same merged config if `resume` is set.
    ///
    /// # Errors
    /// If the folder has other content, another program works in it, or it cannot be made.
    pub(crate) fn open(root: &Path, merged_config: &str, resume: bool) -> Result<Self> {
        if !is_used(root)? {
            fs::create_dir_all(root).with_context(|| format!("making {}", root.display()))?;
            let folder = Self::locked(root)?;
            // Another program may have used the folder between the check and the lock.
            if !is_used(root)? {
                folder.write("config.toml", merged_config.as_bytes())?;
                return Ok(folder);
            }
        }
        ensure!(
            resume || is_same_call(root, merged_config)?,
            UsageError(format!(
                "{} is not empty; resume the run in it with --resume, or choose another --out",
                root.display()
            ))
        );
        let folder = Self::existing(root)?;
        folder.take_config(merged_config)?;
        Ok(folder)
    }

    /// Opens the folder of a run. The folder of a verdict means the run in it.
    ///
    /// # Errors
    /// If it has no `config.toml`, or another program works in it.
    pub(crate) fn existing(root: &Path) -> Result<Self> {
        let root = run_path(root);
        ensure_is_run(&root)?;
        Self::locked(&root)
    }

    fn locked(root: &Path) -> Result<Self> {
        let path = root.join(LOCK_FILE);
        let opened = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path);
        let lock = opened.with_context(|| format!("opening {}", path.display()))?;
        ensure!(
            !is_locked_elsewhere(&lock),
            UsageError(format!(
                "another partprobe is working in {}; wait until it ends, or choose another folder",
                root.display()
            ))
        );
        Ok(Self {
            root: root.to_owned(),
            _lock: Some(lock),
        })
    }

    /// Opens a folder that a run has made, and writes nothing to it: it may be read-only, or in use.
    ///
    /// # Errors
    /// If it holds no `config.toml`.
    pub(crate) fn open_read_only(root: &Path) -> Result<Self> {
        let root = run_path(root);
        ensure_is_run(&root)?;
        Ok(Self { root, _lock: None })
    }

    /// Refuses a config that differs from the one with which the run was started. A config that only makes the training longer
    /// replaces it, and the scores of the shorter training are removed.
    fn take_config(&self, merged_config: &str) -> Result<()> {
        let stored = self.read_text("config.toml")?;
        if stored == merged_config {
            return Ok(());
        }
        if let Err(error) = stored.parse::<toml::Table>() {
            bail!(
                "{} is damaged: {}; put back a copy of the file, or make a new run folder",
                self.path("config.toml").display(),
                error.message()
            );
        }
        let of_another_version = || {
            format!(
                "{} was written by another version of partprobe",
                self.path("config.toml").display()
            )
        };
        let stored: Config = toml::from_str(&stored).with_context(of_another_version)?;
        let mut differing = differences(&stored, &toml::from_str::<Config>(merged_config)?);
        // The data of a run are determined by run.json and split.json, and not by their path. The same holds for imported labels.
        let is_place = |key: &str| {
            key.starts_with("data.") || (key.starts_with("sources.") && key.ends_with(".path"))
        };
        // Runs of earlier versions have relative paths.
        let is_same = |difference: &Difference| are_same_place(&difference.here, &difference.there);
        differing.retain(|difference| !is_place(&difference.key) && !is_same(difference));
        if differing.is_empty() {
            return Ok(());
        }
        let all =
            |holds: fn(&str) -> bool| differing.iter().all(|difference| holds(&difference.key));

        // Nothing has started from the former weights yet.
        if all(|key| key == "train.init") && !self.path("checkpoints").exists() {
            return self.write("config.toml", merged_config.as_bytes());
        }
        if all(is_of_length) {
            let config: Config = toml::from_str(merged_config)?;
            ensure_longer(&stored, &config, &differing).with_context(|| {
                format!("{} was started with another config", self.root.display())
            })?;
            self.forget_evaluation()?;
            return self.write("config.toml", merged_config.as_bytes());
        }
        // `eval --set` may have changed these keys after the run.
        let eval = if all(is_scoring) {
            eval_with(&self.root, &differing)
        } else {
            None
        };
        let advice = match eval {
            Some(eval) => {
                format!(
                    "give the former value with --set, or change it in the folder first: {eval}"
                )
            }
            None => "resume with the same config and --set, or choose another --out".to_owned(),
        };
        bail!(UsageError(format!(
            "{} was started with another config: {}; {advice}",
            self.root.display(),
            listed(&differing)
        )))
    }

    /// Removes the results of a previous evaluation. Then the folder is not evaluated.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub(crate) fn forget_evaluation(&self) -> Result<()> {
        for file in RESULTS {
            removed(fs::remove_file(self.path(file)), &self.path(file))?;
        }
        for folder in EVALUATED {
            removed(fs::remove_dir_all(self.path(folder)), &self.path(folder))?;
        }
        Ok(())
    }

    /// The folder itself.
    #[must_use]
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// A path inside the folder.
    #[must_use]
    pub(crate) fn path(&self, relative: &str) -> PathBuf {
        self.root.join(relative)
    }

    /// Writes a file at once, and makes its folder.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn write(&self, relative: &str, bytes: &[u8]) -> Result<()> {
        let path = self.path(relative);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).with_context(|| format!("making {}", parent.display()))?;
        }
        Ok(write_atomically(&path, bytes)?)
    }

    /// Writes a value as indented JSON.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn write_json(&self, relative: &str, value: &impl Serialize) -> Result<()> {
        let mut bytes = serde_json::to_vec_pretty(value)?;
        bytes.push(b'\n');
        self.write(relative, &bytes)
    }

    /// Reads a JSON file. The advice tells the user what to do if it is damaged.
    ///
    /// # Errors
    /// If it cannot be read, or is damaged. The message names the place of the damage.
    pub(crate) fn read_json<T: DeserializeOwned>(&self, relative: &str, advice: &str) -> Result<T> {
        let bytes = self.read(relative)?;
        serde_json::from_slice(&bytes)
            .map_err(|error| anyhow::anyhow!(damaged_json(&self.path(relative), &error, advice)))
    }

    /// Reads a file as bytes.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn read(&self, relative: &str) -> Result<Vec<u8>> {
        let path = self.path(relative);
        fs::read(&path).with_context(|| format!("reading {}", path.display()))
    }

    /// Reads a file as text.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(crate) fn read_text(&self, relative: &str) -> Result<String> {
        let path = self.path(relative);
        fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))
    }

    /// Appends one line of JSON to `log.jsonl`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn log(&self, line: &impl Serialize) -> Result<()> {
        let mut bytes = serde_json::to_vec(line)?;
        bytes.push(b'\n');
        let path = self.path("log.jsonl");
        let mut file = fs::OpenOptions::new().create(true).append(true).open(&path);
        file.as_mut()
            .map_err(|error| anyhow::anyhow!("{error}"))
            .and_then(|file| Ok(file.write_all(&bytes)?))
            .with_context(|| format!("writing {}", path.display()))
    }
}

/// Whether a folder has a run with this config that ended before its first result, for example because a file was missing. Then
/// nothing is lost if the same call starts again.
fn is_same_call(root: &Path, merged_config: &str) -> Result<bool> {
    let stored = fs::read_to_string(root.join("config.toml"));
    let is_same = stored.is_ok_and(|stored| stored == merged_config);
    Ok(is_same && !holds_more_than(root, &PREPARED)?)
}

fn ensure_is_run(root: &Path) -> Result<()> {
    if root.join("config.toml").is_file() {
        return Ok(());
    }
    let reason = match root.is_dir() {
        true => "is not a run folder: it has no config.toml",
        false => "is not a folder",
    };
    bail!(UsageError(format!("{} {reason}", root.display())));
}

/// Whether a folder has other files than a lock.
fn is_used(root: &Path) -> Result<bool> {
    Ok(root.is_dir() && holds_more_than(root, &[LOCK_FILE])?)
}

fn holds_more_than(root: &Path, names: &[&str]) -> Result<bool> {
    let context = || format!("reading {}", root.display());
    for entry in fs::read_dir(root).with_context(context)? {
        let name = entry.with_context(context)?.file_name();
        if !names.iter().any(|known| name == *known) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The result of a removal. A file that does not exist is not an error.
fn removed(outcome: std::io::Result<()>, path: &Path) -> Result<()> {
    match outcome {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::load;

    #[test]
    fn two_at_once_are_refused_and_a_lock_of_a_dead_process_does_not_block() {
        let parent = tempfile::tempdir().unwrap();
        let root = parent.path().join("run");
        let config = load("smoke", &[]).unwrap().merged;
        let first = RunFolder::open(&root, &config, false).unwrap();
        for second in [
            RunFolder::open(&root, &config, true),
            RunFolder::existing(&root),
        ] {
            let message = second.unwrap_err();
            assert!(
                message.is::<UsageError>()
                    && message
                        .to_string()
                        .contains("another partprobe is working in"),
                "{message}"
            );
        }
        drop(first);
        assert!(root.join(LOCK_FILE).exists());
        assert!(RunFolder::open(&root, &config, true).is_ok());
        assert!(
            RunFolder::open(&root, &config, false).is_ok(),
            "nothing is lost if a call starts again that ended before its first result"
        );
        // The cases are a split, trainings without their split, and the fits of an implicit probe, which has no split.
        for result in ["split.json", "checkpoints", "fits"] {
            fs::create_dir(root.join(result)).unwrap();
            let message = RunFolder::open(&root, &config, false).unwrap_err();
            assert!(
                message.to_string().contains("--resume"),
                "{result}: {message}"
            );
            fs::remove_dir(root.join(result)).unwrap();
        }

        // The folder of a program that was killed before its first file.
        let killed = parent.path().join("killed");
        fs::create_dir(&killed).unwrap();
        fs::write(killed.join(LOCK_FILE), "").unwrap();
        assert!(RunFolder::open(&killed, &config, false).is_ok());
    }

    #[test]
    fn another_config_is_named_by_its_keys() {
        let root = tempfile::tempdir().unwrap();
        let config = |set: &str| load("smoke", &[set.to_owned()]).unwrap().merged;
        drop(RunFolder::open(root.path(), &config("train.steps=3"), false).unwrap());
        let message = RunFolder::open(root.path(), &config("train.steps=4"), true).unwrap_err();
        let message = format!("{message:#}");
        assert!(message.contains("train.steps is 3, not 4"), "{message}");
        assert!(
            message.contains("must give all former updates the same learning rate"),
            "{message}"
        );
        assert!(message.contains("--init"), "{message}");
        assert!(RunFolder::open(root.path(), &config("train.steps=3"), true).is_ok());
    }

    #[test]
    fn tables_of_a_shorter_training_are_not_kept_with_the_config_of_a_longer_one() {
        let root = tempfile::tempdir().unwrap();
        let config = |set: &str| {
            let overrides = [r#"optim.schedule={type="constant"}"#, set].map(str::to_owned);
            load("smoke", &overrides).unwrap().merged
        };
        let short = RunFolder::open(root.path(), &config("train.steps=3"), false).unwrap();
        short.write("tables.md", b"scores").unwrap();
        drop(short);

        let same = RunFolder::open(root.path(), &config("train.steps=3"), true).unwrap();
        assert!(same.path("tables.md").exists());
        drop(same);
        let longer = RunFolder::open(root.path(), &config("train.steps=4"), true).unwrap();
        assert!(!longer.path("tables.md").exists());
        assert_eq!(
            longer.read_text("config.toml").unwrap(),
            config("train.steps=4")
        );
    }

    #[test]
    fn an_evaluation_is_removed_completely_and_a_training_is_not() {
        let root = tempfile::tempdir().unwrap();
        let folder =
            RunFolder::open(root.path(), &load("smoke", &[]).unwrap().merged, false).unwrap();
        for file in [
            "scores.jsonl",
            "report.html",
            "test/a.npz",
            "predictions/p-0/a.npz",
            "checkpoints/p-0/last",
        ] {
            folder.write(file, b"x").unwrap();
        }
        folder.forget_evaluation().unwrap();
        folder.forget_evaluation().unwrap();
        let mut left: Vec<String> = fs::read_dir(root.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        left.sort();
        assert_eq!(left, [".lock", "checkpoints", "config.toml"]);
    }
}
