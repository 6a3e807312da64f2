//! A carrier's file and what its data set says of it: a file that was changed, cut off or exchanged is noticed when it
//! is read.

use crate::counted::counted;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::Carrier;
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

/// A carrier that is missing, damaged or changed: the data set is no longer what was labeled.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DamagedCarrier {
    path: PathBuf,
}

impl DamagedCarrier {
    /// Whether an error says that a carrier is not what was labeled.
    #[must_use]
    pub fn is_in(error: &anyhow::Error) -> bool {
        error.is::<Self>()
    }

    /// Ends a verb that has written everything else.
    ///
    /// # Errors
    /// If any carrier was damaged.
    pub fn none_among(n_damaged: usize) -> Result<()> {
        ensure!(
            n_damaged == 0,
            "{} cannot be used; everything else is written. Label again with --resume to replace what is damaged",
            counted(n_damaged, "carrier", "carriers")
        );
        Ok(())
    }
}

impl std::fmt::Display for DamagedCarrier {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.path.display())
    }
}

impl CarrierRef {
    /// A file of which nothing is known but what it says itself.
    #[must_use]
    pub fn alone(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            ..Self::default()
        }
    }

    /// Reads the carrier, and gives the hash of what its file holds.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or is not the one that was written for the shape; the error is a
    /// [`DamagedCarrier`].
    pub fn read(&self) -> Result<(Carrier, String)> {
        self.read_as_labeled().with_context(|| DamagedCarrier {
            path: self.path.clone(),
        })
    }

    fn read_as_labeled(&self) -> Result<(Carrier, String)> {
        let bytes = fs::read(&self.path).context("reading the carrier")?;
        let (carrier, hash) = partprobe_formats::hashed_carrier_from_npz(&bytes)?;
        let hash = hash.to_string();
        self.ensure_is(&carrier, &hash)?;
        Ok((carrier, hash))
    }

    fn ensure_is(&self, carrier: &Carrier, hash: &str) -> Result<()> {
        let (id, source) = (&carrier.meta().id, &carrier.meta().source_sha256);
        if let Some(expected) = self.id.as_ref().filter(|expected| *expected != id) {
            anyhow::bail!(
                "this is the carrier of shape {id}, not of {expected}; put the files back, or label again"
            );
        }
        ensure!(
            self.source_sha256
                .as_ref()
                .is_none_or(|expected| expected == source),
            "the carrier was made from another STEP text than its data set says; put the file back, or label again"
        );
        if let Some(expected) = self
            .content_hash
            .as_ref()
            .filter(|expected| *expected != hash)
        {
            anyhow::bail!(
                "the carrier was changed after it was labeled: it has the hash {hash}, not {expected}; put the file \
                 back, or label again"
            );
        }
        Ok(())
    }
}
