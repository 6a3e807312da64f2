//! Defines the function `score`, which computes the metrics of predicted clusters, or of embeddings, against reference labels.

use crate::background::compute;
use crate::errors::usage;
use crate::given_arrays::{labels, matrix, triples};
use crate::given_numbers::seed as seed_of;
use crate::near_name::did_you_mean;
use partprobe_cluster::{CLUSTERERS, ClustererFactory, ClustererSettings};
use partprobe_eval::{PointEmbeddings, PointScores, near_boundary};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The settings of `[eval]` in `configs/base.toml`, which `partprobe score` has, too.
const SETTINGS: ClustererSettings = ClustererSettings {
    restarts: 10,
    max_iterations: 300,
    tolerance: 1e-6,
};

/// Scores the predictions for the points of one shape, like `partprobe score`.
///
/// `reference` has a label per point, int (N,); negative ones are ignored. Give either `predicted`, a cluster per point, int
/// (N,), or `embedding`, a row per point, float (N, D). Embeddings are clustered by `clusterer` ("k-means", "average-link" or
/// "modes") into as many clusters as the reference has parts. With `points`, float (N, 3), there is a boundary accuracy;
/// `normals`, float (N, 3), then distinguish the two sides of a thin wall. The random numbers of k-means depend on `id` and
/// `seed`.
///
/// The result is a dictionary with a float for each metric in `metrics()` that has a value, and `k`, the number of parts.
///
/// Raises `UsageError` if an array has a different form, or if the reference ignores every point.
///
/// >>> import partprobe
/// >>> scores = partprobe.score([0, 0, 1, 1], predicted=[7, 7, 7, 2])
/// >>> scores["k"], scores["accuracy"]
/// (2.0, 0.75)
#[pyfunction]
#[pyo3(signature = (
    reference, *, predicted=None, embedding=None, points=None, normals=None, clusterer="k-means", seed=0, id="shape"
))]
#[expect(clippy::too_many_arguments, reason = "all but one are keywords")]
pub(crate) fn score<'py>(
    py: Python<'py>,
    reference: &Bound<'py, PyAny>,
    predicted: Option<&Bound<'py, PyAny>>,
    embedding: Option<&Bound<'py, PyAny>>,
    points: Option<&Bound<'py, PyAny>>,
    normals: Option<&Bound<'py, PyAny>>,
    clusterer: &str,
    #[pyo3(from_py_with = seed_of)] seed: u64,
    id: &str,
) -> PyResult<Bound<'py, PyDict>> {
    let reference = labels("reference", reference)?;
    let factory = factory_named(clusterer)?;
    let prediction = match (predicted, embedding) {
        (Some(predicted), None) => Prediction::Clusters(labels("predicted", predicted)?),
        (None, Some(embedding)) => {
            let (values, dim) = matrix("embedding", embedding)?;
            Prediction::Rows {
                values,
                dim,
                factory,
            }
        }
        _ => return Err(usage("give either predicted or embedding")),
    };
    let points = points.map(|points| triples("points", points)).transpose()?;
    let normals = normals
        .map(|normals| triples("normals", normals))
        .transpose()?;
    let n_points = reference.len();
    let lengths = [
        ("the prediction", Some(prediction.n_points())),
        ("points", points.as_ref().map(Vec::len)),
        ("normals", normals.as_ref().map(Vec::len)),
    ];
    for (name, length) in lengths {
        if let Some(length) = length.filter(|&length| length != n_points) {
            return Err(usage(format!(
                "{name} has {length} rows for the {n_points} points of reference"
            )));
        }
    }
    let id = id.to_owned();
    let work = move || {
        let normals = normals.unwrap_or_default();
        let near = points.map(|points| near_boundary(&points, &normals, &reference));
        prediction.score(&id, &reference, near.as_deref(), seed)
    };
    let found = compute(py, work)?.map_err(usage)?;
    let scores = PyDict::new(py);
    scores.set_item("k", found.k as f64)?;
    for (metric, value) in &found.scores {
        scores.set_item(metric.name, value)?;
    }
    Ok(scores)
}

/// The predictions for the points.
enum Prediction {
    Clusters(Vec<i32>),
    /// Embeddings, `[point, dim]`, and the clusterer that divides them.
    Rows {
        values: Vec<f32>,
        dim: usize,
        factory: &'static ClustererFactory,
    },
}

impl Prediction {
    fn n_points(&self) -> usize {
        match self {
            Self::Clusters(clusters) => clusters.len(),
            Self::Rows { values, dim, .. } => values.len() / dim,
        }
    }

    fn score(
        &self,
        id: &str,
        reference: &[i32],
        near_boundary: Option<&[bool]>,
        seed: u64,
    ) -> Result<PointScores, String> {
        match self {
            Self::Clusters(clusters) => {
                PointScores::of_clusters(clusters, reference, near_boundary)
                    .map_err(|error| error.to_string())
            }
            Self::Rows {
                values,
                dim,
                factory,
            } => {
                let rows = PointEmbeddings::new(*dim, values).map_err(|error| error.to_string())?;
                let clusterer = (factory.make)(&SETTINGS);
                let found = rows.score(id, reference, near_boundary, clusterer.as_ref(), seed);
                found.map_err(|error| error.to_string())
            }
        }
    }
}

fn factory_named(name: &str) -> PyResult<&'static ClustererFactory> {
    ClustererFactory::named(name).ok_or_else(|| {
        let hint = did_you_mean(name, CLUSTERERS.iter().map(|factory| factory.name));
        let known = ClustererFactory::known_names();
        usage(format!(
            "`{name}` is not a clusterer; the known ones are {known}{hint}"
        ))
    })
}
