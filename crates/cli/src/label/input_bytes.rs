//! Reads the input of a worker: the text of a STEP file, or a mesh or a point cloud with the file of labels next to it.

use super::step_text::{begins_as_step, file_bytes, unpacked};
use anyhow::{Context, Result};
use partprobe_carrier::{GivenShape, sha256_hex};
use partprobe_imports::{
    NamedBytes, given_shape, holds_rows_of_numbers, is_given_name, label_names_of,
};
use std::path::Path;

/// The bytes of an input.
#[derive(Debug)]
pub(super) enum InputBytes {
    /// The text of a STEP file, unpacked.
    Step(Vec<u8>),
    /// A mesh or a point cloud.
    Given(GivenBytes),
}

/// The bytes of a mesh or a cloud, and those of its labels.
#[derive(Debug)]
pub(super) struct GivenBytes {
    shape: NamedFile,
    labels: Option<NamedFile>,
}

#[derive(Debug)]
struct NamedFile {
    name: String,
    bytes: Vec<u8>,
}

impl NamedFile {
    fn as_named(&self) -> NamedBytes<'_> {
        NamedBytes {
            name: &self.name,
            bytes: &self.bytes,
        }
    }
}

/// Whether a file is a mesh or a cloud, by its name and its first bytes.
pub(super) fn is_given(name: &str, start: &[u8]) -> bool {
    let is_text = name
        .rsplit_once('.')
        .is_some_and(|(_, ending)| ending.eq_ignore_ascii_case("txt"));
    is_given_name(name) && !begins_as_step(start) && (!is_text || holds_rows_of_numbers(start))
}

impl InputBytes {
    /// Reads a file, and its labels if it is a mesh or a cloud, unless one is larger than `max_bytes`.
    ///
    /// # Errors
    /// If a file cannot be read, or is too large.
    pub(super) fn of_path(path: &Path, max_bytes: u64) -> Result<Self> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let bytes = file_bytes(path, max_bytes)?;
        if !is_given(&name, &bytes[..bytes.len().min(LOOK_BYTES)]) {
            return Ok(Self::Step(unpacked(bytes, max_bytes)?));
        }
        let labels = label_names_of(&name)
            .into_iter()
            .find(|name| path.with_file_name(name).is_file());
        let read = |name: String| -> Result<NamedFile> {
            let bytes = file_bytes(&path.with_file_name(&name), max_bytes);
            let bytes = bytes.with_context(|| name.clone())?;
            Ok(NamedFile { name, bytes })
        };
        Ok(Self::Given(GivenBytes {
            labels: labels.map(read).transpose()?,
            shape: NamedFile {
                name: name.into_owned(),
                bytes,
            },
        }))
    }

    /// The hash by which the input is recognized.
    pub(super) fn sha256(&self) -> String {
        match self {
            Self::Step(text) => sha256_hex(text),
            Self::Given(given) => given.sha256(),
        }
    }
}

/// The number of first bytes by which a file is recognized.
const LOOK_BYTES: usize = 4096;

impl GivenBytes {
    /// The hash of the file, or of both files if there are labels next to it.
    pub(super) fn sha256(&self) -> String {
        match &self.labels {
            None => sha256_hex(&self.shape.bytes),
            Some(labels) => sha256_hex(&[&*self.shape.bytes, &*labels.bytes].concat()),
        }
    }

    /// The shape with its labels.
    ///
    /// # Errors
    /// If one of the files cannot be read, or they do not match each other.
    pub(super) fn shape(&self) -> Result<GivenShape> {
        let labels = self.labels.as_ref().map(NamedFile::as_named);
        Ok(given_shape(self.shape.as_named(), labels)?)
    }
}
