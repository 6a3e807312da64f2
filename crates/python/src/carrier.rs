//! Defines the class `Carrier`: a labeled mesh with the graph of its faces.
//!
//! The arrays have the names of the members of a carrier file. The carrier itself never changes.

use crate::arrays::{KeptArrays, numpy_array, shaped, widened};
use crate::background::compute;
use crate::errors::{carrier_error, damaged, output_error, usage};
use crate::given_numbers::{count, seed as seed_of};
use crate::graph::graph_of;
use crate::picture::png;
use crate::sample::{PySample, ensure_n_points, normal_kind};
use partprobe_carrier::{Carrier, keyed_rng, sample_by_area};
use partprobe_dataset::{CarrierRef, write_atomically};
use partprobe_formats::{
    Array, Compression, Values, carrier_array, carrier_from_npz, carrier_to_npz,
};
use partprobe_sources::{SourceError, SourceLabels, source_named};
use pyo3::exceptions::PyAttributeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple, PyType};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A labeled mesh: triangles with their faces, the graph of the faces, and the part of each face.
///
/// V, T, F and E are the numbers of vertices, triangles, faces and shared edges. Lengths are in millimeters, areas in square
/// millimeters, angles in degrees. All arrays are read-only; `array.copy()` gives a writable one.
///
/// >>> import partprobe
/// >>> carrier = partprobe.label(partprobe.synth(seed=7), id="bracket")
/// >>> carrier.vertices.shape, carrier.vertices.dtype
/// ((357, 3), dtype('float64'))
/// >>> carrier.triangles.dtype, carrier.vertices is carrier.vertices
/// (dtype('int64'), True)
#[pyclass(frozen, name = "Carrier", module = "partprobe")]
pub(crate) struct PyCarrier {
    carrier: Arc<Carrier>,
    arrays: KeptArrays,
}

impl PyCarrier {
    pub(crate) fn new(py: Python<'_>, carrier: Carrier) -> Self {
        Self {
            carrier: Arc::new(carrier),
            arrays: KeptArrays::new(py),
        }
    }

    fn array<'py>(&self, py: Python<'py>, name: &'static str) -> PyResult<Bound<'py, PyAny>> {
        self.arrays.get(py, name, || {
            let array = carrier_array(&self.carrier, name);
            numpy_array(py, array.ok_or_else(|| PyAttributeError::new_err(name))?)
        })
    }
}

/// The labels that a source gives to a carrier.
///
/// # Errors
/// If no source has the name, or it cannot label the carrier.
pub(crate) fn source_labels(
    carrier: &Carrier,
    source: &str,
    seed: u64,
) -> Result<SourceLabels, SourceError> {
    match (source_named(source), carrier.layer(source)) {
        (Err(_), Some(layer)) => Ok(SourceLabels::on_faces(carrier.mesh(), layer.of_face())),
        (found, _) => found?.labels(carrier, seed),
    }
}

/// Reads the carrier in a file.
///
/// # Errors
/// If the file cannot be read, or is not a carrier.
pub(crate) fn read_carrier(py: Python<'_>, file: CarrierRef) -> PyResult<Carrier> {
    let (carrier, _) = compute(py, move || file.read())?.map_err(|error| carrier_error(&error))?;
    Ok(carrier)
}

#[pymethods]
impl PyCarrier {
    /// Reads a carrier file, which `partprobe label` or `save` wrote.
    ///
    /// Raises `OSError` if the file cannot be opened, and `DamagedFileError` if it is not a carrier.
    #[classmethod]
    fn load(class: &Bound<'_, PyType>, path: PathBuf) -> PyResult<Self> {
        let py = class.py();
        Ok(Self::new(py, read_carrier(py, CarrierRef::alone(&path))?))
    }

    /// Writes the carrier as an `.npz` file, which `numpy.load` and the program read. An existing file is replaced at once.
    #[pyo3(signature = (path, *, compress=false))]
    fn save(&self, py: Python<'_>, path: PathBuf, compress: bool) -> PyResult<()> {
        let bytes = self.npz(py, compress)?;
        write_atomically(&path, &bytes).map_err(|error| output_error(&error))
    }

    /// Returns the bytes of the carrier's `.npz` file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.npz(py, false)?))
    }

    /// Reads a carrier from the bytes of an `.npz` file.
    #[classmethod]
    fn from_bytes(class: &Bound<'_, PyType>, bytes: &[u8]) -> PyResult<Self> {
        let carrier =
            carrier_from_npz(bytes).map_err(|error| damaged(&error, Path::new("the bytes")))?;
        Ok(Self::new(class.py(), carrier))
    }

    fn __reduce__<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let make = py.get_type::<Self>().getattr("from_bytes")?;
        Ok((make, (self.to_bytes(py)?,)))
    }

    /// The id of the shape. The random numbers of samples depend on it.
    #[getter]
    fn id(&self) -> &str {
        &self.carrier.meta().id
    }

    /// The kind of the input: "brep", "mesh" or "cloud".
    #[getter]
    fn kind(&self) -> &'static str {
        self.carrier.kind().name()
    }

    /// The number of parts, after small ones were absorbed.
    #[getter]
    fn n_parts(&self) -> usize {
        self.carrier.n_parts()
    }

    /// The number of faces.
    #[getter]
    fn n_faces(&self) -> usize {
        self.carrier.graph().faces.len()
    }

    /// The number of triangles. Each point of a cloud counts as a triangle.
    #[getter]
    fn n_triangles(&self) -> usize {
        self.carrier.mesh().triangles.len()
    }

    /// Every face, loop and entity that could not be read, with its `#` number and the reason.
    #[getter]
    fn lost(&self) -> Vec<String> {
        self.carrier.meta().lost.clone()
    }

    /// Notes on what was left out on purpose, and on faces that the file itself stores as triangles.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.carrier.meta().notes.clone()
    }

    /// The names of the label layers that the carrier stores.
    #[getter]
    fn layers<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.carrier.layers().keys())
    }

    /// The settings and the origin: tolerances, units, the SHA-256 of the file, occurrences of products.
    #[getter]
    fn meta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Some(Values::U8(text)) = carrier_array(&self.carrier, "meta").map(Array::into_values)
        else {
            return Ok(PyDict::new(py).into_any());
        };
        py.import("json")?
            .call_method1("loads", (PyBytes::new(py, &text),))
    }

    /// The part of each face before small parts were absorbed: int64 (F,).
    #[getter]
    fn face_part<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let make = || {
            shaped(
                py,
                widened(self.carrier.raw_part_of_face()),
                vec![self.n_faces()],
            )
        };
        self.arrays.get(py, "face_part", make)
    }

    /// The part of each face, numbered by the first face of each part; -1 if a face of a mesh has no label: int64 (F,).
    #[getter]
    fn face_label<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let make = || {
            shaped(
                py,
                widened(self.carrier.part_of_face()),
                vec![self.n_faces()],
            )
        };
        self.arrays.get(py, "face_label", make)
    }

    /// Positions of the vertices in millimeters: float64 (V, 3). Each vertex belongs to one face.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "vertices")
    }

    /// The face of each vertex: int64 (V,).
    #[getter]
    fn vertex_face<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "vertex_face")
    }

    /// Vertex indices of each triangle, counter-clockwise seen from outside: int64 (T, 3).
    #[getter]
    fn triangles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "triangles")
    }

    /// The face of each triangle: int64 (T,).
    #[getter]
    fn tri_face<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "tri_face")
    }

    /// The part of each triangle, `face_label[tri_face]`: int64 (T,).
    #[getter]
    fn tri_part<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "tri_part")
    }

    /// The primitive type of each triangle, `face_type[tri_face]`: int64 (T,).
    #[getter]
    fn tri_type<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "tri_type")
    }

    /// The primitive type of each face, an index into `FACE_TYPES`: int64 (F,).
    #[getter]
    fn face_type<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_type")
    }

    /// The type after recognition of primitives that the file writes as splines or sweeps: int64 (F,).
    #[getter]
    fn face_canonical_type<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_canonical_type")
    }

    /// The `#` number of each face in the STEP file: uint64 (F,). It is a name, not an index.
    #[getter]
    fn face_step_id<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_step_id")
    }

    /// Area of each face in square millimeters, of the trimmed surface, not of the mesh: float64 (F,).
    #[getter]
    fn face_area<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_area")
    }

    /// The shell of each face: int64 (F,).
    #[getter]
    fn face_shell<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_shell")
    }

    /// The solid of each face, -1 if it has none: int64 (F,).
    #[getter]
    fn face_solid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_solid")
    }

    /// The occurrence of a product that each face belongs to, an index into `meta["instances"]`: int64 (F,).
    #[getter]
    fn face_instance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_instance")
    }

    /// The color of each face as 0xRRGGBBAA, 0 if it has none: int64 (F,).
    #[getter]
    fn face_color<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_color")
    }

    /// The name of each face, empty if it has none: str (F,).
    #[getter]
    fn face_name<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_name")
    }

    /// The layer of each face, empty if it has none: str (F,).
    #[getter]
    fn face_layer<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "face_layer")
    }

    /// The two faces of each shared edge: int64 (E, 2).
    #[getter]
    fn edge_faces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "edge_faces")
    }

    /// The dihedral angle of each shared edge in degrees, NaN if it is not defined: float64 (E,).
    #[getter]
    fn edge_phi<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "edge_phi")
    }

    /// The length of each shared edge in millimeters: float64 (E,).
    #[getter]
    fn edge_length<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.array(py, "edge_length")
    }

    /// Unit normals of the true surface: float32 (V, 3). `None` without `attributes=["normal"]`.
    #[getter]
    fn vertex_normal<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let is_stored = !self.carrier.mesh().vertex_normal.is_empty();
        is_stored
            .then(|| self.array(py, "vertex_normal"))
            .transpose()
    }

    /// Surface parameters: float64 (V, 2). `None` without `attributes=["uv"]`.
    #[getter]
    fn vertex_uv<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let is_stored = !self.carrier.attributes().uv.is_empty();
        is_stored.then(|| self.array(py, "vertex_uv")).transpose()
    }

    /// Principal curvatures in 1/mm, the larger first: float32 (V, 2). `None` without `attributes=["curvature"]`.
    #[getter]
    fn vertex_curvature<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let is_stored = !self.carrier.attributes().curvature.is_empty();
        is_stored
            .then(|| self.array(py, "vertex_curvature"))
            .transpose()
    }

    /// Directions of the principal curvatures: float32 (V, 2, 3). `None` without `attributes=["curvature"]`.
    #[getter]
    fn vertex_direction<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let is_stored = !self.carrier.attributes().direction.is_empty();
        is_stored
            .then(|| self.array(py, "vertex_direction"))
            .transpose()
    }

    /// The labels that a source gives, numbered from 0 without gaps; -1 if it gives no label.
    ///
    /// `source` is one of `sources()`, for example "normal-kmeans-20", or one of `layers`. `on` is "triangles", int64 (T,), or
    /// "faces", int64 (F,). Sources that draw random numbers use `seed`.
    ///
    /// Raises `UsageError` if no source has the name, if the source cannot label this shape, or if its labels are not constant on
    /// faces.
    ///
    /// >>> import partprobe
    /// >>> carrier = partprobe.label(partprobe.synth(seed=7))
    /// >>> bool((carrier.labels() == carrier.tri_part).all())
    /// True
    /// >>> carrier.labels("brep-face", on="faces").shape == carrier.face_area.shape
    /// True
    #[pyo3(signature = (source="step-parts", *, on="triangles", seed=0))]
    fn labels<'py>(
        &self,
        py: Python<'py>,
        source: &str,
        on: &str,
        #[pyo3(from_py_with = seed_of)] seed: u64,
    ) -> PyResult<Bound<'py, PyAny>> {
        if !["triangles", "faces"].contains(&on) {
            return Err(usage(format!(
                "on must be \"triangles\" or \"faces\", not \"{on}\""
            )));
        }
        let (carrier, name) = (self.carrier.clone(), source.to_owned());
        let labels = compute(py, move || source_labels(&carrier, &name, seed))?.map_err(usage)?;
        let values = match (on, labels.of_faces()) {
            ("triangles", _) => labels.of_triangles().of_triangle(),
            (_, Some(layer)) => layer.of_face(),
            (_, None) => {
                return Err(usage(format!(
                    "the labels of `{source}` are not constant on faces; use on=\"triangles\""
                )));
            }
        };
        shaped(py, widened(values), vec![values.len()])
    }

    /// Draws `n` points uniformly by area. The points are those of `partprobe sample` with the same seed and id.
    ///
    /// `normals` is "triangle", or "analytic" if the carrier was labeled with `attributes=["normal"]`. Each point of a cloud is
    /// drawn at most once.
    ///
    /// >>> import partprobe
    /// >>> sample = partprobe.label(partprobe.synth(seed=7)).sample(1000, seed=3)
    /// >>> sample.points.shape, sample.labels("step-parts").shape
    /// ((1000, 3), (1000,))
    #[pyo3(signature = (n, seed=0, normals="triangle"))]
    fn sample(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = count)] n: usize,
        #[pyo3(from_py_with = seed_of)] seed: u64,
        normals: &str,
    ) -> PyResult<PySample> {
        let (carrier, kind) = (self.carrier.clone(), normal_kind(normals)?);
        ensure_n_points("n", n)?;
        let draw = move || {
            let rng = &mut keyed_rng(seed, &["sample", &carrier.meta().id]);
            sample_by_area(carrier.mesh(), n, kind, rng)
        };
        let sample = compute(py, draw)?.map_err(usage)?;
        Ok(PySample::new(py, sample, self.carrier.clone()))
    }

    /// The graph of the faces, as a dictionary of the arguments of `torch_geometric.data.Data`.
    ///
    /// `edge_index` int64 (2, 2E) contains both directions of each shared edge. `edge_attr` float32 (2E, 3) contains the dihedral
    /// angle divided by 180 degrees, 1 if that angle is defined and 0 if not, and the length divided by the diagonal of the
    /// shape. `x` float32 (F, 12) contains the type as a one-hot vector of 11 columns, and the fraction of the shape's area. `y`
    /// int64 (F,) contains the labels of `source`, which must be constant on faces.
    ///
    /// >>> import partprobe
    /// >>> graph = partprobe.label(partprobe.synth(seed=7)).graph()
    /// >>> {name: array.shape for name, array in graph.items()}
    /// {'x': (11, 12), 'edge_index': (2, 36), 'edge_attr': (36, 3), 'y': (11,)}
    #[pyo3(signature = (source="step-parts"))]
    fn graph<'py>(&self, py: Python<'py>, source: &str) -> PyResult<Bound<'py, PyDict>> {
        let labels = self.labels(py, source, "faces", 0)?;
        graph_of(py, &self.carrier, &labels)
    }

    /// A picture as the bytes of a PNG file. `label` is "part", "raw-part", "type", "face", or the name of a label layer that the
    /// carrier stores. `size` is the side of the picture in pixels.
    #[pyo3(signature = (label="part", *, size=480))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        label: &str,
        #[pyo3(from_py_with = count)] size: usize,
    ) -> PyResult<Bound<'py, PyBytes>> {
        png(py, &self.carrier, label, size)
    }

    /// Shows the picture in a notebook. Elsewhere, write the bytes of `png` to a file.
    #[pyo3(signature = (label="part", *, size=480))]
    fn show(
        &self,
        py: Python<'_>,
        label: &str,
        #[pyo3(from_py_with = count)] size: usize,
    ) -> PyResult<()> {
        let picture = self.png(py, label, size)?;
        let display = py.import("IPython.display").map_err(|_| {
            usage("show needs a notebook with IPython; elsewhere write `carrier.png()` to a file")
        })?;
        let image = display.getattr("Image")?.call1((picture,))?;
        display.call_method1("display", (image,))?;
        Ok(())
    }

    /// The picture that a notebook shows for a carrier.
    fn _repr_png_<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        self.png(py, "part", 480)
    }

    fn __repr__(&self) -> String {
        let lost = self.carrier.meta().lost.len();
        let lost = if lost == 0 {
            String::new()
        } else {
            format!(", {lost} lost")
        };
        format!(
            "<partprobe.Carrier {}: {} faces, {} parts, {} triangles{lost}>",
            self.id(),
            self.n_faces(),
            self.n_parts(),
            self.n_triangles()
        )
    }
}

impl PyCarrier {
    fn npz(&self, py: Python<'_>, compress: bool) -> PyResult<Vec<u8>> {
        let compression = if compress {
            Compression::Deflated
        } else {
            Compression::Stored
        };
        let carrier = self.carrier.clone();
        compute(py, move || carrier_to_npz(&carrier, compression))?.map_err(usage)
    }
}
