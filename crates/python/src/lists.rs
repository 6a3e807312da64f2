//! Lists the names of options, label sources and metrics. Generates parts for examples and tests.

use crate::errors::usage;
use crate::given_numbers::{index as index_of, part_count, seed as seed_of};
use crate::label_options::LABEL_OPTIONS;
use partprobe_eval::METRICS;
use partprobe_label::LabelOptions;
use partprobe_sources::{SOURCES, SourceFactory};
use partprobe_synth::SynthSettings;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

/// The options of `label` with their defaults, which are those of `configs/base.toml`.
///
/// >>> import partprobe
/// >>> partprobe.label_options()["theta_deg"]
/// 8.0
#[pyfunction]
pub(crate) fn label_options(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
    let defaults = LabelOptions::default();
    let options = PyDict::new(py);
    for option in LABEL_OPTIONS {
        options.set_item(option.name, (option.value)(&defaults, py)?)?;
    }
    Ok(options)
}

/// The names of the label sources. Placeholders such as `<K>` stand for a number.
///
/// >>> import partprobe
/// >>> "step-parts" in partprobe.sources()
/// True
#[pyfunction]
pub(crate) fn sources() -> Vec<&'static str> {
    SOURCES.iter().map(SourceFactory::pattern).collect()
}

/// The names of the metrics, in the order in which `score` computes them.
///
/// >>> import partprobe
/// >>> "miou" in partprobe.metrics()
/// True
#[pyfunction]
pub(crate) fn metrics() -> Vec<&'static str> {
    METRICS.iter().map(|metric| metric.name).collect()
}

/// Generates a mechanical part. Returns the bytes of its STEP file. The same arguments give the same bytes.
///
/// >>> import partprobe
/// >>> partprobe.synth(seed=1, index=3).startswith(b"ISO-10303-21;")
/// True
#[pyfunction]
#[pyo3(signature = (*, seed=1, index=0, min_parts=2, max_parts=20))]
pub(crate) fn synth(
    py: Python<'_>,
    #[pyo3(from_py_with = seed_of)] seed: u64,
    #[pyo3(from_py_with = index_of)] index: u64,
    #[pyo3(from_py_with = part_count)] min_parts: u32,
    #[pyo3(from_py_with = part_count)] max_parts: u32,
) -> PyResult<Bound<'_, PyBytes>> {
    if min_parts < 2 || max_parts < min_parts || 40 < max_parts {
        return Err(usage(format!(
            "min_parts and max_parts must satisfy 2 <= min_parts <= max_parts <= 40, and they are {min_parts} and {max_parts}"
        )));
    }
    let settings = SynthSettings {
        seed,
        min_parts,
        max_parts,
    };
    let part = py.detach(|| partprobe_synth::part(&settings, index));
    Ok(PyBytes::new(py, part.step.as_bytes()))
}
