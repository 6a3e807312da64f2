//! Converts the errors of the libraries to the exceptions of `partprobe._errors`.

use partprobe_brep::ReadError;
use partprobe_dataset::{DamageReason, DamagedCarrier, DatasetError, OutputError};
use partprobe_label::LabelError;
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::error::Error;
use std::io;
use std::path::Path;

pyo3::import_exception!(partprobe._errors, StepError);
pyo3::import_exception!(partprobe._errors, UsageError);
pyo3::import_exception!(partprobe._errors, DamagedFileError);

/// The messages of an error and its causes, in one line.
fn sentence(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}

/// The exception for a mistake of the caller.
pub(crate) fn usage(error: impl ToString) -> PyErr {
    UsageError::new_err(error.to_string())
}

/// The exception that Python itself raises for a file that cannot be opened, for example `FileNotFoundError`.
pub(crate) fn os_error(error: &io::Error, path: &Path) -> PyErr {
    let code = error.raw_os_error().unwrap_or(0);
    // Rust appends the number of the error, but Python puts it in front.
    let text = error.to_string();
    let text = text.split(" (os error").next().unwrap_or_default();
    PyOSError::new_err((code, text.to_owned(), path.display().to_string()))
}

/// The exception for a file that cannot be labeled.
pub(crate) fn step_error(reason: impl ToString, file: Option<&str>, status: &str) -> PyErr {
    StepError::new_err((
        reason.to_string(),
        file.map(str::to_owned),
        None::<u64>,
        status.to_owned(),
    ))
}

/// The exception for a file, or a shape in it, that has no carrier. `entity` is the first lost entity.
pub(crate) fn label_error(error: &LabelError, file: Option<&str>) -> PyErr {
    if let LabelError::Layer(error) = error {
        return usage(error);
    }
    let status = if error.is_over_budget() {
        "over-budget"
    } else {
        "failed"
    };
    let entity = match error {
        LabelError::Read(ReadError::NoFaces { lost }) => lost.first().map(|lost| lost.step_id),
        _ => None,
    };
    let file = file.map(str::to_owned);
    StepError::new_err((error.to_string(), file, entity, status.to_owned()))
}

/// The exception for a damaged file of partprobe.
pub(crate) fn damaged(error: &dyn Error, path: &Path) -> PyErr {
    DamagedFileError::new_err((sentence(error), path.display().to_string()))
}

/// The exception for a carrier that cannot be read.
pub(crate) fn carrier_error(error: &DamagedCarrier) -> PyErr {
    match &error.reason {
        DamageReason::Unreadable(reason) => os_error(reason, &error.path),
        reason => damaged(reason, &error.path),
    }
}

/// The exception for a data set, or a shape in it, that cannot be read.
pub(crate) fn dataset_error(error: &DatasetError, root: &Path) -> PyErr {
    match error {
        DatasetError::Damaged(carrier) => carrier_error(carrier),
        DatasetError::Unreadable { path, source } => os_error(source, path),
        misuse if misuse.is_misuse() => usage(misuse),
        damage => damaged(damage, root),
    }
}

/// The exception for a file that cannot be written.
pub(crate) fn output_error(error: &OutputError) -> PyErr {
    match error.source().and_then(|cause| cause.downcast_ref()) {
        Some(cause) => os_error(cause, error.path()),
        None => PyOSError::new_err(sentence(error)),
    }
}
