//! Makes the graph of the faces of a carrier, in the form of PyTorch Geometric.

use crate::arrays::{rows, shaped};
use partprobe_carrier::{Carrier, FaceType};
use pyo3::prelude::*;
use pyo3::types::PyDict;

const N_TYPES: usize = FaceType::ALL.len();
/// The number of columns: one per type, and one for the area.
const N_FEATURES: usize = N_TYPES + 1;

/// The arrays `x`, `edge_index`, `edge_attr` and `y`. `labels` are the values of the last one.
///
/// # Errors
/// If an array cannot be made.
pub(crate) fn graph_of<'py>(
    py: Python<'py>,
    carrier: &Carrier,
    labels: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyDict>> {
    let arrays = PyDict::new(py);
    arrays.set_item("x", rows(py, face_features(carrier))?)?;
    let (index, attributes) = directed_edges(carrier);
    let n_edges = index.len() / 2;
    arrays.set_item("edge_index", shaped(py, index, vec![2, n_edges])?)?;
    arrays.set_item("edge_attr", rows(py, attributes)?)?;
    arrays.set_item("y", labels)?;
    Ok(arrays)
}

/// The type of each face as a one-hot vector of eleven columns, and its fraction of the area of the shape.
fn face_features(carrier: &Carrier) -> Vec<[f32; N_FEATURES]> {
    let faces = &carrier.graph().faces;
    let total: f64 = faces.iter().map(|face| face.area).sum();
    let features = faces.iter().map(|face| {
        let mut row = [0.0; N_FEATURES];
        row[usize::from(face.face_type.code())] = 1.0;
        row[N_TYPES] = if total > 0.0 {
            (face.area / total) as f32
        } else {
            0.0
        };
        row
    });
    features.collect()
}

/// The first faces and then the second faces of the shared edges in both directions, and the attributes of each edge.
fn directed_edges(carrier: &Carrier) -> (Vec<i64>, Vec<[f32; 3]>) {
    let edges = &carrier.graph().edges;
    let diagonal = carrier.meta().diagonal_mm.max(f64::MIN_POSITIVE);
    let (mut first, mut second, mut attributes) = (Vec::new(), Vec::new(), Vec::new());
    for is_forward in [true, false] {
        for edge in edges {
            let [a, b] = edge.faces.map(i64::from);
            let (from, to) = if is_forward { (a, b) } else { (b, a) };
            first.push(from);
            second.push(to);
            let is_defined = !edge.phi.is_nan();
            let angle = if is_defined { edge.phi / 180.0 } else { 0.0 };
            let length = edge.length / diagonal;
            attributes.push([angle as f32, f32::from(u8::from(is_defined)), length as f32]);
        }
    }
    first.extend(second);
    (first, attributes)
}
