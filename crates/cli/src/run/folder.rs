//! The run folder: where each file of a run stands.

use crate::atomic_write::write_atomically;
use anyhow::{Context, Result, bail};
use serde::Serialize;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A run's folder. Every file in it is written whole, by rename; `log.jsonl` alone is appended to.
#[derive(Clone, Debug)]
pub(crate) struct RunFolder {
    root: PathBuf,
}

impl RunFolder {
    /// Makes a new folder, or opens one that holds the same merged config when `resume` is set.
    ///
    /// # Errors
    /// If the folder holds something else, or cannot be made.
    pub(crate) fn open(root: &Path, merged_config: &str, resume: bool) -> Result<Self> {
        let folder = Self { root: root.to_owned() };
        let is_used = root.is_dir() && fs::read_dir(root).with_context(|| root.display().to_string())?.next().is_some();
        match (is_used, resume) {
            (false, _) => {
                fs::create_dir_all(root).with_context(|| format!("making {}", root.display()))?;
                folder.write("config.toml", merged_config.as_bytes())?;
            }
            (true, false) => bail!("{} is not empty; go on with --resume, or choose another --out", root.display()),
            (true, true) => {
                let stored = folder.read_text("config.toml")?;
                if stored != merged_config {
                    bail!("{} was made with another config; resume with the same config and --set", root.display());
                }
            }
        }
        Ok(folder)
    }

    /// Opens a folder that a run has made.
    ///
    /// # Errors
    /// If it holds no `config.toml`.
    pub(crate) fn existing(root: &Path) -> Result<Self> {
        let folder = Self { root: root.to_owned() };
        if !folder.path("config.toml").is_file() {
            bail!("{} is no run folder: it has no config.toml", root.display());
        }
        Ok(folder)
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

    /// Writes a file whole, making its folder.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn write(&self, relative: &str, bytes: &[u8]) -> Result<()> {
        let path = self.path(relative);
        if let Some(parent) = path.parent() {
            fs::create_dir_all(parent).with_context(|| format!("making {}", parent.display()))?;
        }
        write_atomically(&path, bytes)
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
