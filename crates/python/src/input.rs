//! Reads the input of labeling: a STEP file (also compressed), or a mesh or a cloud with the label file in the same folder.

use crate::errors::{os_error, step_error, usage};
use partprobe_carrier::{GivenShape, sha256_hex};
use partprobe_formats::{UnpackError, step_stem, unpacked_step};
use partprobe_imports::{
    NamedBytes, given_shape, given_stem, holds_rows_of_numbers, is_given_name, label_names_of,
};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use std::fs;
use std::path::{Path, PathBuf};

/// A path, or the text of a STEP file.
#[derive(FromPyObject)]
pub(crate) enum Source {
    /// The text, which may be compressed.
    #[pyo3(transparent, annotation = "bytes")]
    Text(PyBackedBytes),
    /// A file.
    #[pyo3(transparent, annotation = "str | os.PathLike")]
    File(PathBuf),
}

/// The input that the caller gives.
///
/// # Errors
/// `TypeError` if it is neither a path nor bytes.
pub(crate) fn source_of(given: &Bound<'_, PyAny>) -> PyResult<Source> {
    given.extract().map_err(|_| {
        let kind = given.get_type();
        let name = kind
            .name()
            .map_or_else(|_| "another type".to_owned(), |name| name.to_string());
        PyTypeError::new_err(format!(
            "give a path (str or os.PathLike), or the bytes of a STEP file, not {name}"
        ))
    })
}

/// The content of the input.
pub(crate) enum Content {
    /// The text of a STEP file.
    Step(Vec<u8>),
    /// A mesh or a cloud, and the hash of its files.
    Given(GivenShape, String),
}

/// The number of bytes at the start of a file by which its format is recognized.
const LOOK_BYTES: usize = 4096;
/// The beginning of a STEP file.
const STEP_HEADER: &[u8] = b"ISO-10303-21";

impl Source {
    /// The name of the file in messages, or `None` for bytes.
    pub(crate) fn file(&self) -> Option<String> {
        match self {
            Self::Text(_) => None,
            Self::File(path) => Some(path.display().to_string()),
        }
    }

    /// The id of the shape, unless the caller gives another one.
    pub(crate) fn id(&self) -> String {
        let Self::File(path) = self else {
            return "shape".to_owned();
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let stem = step_stem(&name).or_else(|| given_stem(&name));
        stem.map_or_else(|| name.clone().into_owned(), str::to_owned)
    }

    /// Reads and decompresses the input.
    ///
    /// # Errors
    /// If a file cannot be read, is larger than `max_bytes`, or its container is damaged.
    pub(crate) fn read(&self, max_bytes: u64) -> PyResult<Content> {
        let path = match self {
            Self::Text(bytes) => {
                return Ok(Content::Step(self.unpacked(bytes.to_vec(), max_bytes)?));
            }
            Self::File(path) => path,
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("npz"))
        {
            return Err(usage(format!(
                "{} is labeled already; read it with Carrier.load",
                path.display()
            )));
        }
        let bytes = self.bytes_of(path, max_bytes)?;
        if is_given(&name, &bytes[..bytes.len().min(LOOK_BYTES)]) {
            return self.given(&name, path, &bytes, max_bytes);
        }
        Ok(Content::Step(self.unpacked(bytes, max_bytes)?))
    }

    fn given(&self, name: &str, path: &Path, bytes: &[u8], max_bytes: u64) -> PyResult<Content> {
        let labels = label_names_of(name)
            .into_iter()
            .find(|name| path.with_file_name(name).is_file());
        let labels = labels
            .map(|name| {
                Ok::<_, PyErr>((self.bytes_of(&path.with_file_name(&name), max_bytes)?, name))
            })
            .transpose()?;
        let named = labels
            .as_ref()
            .map(|(bytes, name)| NamedBytes { name, bytes });
        let shape = given_shape(NamedBytes { name, bytes }, named)
            .map_err(|error| step_error(error, self.file().as_deref(), "failed"))?;
        let hash = match &labels {
            None => sha256_hex(bytes),
            Some((labels, _)) => sha256_hex(&[bytes, labels.as_slice()].concat()),
        };
        Ok(Content::Given(shape, hash))
    }

    fn bytes_of(&self, path: &Path, max_bytes: u64) -> PyResult<Vec<u8>> {
        let size = fs::metadata(path)
            .map_err(|error| os_error(&error, path))?
            .len();
        if size > max_bytes {
            return Err(self.too_large(max_bytes));
        }
        fs::read(path).map_err(|error| os_error(&error, path))
    }

    fn unpacked(&self, bytes: Vec<u8>, max_bytes: u64) -> PyResult<Vec<u8>> {
        if bytes.len() as u64 > max_bytes {
            return Err(self.too_large(max_bytes));
        }
        unpacked_step(bytes, max_bytes).map_err(|error| match error {
            UnpackError::TooLarge { .. } => self.too_large(max_bytes),
            other => step_error(other, self.file().as_deref(), "failed"),
        })
    }

    fn too_large(&self, max_bytes: u64) -> PyErr {
        let reason = format!(
            "the file has more than {} MB; raise max_file_mb",
            max_bytes >> 20
        );
        step_error(reason, self.file().as_deref(), "over-budget")
    }
}

/// Whether a file is a mesh or a cloud, by its name and its first bytes.
fn is_given(name: &str, start: &[u8]) -> bool {
    let is_step = start
        .windows(STEP_HEADER.len())
        .any(|window| window.eq_ignore_ascii_case(STEP_HEADER));
    let is_text = name.to_ascii_lowercase().ends_with(".txt");
    is_given_name(name) && !is_step && (!is_text || holds_rows_of_numbers(start))
}
