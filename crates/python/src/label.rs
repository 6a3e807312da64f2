//! Defines the functions `label` and `label_all`, which label a file.

use crate::background::compute;
use crate::carrier::PyCarrier;
use crate::errors::{label_error, usage};
use crate::input::{Content, Source, source_of};
use crate::label_options::label_options;
use partprobe_carrier::Carrier;
use partprobe_label::{LabelError, LabeledFile};
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ffi::CString;

/// Labels one shape: a STEP file (also compressed), a mesh, a point cloud, or the bytes of a STEP file.
///
/// The options are the keys of `[label]` in a config, for example `theta_deg=8.0`, and `label_options()` lists them with
/// their defaults. `id` is the id of the shape; if not given, it is the name of the file without its ending. The same id,
/// seed and options give the same points as the program.
///
/// Raises `StepError` with `file`, `entity` and `status` if the file cannot be labeled, `OSError` if it cannot be opened,
/// `TypeError` for an option that does not exist, and `UsageError` if `unit="solid"` finds several solids. `label_all` returns
/// all of them.
///
/// >>> import partprobe
/// >>> carrier = partprobe.label(partprobe.synth(seed=7), id="bracket", theta_deg=8.0)
/// >>> carrier
/// <partprobe.Carrier bracket: 11 faces, 11 parts, 350 triangles>
/// >>> int(carrier.face_label.max()) + 1
/// 11
#[pyfunction]
#[pyo3(signature = (source, *, id=None, **options))]
pub(crate) fn label(
    py: Python<'_>,
    #[pyo3(from_py_with = source_of)] source: Source,
    id: Option<String>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<PyCarrier> {
    let (file, mut carriers) = labeled(py, source, id, options)?;
    match carriers.len() {
        1 => Ok(carriers.remove(0)),
        n => Err(usage(format!(
            "{} has {n} distinct solids; label_all returns all of them",
            file.as_deref().unwrap_or("the file")
        ))),
    }
}

/// Labels all shapes of a file: each distinct solid with `unit="solid"`, otherwise the file as one shape.
///
/// The arguments are those of `label`. A solid that cannot be labeled is left out with a warning that names it. If no solid
/// can be labeled, the reason of the first is raised.
///
/// >>> import partprobe
/// >>> [carrier.id for carrier in partprobe.label_all(partprobe.synth(seed=7), id="bracket", unit="solid")]
/// ['bracket__s0']
#[pyfunction]
#[pyo3(signature = (source, *, id=None, **options))]
pub(crate) fn label_all(
    py: Python<'_>,
    #[pyo3(from_py_with = source_of)] source: Source,
    id: Option<String>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<PyCarrier>> {
    labeled(py, source, id, options).map(|(_, carriers)| carriers)
}

/// The name of the file and its shapes. There is at least one shape.
fn labeled(
    py: Python<'_>,
    source: Source,
    id: Option<String>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<(Option<String>, Vec<PyCarrier>)> {
    let options = label_options(options)?;
    let name = source.file();
    let work = move || -> PyResult<Result<LabeledFile, LabelError>> {
        let id = id.unwrap_or_else(|| source.id());
        Ok(match source.read(options.budget.max_bytes)? {
            Content::Step(text) => partprobe_label::label(&text, &id, &options),
            Content::Given(shape, hash) => {
                partprobe_label::label_given(shape, &id, &hash, &options)
            }
        })
    };
    let file = compute(py, work)??.map_err(|error| label_error(&error, name.as_deref()))?;
    let mut refusal = None;
    let mut carriers: Vec<Carrier> = Vec::new();
    let mut left_out = file.lost;
    for shape in file.shapes {
        match shape.carrier {
            Ok(carrier) => carriers.push(carrier),
            Err(error) => {
                left_out.push(format!("{}: {error}", shape.id));
                refusal = refusal.or(Some(error));
            }
        }
    }
    if let (true, Some(error)) = (carriers.is_empty(), &refusal) {
        return Err(label_error(error, name.as_deref()));
    }
    for reason in left_out {
        match &name {
            Some(file) => warn(py, &format!("{file}: {reason}"))?,
            None => warn(py, &reason)?,
        }
    }
    let carriers = carriers
        .into_iter()
        .map(|carrier| PyCarrier::new(py, carrier));
    Ok((name, carriers.collect()))
}

fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    // Text with a zero character cannot be passed on.
    let text = CString::new(text.replace('\0', " ")).unwrap_or_default();
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)
}
