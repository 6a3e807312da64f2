//! A carrier's file and what its data set says of it: a file that was changed, cut off or exchanged is noticed when it
//! is read.

use anyhow::{Context, Result, ensure};
use carrier::Carrier;
use std::fs;
use std::path::{Path, PathBuf};

/// Where a carrier is, and what must be true of it; what is `None` is not known, and not compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CarrierRef {
    /// The file.
    pub path: PathBuf,
    /// The id of its shape.
    pub id: Option<String>,
    /// SHA-256 of the STEP text that it was made from.
    pub source_sha256: Option<String>,
    /// The hash of what it holds.
    pub content_hash: Option<String>,
}

impl CarrierRef {
    /// A file of which nothing is known but what it says itself.
    #[must_use]
    pub fn alone(path: &Path) -> Self {
        Self { path: path.to_owned(), ..Self::default() }
    }

    /// Reads the carrier, and gives the hash of what its file holds.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or is not the one that was written for the shape; the path is named.
    pub fn read(&self) -> Result<(Carrier, String)> {
        let bytes = fs::read(&self.path).with_context(|| format!("reading {}", self.path.display()))?;
        let (carrier, hash) =
            formats::hashed_carrier_from_npz(&bytes).with_context(|| self.path.display().to_string())?;
        let hash = hash.to_string();
        self.ensure_is(&carrier, &hash).with_context(|| self.path.display().to_string())?;
        Ok((carrier, hash))
    }

    fn ensure_is(&self, carrier: &Carrier, hash: &str) -> Result<()> {
        let (id, source) = (&carrier.meta().id, &carrier.meta().source_sha256);
        if let Some(expected) = self.id.as_ref().filter(|expected| *expected != id) {
            anyhow::bail!("this is the carrier of shape {id}, not of {expected}; put the files back, or label again");
        }
        ensure!(
            self.source_sha256.as_ref().is_none_or(|expected| expected == source),
            "the carrier was made from another STEP text than its data set says; put the file back, or label again"
        );
        if let Some(expected) = self.content_hash.as_ref().filter(|expected| *expected != hash) {
            anyhow::bail!(
                "the carrier was changed after it was labelled: it has the hash {hash}, not {expected}; put the file \
                 back, or label again"
            );
        }
        Ok(())
    }
}
