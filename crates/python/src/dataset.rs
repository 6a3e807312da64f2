//! Defines the class `Dataset`: the shapes of a labeled data set, as a map-style data set for PyTorch.

use crate::arrays::{rows, shaped, widened};
use crate::background::compute;
use crate::carrier::{PyCarrier, read_carrier, source_labels};
use crate::errors::{carrier_error, dataset_error, os_error, usage};
use crate::given_numbers::{count, seed as seed_of};
use crate::sample::{ensure_n_points, normal_kind};
use partprobe_carrier::{NormalKind, PointSample, keyed_rng, sample_by_area};
use partprobe_dataset::{CarrierRef, Dataset, DatasetError};
use partprobe_sources::source_named;
use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyRange};
use std::path::PathBuf;

/// The shapes of a folder that `partprobe label` wrote.
///
/// `len(dataset)` and `dataset[i]` are what `torch.utils.data.DataLoader` needs. An item is a dictionary with `id`, `points`
/// float32 (N, 3) in millimeters, `normals` float32 (N, 3) and `labels` int64 (N,). The points depend only on `seed` and on the
/// id of the shape: they are those of `partprobe sample`. A data set can be pickled, so that the workers of a loader can open it
/// again.
///
/// Raises `UsageError` if the folder is not a data set, and `DamagedFileError` if a file in it was changed.
#[pyclass(frozen, name = "Dataset", module = "partprobe")]
pub(crate) struct PyDataset {
    dataset: Dataset,
    /// Indices of the entries that have a carrier.
    labeled: Vec<usize>,
    n_points: usize,
    seed: u64,
    normals: NormalKind,
    source: String,
}

/// The key of a shape: its index or its id.
#[derive(FromPyObject)]
enum Key {
    #[pyo3(transparent, annotation = "int")]
    Index(isize),
    #[pyo3(transparent, annotation = "str")]
    Id(String),
}

/// The reason why an item cannot be read.
enum ItemError {
    Carrier(partprobe_dataset::DamagedCarrier),
    Unfit(String),
}

impl PyDataset {
    /// The file of a shape.
    fn file_of(&self, key: &Key) -> PyResult<CarrierRef> {
        let entries = self.dataset.entries();
        let entry = match key {
            Key::Index(index) => {
                let n = self.labeled.len();
                let counted = if *index < 0 {
                    index.checked_add_unsigned(n)
                } else {
                    Some(*index)
                };
                let found = counted.and_then(|at| self.labeled.get(usize::try_from(at).ok()?));
                let found = found.ok_or_else(|| {
                    PyIndexError::new_err(format!(
                        "index {index} is beyond the {n} shapes of the data set"
                    ))
                })?;
                &entries[*found]
            }
            Key::Id(id) => {
                let mut labeled = self.labeled.iter().map(|&at| &entries[at]);
                labeled
                    .find(|entry| entry.id == *id)
                    .ok_or_else(|| PyKeyError::new_err(id.clone()))?
            }
        };
        self.dataset
            .carrier_ref(entry)
            .map_err(|error| self.error(&error))
    }

    fn error(&self, error: &DatasetError) -> PyErr {
        dataset_error(error, self.dataset.root())
    }

    fn normals_name(&self) -> &'static str {
        match self.normals {
            NormalKind::Analytic => "analytic",
            _ => "triangle",
        }
    }
}

/// The points of a shape, and their labels.
fn item(
    file: &CarrierRef,
    (n_points, seed, normals): (usize, u64, NormalKind),
    source: &str,
) -> Result<(String, PointSample, Vec<i32>), ItemError> {
    let unfit = |error: &dyn ToString| ItemError::Unfit(error.to_string());
    let (carrier, _) = file.read().map_err(ItemError::Carrier)?;
    let id = carrier.meta().id.clone();
    let rng = &mut keyed_rng(seed, &["sample", &id]);
    let sample =
        sample_by_area(carrier.mesh(), n_points, normals, rng).map_err(|error| unfit(&error))?;
    let labels =
        source_labels(&carrier, source, seed).and_then(|labels| labels.label_of_points(&sample));
    let labels = labels.map_err(|error| unfit(&error))?;
    Ok((id, sample, labels))
}

#[pymethods]
impl PyDataset {
    #[new]
    #[pyo3(signature = (path, *, n_points=20_000, seed=0, normals="triangle", source="step-parts"))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        #[pyo3(from_py_with = count)] n_points: usize,
        #[pyo3(from_py_with = seed_of)] seed: u64,
        normals: &str,
        source: &str,
    ) -> PyResult<Self> {
        let normals = normal_kind(normals)?;
        ensure_n_points("n_points", n_points)?;
        source_named(source).map_err(usage)?;
        // Items are read later, perhaps from another working directory or by another process.
        let path = std::path::absolute(&path).map_err(|error| os_error(&error, &path))?;
        let root = path.clone();
        let dataset = compute(py, move || Dataset::open(&path))?
            .map_err(|error| dataset_error(&error, &root))?;
        let entries = dataset.entries().iter().enumerate();
        let labeled = entries
            .filter(|(_, entry)| entry.file.is_some())
            .map(|(at, _)| at)
            .collect();
        Ok(Self {
            dataset,
            labeled,
            n_points,
            seed,
            normals,
            source: source.to_owned(),
        })
    }

    /// The folder of the data set.
    #[getter]
    fn path(&self) -> PathBuf {
        self.dataset.root().to_owned()
    }

    /// The ids of the shapes that have a carrier, in the order of the index.
    #[getter]
    fn ids(&self) -> Vec<&str> {
        let entries = self.dataset.entries();
        self.labeled
            .iter()
            .map(|&at| entries[at].id.as_str())
            .collect()
    }

    /// Every file and shape without a carrier: its source, its status and the reason.
    #[getter]
    fn failed(&self) -> Vec<(&str, &'static str, &str)> {
        let entries = self
            .dataset
            .entries()
            .iter()
            .filter(|entry| entry.file.is_none());
        entries
            .map(|entry| {
                (
                    entry.source.as_str(),
                    entry.status.name(),
                    entry.reason.as_deref().unwrap_or_default(),
                )
            })
            .collect()
    }

    fn __len__(&self) -> usize {
        self.labeled.len()
    }

    /// The points of a shape with normals and labels. The arrays are new, so the caller can change them.
    fn __getitem__<'py>(&self, py: Python<'py>, index: isize) -> PyResult<Bound<'py, PyDict>> {
        let file = self.file_of(&Key::Index(index))?;
        let (settings, source) = (
            (self.n_points, self.seed, self.normals),
            self.source.clone(),
        );
        let (id, sample, labels) =
            compute(py, move || item(&file, settings, &source))?.map_err(|error| match error {
                ItemError::Carrier(error) => carrier_error(&error),
                ItemError::Unfit(reason) => usage(reason),
            })?;
        let found = PyDict::new(py);
        found.set_item("id", id)?;
        found.set_item("points", rows(py, sample.points)?)?;
        found.set_item("normals", rows(py, sample.normals)?)?;
        found.set_item("labels", shaped(py, widened(&labels), vec![labels.len()])?)?;
        Ok(found)
    }

    /// The items in their order. The points of each item are drawn when it is requested.
    fn __iter__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let indices = PyRange::new(py, 0, slf.get().labeled.len().cast_signed())?;
        let item = slf.getattr("__getitem__")?;
        py.import("builtins")?
            .getattr("map")?
            .call1((item, indices))
    }

    /// The carrier of the shape with this index or id.
    fn carrier(&self, py: Python<'_>, key: Key) -> PyResult<PyCarrier> {
        Ok(PyCarrier::new(py, read_carrier(py, self.file_of(&key)?)?))
    }

    /// The graph of the faces of the shape with this index or id, as `Carrier.graph` returns it. `y` contains the labels of the
    /// data set's `source`.
    fn graph<'py>(&self, py: Python<'py>, key: Key) -> PyResult<Bound<'py, PyAny>> {
        let carrier = Bound::new(py, self.carrier(py, key)?)?;
        carrier.call_method1("graph", (self.source.as_str(),))
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyAny>,))> {
        let options = PyDict::new(py);
        options.set_item("n_points", self.n_points)?;
        options.set_item("seed", self.seed)?;
        options.set_item("normals", self.normals_name())?;
        options.set_item("source", &self.source)?;
        let class = py.get_type::<Self>();
        let path = self.dataset.root().to_owned();
        // Keyword arguments of a class can only be passed by a partial call.
        let make = py
            .import("functools")?
            .getattr("partial")?
            .call((class,), Some(&options))?;
        Ok((make, (path.into_pyobject(py)?.into_any(),)))
    }

    fn __repr__(&self) -> String {
        let n_failed = self.dataset.entries().len() - self.labeled.len();
        let failed = if n_failed == 0 {
            String::new()
        } else {
            format!(", {n_failed} lines without a carrier")
        };
        format!(
            "<partprobe.Dataset {}: {} shapes{failed}, {} points each, labels {}>",
            self.dataset.root().display(),
            self.labeled.len(),
            self.n_points,
            self.source
        )
    }
}
