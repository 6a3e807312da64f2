//! Reads the file of a carrier, and notices if it was changed, cut off or exchanged.

use partprobe_carrier::Carrier;
use partprobe_formats::CarrierFileError;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The location of a carrier, and the values that it must have. Values that are `None` are unknown and are not compared.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CarrierRef {
    /// The file.
    pub path: PathBuf,
    /// The id of its shape.
    pub id: Option<String>,
    /// SHA-256 of the STEP text from which it was made.
    pub source_sha256: Option<String>,
    /// The hash of its contents.
    pub content_hash: Option<String>,
}

/// A carrier that is missing, damaged or changed. The data set is no longer what was labeled.
#[derive(Debug, thiserror::Error)]
#[error("{}", path.display())]
pub struct DamagedCarrier {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    #[source]
    pub reason: DamageReason,
}

/// What is wrong with the file of a carrier.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DamageReason {
    /// It cannot be read.
    #[error("reading the carrier")]
    Unreadable(#[source] io::Error),
    /// It does not hold a carrier.
    #[error(transparent)]
    NotACarrier(#[from] CarrierFileError),
    /// It holds the carrier of another shape.
    #[error(
        "this is the carrier of shape {found}, not of {expected}; put the files back, or label again"
    )]
    OtherShape {
        /// The shape that it says it is.
        found: String,
        /// The shape that it should be.
        expected: String,
    },
    /// It was made from another STEP text.
    #[error(
        "the carrier was made from another STEP text than its data set says; put the file back, or label again"
    )]
    OtherText,
    /// Its content has another hash.
    #[error(
        "the carrier was changed after it was labeled: it has the hash {found}, not {expected}; put the file \
         back, or label again"
    )]
    Changed {
        /// The hash that it has.
        found: String,
        /// The hash that it should have.
        expected: String,
    },
}

impl CarrierRef {
    /// A file about which nothing is known except its own contents.
    #[must_use]
    pub fn alone(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            ..Self::default()
        }
    }

    /// Reads the carrier, and returns it with the hash of its contents.
    ///
    /// # Errors
    /// If the file cannot be read, is damaged, or is not the one that was written for the shape.
    pub fn read(&self) -> Result<(Carrier, String), DamagedCarrier> {
        self.read_as_labeled().map_err(|reason| DamagedCarrier {
            path: self.path.clone(),
            reason,
        })
    }

    fn read_as_labeled(&self) -> Result<(Carrier, String), DamageReason> {
        let bytes = fs::read(&self.path).map_err(DamageReason::Unreadable)?;
        let (carrier, hash) = partprobe_formats::hashed_carrier_from_npz(&bytes)?;
        let hash = hash.to_string();
        self.ensure_is(&carrier, &hash)?;
        Ok((carrier, hash))
    }

    fn ensure_is(&self, carrier: &Carrier, hash: &str) -> Result<(), DamageReason> {
        let meta = carrier.meta();
        let differs = |expected: &&String, found: &str| expected.as_str() != found;

        if let Some(expected) = self.id.as_ref().filter(|id| differs(id, &meta.id)) {
            return Err(DamageReason::OtherShape {
                found: meta.id.clone(),
                expected: expected.clone(),
            });
        }
        let text = self.source_sha256.as_ref();
        if text.is_some_and(|expected| *expected != meta.source_sha256) {
            return Err(DamageReason::OtherText);
        }
        if let Some(expected) = self.content_hash.as_ref().filter(|own| differs(own, hash)) {
            return Err(DamageReason::Changed {
                found: hash.to_owned(),
                expected: expected.clone(),
            });
        }
        Ok(())
    }
}
