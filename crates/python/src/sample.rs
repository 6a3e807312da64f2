//! Defines the class `Sample`: points of a carrier with normals, and their labels from any source.

use crate::arrays::{KeptArrays, rows, shaped, widened};
use crate::background::compute;
use crate::carrier::source_labels;
use crate::errors::usage;
use crate::given_numbers::seed as seed_of;
use partprobe_carrier::{Carrier, NormalKind, PointSample};
use pyo3::prelude::*;
use std::sync::Arc;

/// Points on the surface of a carrier. `Carrier.sample` draws them.
///
/// >>> import partprobe
/// >>> sample = partprobe.label(partprobe.synth(seed=7), id="bracket").sample(1000)
/// >>> sample
/// <partprobe.Sample of bracket: 1000 points>
/// >>> sample.points.dtype, sample.triangles.dtype
/// (dtype('float32'), dtype('int64'))
#[pyclass(frozen, name = "Sample", module = "partprobe")]
pub(crate) struct PySample {
    sample: Arc<PointSample>,
    carrier: Arc<Carrier>,
    arrays: KeptArrays,
}

impl PySample {
    pub(crate) fn new(py: Python<'_>, sample: PointSample, carrier: Arc<Carrier>) -> Self {
        Self {
            sample: Arc::new(sample),
            carrier,
            arrays: KeptArrays::new(py),
        }
    }

    pub(crate) fn sample(&self) -> &Arc<PointSample> {
        &self.sample
    }
}

/// The largest number of points, which is also the limit of the program.
const MAX_POINTS: usize = 10_000_000;

/// Checks a number of points.
///
/// # Errors
/// `UsageError` if it is 0 or too large.
pub(crate) fn ensure_n_points(name: &str, n: usize) -> PyResult<()> {
    if (1..=MAX_POINTS).contains(&n) {
        return Ok(());
    }
    Err(usage(format!(
        "{name} must be from 1 to {MAX_POINTS}, not {n}"
    )))
}

/// The kind of normals with this name.
///
/// # Errors
/// `UsageError` if there is no such kind.
pub(crate) fn normal_kind(name: &str) -> PyResult<NormalKind> {
    match name {
        "triangle" => Ok(NormalKind::Triangle),
        "analytic" => Ok(NormalKind::Analytic),
        other => Err(usage(format!(
            "normals must be \"triangle\" or \"analytic\", not \"{other}\""
        ))),
    }
}

#[pymethods]
impl PySample {
    /// Positions in millimeters: float32 (N, 3).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays
            .get(py, "points", || rows(py, self.sample.points.clone()))
    }

    /// Outward unit normals: float32 (N, 3).
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays
            .get(py, "normals", || rows(py, self.sample.normals.clone()))
    }

    /// The triangle of the carrier that each point was drawn from: int64 (N,).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let make = || shaped(py, widened(&self.sample.triangles), vec![self.__len__()]);
        self.arrays.get(py, "triangles", make)
    }

    /// The face of the carrier that each point lies on: int64 (N,).
    #[getter]
    fn faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.get(py, "faces", || {
            let tri_face = &self.carrier.mesh().tri_face;
            let triangles = self.sample.triangles.iter();
            let faces: Vec<i64> = triangles
                .map(|&triangle| tri_face[triangle as usize].into())
                .collect();
            let shape = vec![faces.len()];
            shaped(py, faces, shape)
        })
    }

    /// The label that a source gives to each point, -1 if it gives no label: int64 (N,).
    ///
    /// `source` is one of `sources()`. Sources that draw random numbers use `seed`. Raises `UsageError` if no source has
    /// the name, or if the source cannot label the shape.
    #[pyo3(signature = (source="step-parts", *, seed=0))]
    fn labels<'py>(
        &self,
        py: Python<'py>,
        source: &str,
        #[pyo3(from_py_with = seed_of)] seed: u64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (carrier, sample) = (self.carrier.clone(), self.sample.clone());
        let name = source.to_owned();
        let work = move || source_labels(&carrier, &name, seed)?.label_of_points(&sample);
        let labels = compute(py, work)?.map_err(usage)?;
        shaped(py, widened(&labels), vec![labels.len()])
    }

    fn __len__(&self) -> usize {
        self.sample.points.len()
    }

    fn __repr__(&self) -> String {
        let id = &self.carrier.meta().id;
        format!("<partprobe.Sample of {id}: {} points>", self.__len__())
    }
}
