//! Defines the class `Model`: a trained backbone, which embeds points.

use crate::arrays::shaped;
use crate::background::compute;
use crate::carrier::PyCarrier;
use crate::errors::{DamagedFileError, damaged, os_error, usage};
use crate::given_arrays::triples;
use crate::given_numbers::optional_seed;
use crate::sample::{PySample, normal_kind};
use partprobe_carrier::{Embeddings, PointSample, sha256_hex};
use partprobe_net::{Backend, Model, ModelFile, TokenConfig, Tokens, TrainedOn};
use pyo3::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file of the weights in the folder of a training.
const WEIGHTS: &str = "model.safetensors";
/// The record of a training in its folder.
const TRAINING_RECORD: &str = "training.json";
/// The folder of the trainings in a run.
const CHECKPOINTS: &str = "checkpoints";

/// A trained backbone: the `model.safetensors` of a training, or the folder of a run.
///
/// If the run has several backbones, `supervision` and `seed` choose one; if `seed` is not given, it is the lowest one. The file
/// also contains the settings of the network and those for preparing shapes.
///
/// Raises `OSError` if the file cannot be opened, `DamagedFileError` if it does not contain weights or was changed after its training,
/// and `UsageError` if no backbone matches, or several do.
#[pyclass(frozen, name = "Model", module = "partprobe")]
pub(crate) struct PyModel {
    path: PathBuf,
    model: Arc<Model>,
    tokens: TokenConfig,
    preparation: Preparation,
}

/// How a carrier is sampled for the network.
struct Preparation {
    n_points: usize,
    normals: String,
    seed: u64,
}

#[pymethods]
impl PyModel {
    #[new]
    #[pyo3(signature = (path, *, supervision=None, seed=None))]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        supervision: Option<&str>,
        #[pyo3(from_py_with = optional_seed)] seed: Option<u64>,
    ) -> PyResult<Self> {
        let mut wanted = WantedBackbone {
            supervision: supervision.map(str::to_owned),
            seed,
        };
        let training = if path.is_dir() {
            let name = wanted.name_in(&path)?;
            wanted = WantedBackbone::of_name(&name);
            Some(path.join(CHECKPOINTS).join(name))
        } else {
            None
        };
        let path = match &training {
            Some(folder) => folder.join(WEIGHTS),
            None => path,
        };
        let bytes = fs::read(&path).map_err(|error| os_error(&error, &path))?;
        if let Some(folder) = &training {
            ensure_unchanged(&bytes, folder)?;
        }
        let read = compute(py, move || {
            ModelFile::from_bytes(&bytes, Backend::default())
        })?;
        let file = read.map_err(|error| damaged(&error, &path))?;
        wanted.ensure(file.trained_on.as_ref(), &path)?;
        Ok(Self {
            tokens: tokens_of(&file.preparation),
            preparation: Preparation::of(&file.preparation),
            model: Arc::new(file.model),
            path,
        })
    }

    /// The file of the weights.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// The length of an embedding.
    #[getter]
    fn dim(&self) -> usize {
        self.model.config().embedding_dim * self.tokens.test_poses
    }

    /// The number of parameters, including those of the embedding head.
    #[getter]
    fn n_parameters(&self) -> usize {
        self.model.n_parameters() + self.model.n_head_parameters()
    }

    /// Draws the points of a carrier with the settings that the network was trained with: number of points, normals and seed.
    fn sample(&self, carrier: &Bound<'_, PyCarrier>) -> PyResult<Py<PySample>> {
        let Preparation {
            n_points,
            normals,
            seed,
        } = &self.preparation;
        let sample = carrier.call_method1("sample", (*n_points, *seed, normals.as_str()))?;
        Ok(sample.cast_into::<PySample>()?.unbind())
    }

    /// Embeds points: float32 (N, dim), with one row of length 1 per point.
    ///
    /// `points` is a `Carrier`, which `sample` samples first, a `Sample`, or float (N, 3) with `normals`, float (N, 3). The unit
    /// of length does not matter. Points of the same token have equal rows.
    ///
    /// Raises `UsageError` if the points cannot be embedded.
    #[pyo3(signature = (points, normals=None))]
    fn embed<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        normals: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let sample = self.points_of(points, normals)?;
        let (model, config) = (self.model.clone(), self.tokens.clone());
        let rows = compute(py, move || embedded(&model, &sample, &config))?.map_err(usage)?;
        let (values, dim) = rows;
        let n_points = values.len() / dim;
        shaped(py, values, vec![n_points, dim])
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (PathBuf,))> {
        Ok((py.get_type::<Self>().into_any(), (self.path.clone(),)))
    }

    fn __repr__(&self) -> String {
        format!(
            "<partprobe.Model {}: {} parameters, embeddings of {} numbers>",
            self.path.display(),
            self.n_parameters(),
            self.dim()
        )
    }
}

impl PyModel {
    fn points_of(
        &self,
        points: &Bound<'_, PyAny>,
        normals: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Arc<PointSample>> {
        let has_normals =
            points.is_instance_of::<PySample>() || points.is_instance_of::<PyCarrier>();
        if has_normals && normals.is_some() {
            return Err(usage(
                "normals belong to an array of points; a Carrier and a Sample have their own",
            ));
        }
        if let Some(normals) = normals {
            let (points, normals) = (triples("points", points)?, triples("normals", normals)?);
            if points.is_empty() || points.len() != normals.len() {
                return Err(usage(if points.is_empty() {
                    "points: there are none".to_owned()
                } else {
                    format!(
                        "each point needs a normal; there are {} normals for {} points",
                        normals.len(),
                        points.len()
                    )
                }));
            }
            let triangles = vec![0; points.len()];
            return Ok(Arc::new(PointSample {
                points,
                normals,
                triangles,
            }));
        }
        if let Ok(sample) = points.cast::<PySample>() {
            return Ok(sample.get().sample().clone());
        }
        if let Ok(carrier) = points.cast::<PyCarrier>() {
            return Ok(self.sample(carrier)?.get().sample().clone());
        }
        Err(usage("give a Carrier, a Sample, or points with normals=…"))
    }
}

/// The embedding of each point, row after row, and the length of a row.
fn embedded(
    model: &Model,
    sample: &PointSample,
    config: &TokenConfig,
) -> Result<(Vec<f32>, usize), String> {
    let (tokens, raw) = model
        .embed_sample(sample, config)
        .map_err(|error| error.to_string())?;
    let rows = match &model.config().refine {
        None => raw,
        Some(refine) => refine
            .refined(&raw, &tokens.multiplicity)
            .map_err(|error| error.to_string())?,
    };
    Ok((rows_of_points(&tokens, &rows), rows.dim()))
}

fn rows_of_points(tokens: &Tokens, rows: &Embeddings) -> Vec<f32> {
    let of_point = tokens.token_of_point.iter();
    of_point
        .flat_map(|&token| rows.row(token as usize))
        .copied()
        .collect()
}

/// Refuses weights that are not those that the training in this folder wrote. A training of an earlier version, or of another
/// program, has recorded no hash, and is not refused.
fn ensure_unchanged(weights: &[u8], training: &Path) -> PyResult<()> {
    let Ok(record) = fs::read(training.join(TRAINING_RECORD)) else {
        return Ok(());
    };
    let record: Value = serde_json::from_slice(&record).unwrap_or_default();
    let is_same = match record["weights_sha256"].as_str() {
        Some(noted) => noted == sha256_hex(weights),
        None => true,
    };
    if is_same {
        return Ok(());
    }
    let reason = format!(
        "it was changed after its training ended: its SHA-256 is not the one in {TRAINING_RECORD} of the same folder; put the file \
         back, or remove it and train again with --resume"
    );
    Err(DamagedFileError::new_err((
        reason,
        training.join(WEIGHTS).display().to_string(),
    )))
}

/// The backbone that the caller chooses.
#[derive(Clone, Debug, Default)]
struct WantedBackbone {
    supervision: Option<String>,
    seed: Option<u64>,
}

impl WantedBackbone {
    /// The backbone of a folder `<supervision>-<seed>`.
    fn of_name(name: &str) -> Self {
        match name.rsplit_once('-') {
            Some((supervision, seed)) => Self {
                supervision: Some(supervision.to_owned()),
                seed: seed.parse().ok(),
            },
            None => Self::default(),
        }
    }

    /// The name of the only training of a run that fits. If trainings of one label source differ in their seeds alone, it is that
    /// with the lowest seed.
    fn name_in(&self, run: &Path) -> PyResult<String> {
        let folder = run.join(CHECKPOINTS);
        if !folder.is_dir() {
            return Err(usage(format!(
                "{} is not a run folder; give one, or a model.safetensors",
                run.display()
            )));
        }
        let entries = fs::read_dir(&folder).map_err(|error| os_error(&error, &folder))?;
        let mut names: Vec<String> = entries
            .filter_map(Result::ok)
            .filter(|entry| entry.path().join(WEIGHTS).is_file())
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        let mut found: Vec<(Self, &String)> = names
            .iter()
            .map(|name| (Self::of_name(name), name))
            .filter(|(training, _)| self.fits(training))
            .collect();
        let is_of_one_source = found
            .iter()
            .all(|(training, _)| training.supervision == found[0].0.supervision);
        if self.seed.is_none() && is_of_one_source {
            found.sort_by_key(|(training, _)| training.seed);
            found.truncate(1);
        }
        match &found[..] {
            [(_, name)] => Ok((*name).clone()),
            _ => Err(usage(format!(
                "choose one backbone of the run with supervision and seed; there are {}",
                if names.is_empty() {
                    "none".to_owned()
                } else {
                    names.join(", ")
                }
            ))),
        }
    }

    fn fits(&self, training: &Self) -> bool {
        let is_source = self.supervision.is_none() || self.supervision == training.supervision;
        is_source && (self.seed.is_none() || self.seed == training.seed)
    }

    /// Refuses weights of another training. Weights of an earlier version, or of another program, do not say what they were trained
    /// on, and are not refused.
    fn ensure(&self, trained_on: Option<&TrainedOn>, path: &Path) -> PyResult<()> {
        let Some(record) = trained_on else {
            return Ok(());
        };
        let training = Self {
            supervision: Some(record.supervision.clone()),
            seed: Some(record.settings.train.seed),
        };
        if self.fits(&training) {
            return Ok(());
        }
        Err(usage(format!(
            "{} was trained on `{}` with seed {}, so it is not the requested backbone",
            path.display(),
            record.supervision,
            record.settings.train.seed
        )))
    }
}

/// The value of a key of the preparation, if the key exists and its value is valid.
fn key<T: serde::de::DeserializeOwned>(preparation: &Value, name: &str) -> Option<T> {
    serde_json::from_value(preparation.get(name)?.clone()).ok()
}

fn tokens_of(preparation: &Value) -> TokenConfig {
    let defaults = TokenConfig::default();
    TokenConfig {
        test_tokens: key(preparation, "tokens.test_tokens").unwrap_or(defaults.test_tokens),
        test_poses: key(preparation, "tokens.test_poses").unwrap_or(defaults.test_poses),
        voxels: key(preparation, "tokens.voxels").unwrap_or(defaults.voxels),
        ..defaults
    }
}

impl Preparation {
    fn of(preparation: &Value) -> Self {
        let normals: Option<String> = key(preparation, "sample.normals");
        Self {
            n_points: key(preparation, "sample.n_points").unwrap_or(20_000),
            normals: normals
                .filter(|name| normal_kind(name).is_ok())
                .unwrap_or_else(|| "triangle".to_owned()),
            seed: key(preparation, "sample.seed").unwrap_or(0),
        }
    }
}
