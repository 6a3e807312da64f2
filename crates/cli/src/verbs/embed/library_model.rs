//! Records the backbone of a folder of embeddings, so that no other backbone adds to it, and so that `nearest` can embed a query
//! in the same way.

use super::form::Form;
use crate::backbone::BackboneArgs;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{json_document, write_atomically};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// The name of the file in the folder of embeddings.
pub(super) const FILE: &str = "embed.json";
/// The version of its layout.
const FORMAT_VERSION: u32 = 1;

/// The backbone and the settings of a folder of embeddings.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(super) struct LibraryModel {
    format_version: u32,
    /// The form of the rows.
    pub(super) form: String,
    /// The run folder or the file of weights, as an absolute path, and the choice of the backbone.
    pub(super) backbone: BackboneArgs,
    /// The SHA-256 of the weights.
    weights_sha256: String,
    /// The settings of the user.
    pub(super) set: Vec<String>,
}

impl LibraryModel {
    /// The backbone that the arguments name, and the hash of its weights.
    ///
    /// # Errors
    /// If it is no longer there.
    pub(super) fn of(
        backbone: &BackboneArgs,
        weights_sha256: &str,
        set: &[String],
        form: Form,
    ) -> Result<Self> {
        Ok(Self {
            format_version: FORMAT_VERSION,
            form: form.name().to_owned(),
            weights_sha256: weights_sha256.to_owned(),
            backbone: backbone.absolute()?,
            set: set.to_vec(),
        })
    }

    /// The backbone of a folder of embeddings.
    ///
    /// # Errors
    /// If the folder does not contain it.
    pub(super) fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        ensure!(
            Self::is_in(folder),
            UsageError(format!(
                "{} has no {FILE}; make it with `partprobe embed RUN PATH… --form shapes --out {}`",
                folder.display(),
                folder.display()
            ))
        );
        let text = fs::read_to_string(&path)?;
        serde_json::from_str(&text).with_context(|| {
            format!(
                "{} is damaged, or of another version; embed again",
                path.display()
            )
        })
    }

    /// Whether a folder is one of embeddings.
    pub(super) fn is_in(folder: &Path) -> bool {
        folder.join(FILE).is_file()
    }

    /// Refuses weights other than those of the folder.
    ///
    /// # Errors
    /// If they differ.
    pub(super) fn ensure_weights(&self, sha256: &str) -> Result<()> {
        ensure!(
            self.weights_sha256 == sha256,
            UsageError(
                "these are not the weights that the library was made with; embed it again, or give its own".to_owned()
            )
        );
        Ok(())
    }

    /// Writes the file into a folder of embeddings.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn write(&self, folder: &Path) -> Result<()> {
        let bytes = json_document(self)?;
        Ok(write_atomically(&folder.join(FILE), &bytes)?)
    }

    /// Refuses a folder that another call has filled.
    ///
    /// # Errors
    /// If the folder has embeddings of another backbone, form or settings.
    pub(super) fn ensure_fits(&self, folder: &Path) -> Result<()> {
        if !Self::is_in(folder) {
            return Ok(());
        }
        let own = Self::read(folder)?;
        let is_same = own.weights_sha256 == self.weights_sha256
            && own.form == self.form
            && own.set == self.set;
        ensure!(
            is_same,
            UsageError(format!(
                "{} has embeddings of another backbone, form or setting; choose another --out",
                folder.display()
            ))
        );
        Ok(())
    }
}
