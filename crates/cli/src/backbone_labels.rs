//! Defines the type `backbone` of label sources: clusters of the embeddings of a backbone that was trained by partprobe.
//!
//! A file of weights and a shape go in, and labels of its triangles or faces come out. The backbone is run like a model of the
//! type `onnx`, so both cluster in the same way. A training shape of the backbone gets no labels, because a learned source is
//! only compared on shapes that it has not seen.

use crate::config::{load, overrides_of_preparation};
use partprobe_carrier::{Carrier, PointSample, sha256_hex};
use partprobe_formats::mesh_hash;
use partprobe_imports::parameters::files;
use partprobe_imports::{Import, ImportError, ImportType, JoinProblem, JoinedLabels, ParameterKey};
use partprobe_net::{Backend, Model, ModelFile, ShapeKeys, TokenConfig};
use partprobe_onnx::{
    Element, InputTensor, InputValues, Model as FeatureModel, ONNX, OutputTensor, TensorSpec,
    labels_by_model,
};
use partprobe_sources::SourceContext;

/// Labels that are clusters of the embeddings of a trained backbone.
pub(crate) const BACKBONE: ImportType = ImportType {
    name: "backbone",
    description: "clusters of the embeddings of a backbone that was trained here",
    keys: KEYS,
    // The keys have the same values as those of the type `onnx`.
    check_values: ONNX.check_values,
    make: |context| {
        let path = context.parameter("path").unwrap_or_default();
        let bytes = files(context)?
            .read(path)
            .map_err(|error| ImportError::Unreadable(error.to_string()))?;
        let file = ModelFile::from_bytes(&bytes, Backend::default())
            .map_err(|error| ImportError::Unreadable(format!("{path}: {error}")))?;
        open(path, &sha256_hex(&bytes), file, context)
    },
};

/// The keys of the type. They have the same meaning as the keys with the same names of the type `onnx`.
const KEYS: &[ParameterKey] = &[
    ParameterKey::required("path", "the weights, a file model.safetensors of a run").path(),
    ParameterKey::optional(
        "points",
        "how many points are sampled and embedded (as many as in the training)",
    ),
    ParameterKey::optional(
        "cluster",
        "ward (over small triangles), ward-faces (over B-Rep faces) or k-means (ward)",
    ),
    ParameterKey::optional(
        "k",
        "how many clusters: a number, silhouette, or match (as many as the shape has STEP parts) (silhouette)",
    ),
    ParameterKey::optional(
        "max_k",
        "with k = silhouette: the largest number that is tried (20)",
    ),
    ParameterKey::optional("seed", "what the sample and k-means are drawn with (0)"),
];

/// The names of the inputs and the output of the backbone.
const POSITIONS: &str = "positions";
const NORMALS: &str = "normals";
const EMBEDDINGS: &str = "embeddings";

fn open(
    path: &str,
    model_hash: &str,
    file: ModelFile,
    context: &SourceContext,
) -> Result<Box<dyn Import>, ImportError> {
    let unusable = |reason: String| ImportError::Unreadable(format!("{path}: {reason}"));
    // The preparation has keys of a config, like those that `embed` reads.
    let config = load("base", &overrides_of_preparation(&file.preparation))
        .map_err(|error| unusable(format!("{error:#}")))?
        .config;
    let trained_on = file.trained_on.ok_or_else(|| {
        unusable(
            "it does not say on which shapes it was trained, so a shape to label may be among them"
                .to_owned(),
        )
    })?;

    let n_points = config.sample.n_points.to_string();
    let mut of_model = SourceContext::default()
        .with("path", path)
        .with("points", context.parameter("points").unwrap_or(&n_points))
        .with(POSITIONS, POSITIONS)
        .with(NORMALS, NORMALS)
        // The backbone scales shapes itself.
        .with("frame", "millimeters");
    for key in ["cluster", "k", "max_k", "seed"] {
        if let Some(value) = context.parameter(key) {
            of_model = of_model.with(key, value);
        }
    }
    let model = BackboneModel::new(file.model, config.tokens);
    Ok(Box::new(BackboneLabels {
        labels: labels_by_model(Box::new(model), model_hash, &of_model)?,
        seen: trained_on.seen(),
    }))
}

/// Labels by a backbone, for shapes that it was not trained on.
struct BackboneLabels {
    labels: Box<dyn Import>,
    seen: ShapeKeys,
}

impl Import for BackboneLabels {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let mesh = mesh_hash(carrier.mesh()).to_string();
        if self.seen.has(&carrier.meta().source_sha256, &mesh) {
            return Err(JoinProblem::Refused(
                "the backbone was trained on this shape; label it with a backbone that has not seen it".to_owned(),
            ));
        }
        self.labels.join(carrier)
    }

    fn labels_faces(&self) -> bool {
        self.labels.labels_faces()
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        self.labels.entries()
    }

    fn entries_of(&self, id: &str) -> Vec<String> {
        self.labels.entries_of(id)
    }
}

/// A backbone as a model with two inputs and one output.
struct BackboneModel {
    model: Model,
    tokens: TokenConfig,
    inputs: [TensorSpec; 2],
    outputs: [TensorSpec; 1],
}

impl BackboneModel {
    fn new(model: Model, tokens: TokenConfig) -> Self {
        let tensor = |name: &str, length: usize| TensorSpec {
            name: name.to_owned(),
            element: Element::F32,
            shape: vec![None, Some(length)],
        };
        let dim = model.config().embedding_dim * tokens.test_poses;
        Self {
            model,
            tokens,
            inputs: [tensor(POSITIONS, 3), tensor(NORMALS, 3)],
            outputs: [tensor(EMBEDDINGS, dim)],
        }
    }
}

impl FeatureModel for BackboneModel {
    fn runtime(&self) -> &str {
        "partprobe"
    }

    fn inputs(&self) -> &[TensorSpec] {
        &self.inputs
    }

    fn outputs(&self) -> &[TensorSpec] {
        &self.outputs
    }

    fn run(&self, inputs: Vec<InputTensor>, _output: &str) -> Result<OutputTensor, String> {
        let rows_of = |name: &str| -> Vec<[f32; 3]> {
            let tensor = inputs.iter().find(|tensor| tensor.name == name);
            match tensor.map(|tensor| &tensor.values) {
                Some(InputValues::F32(values)) => values.as_chunks().0.to_vec(),
                _ => Vec::new(),
            }
        };
        let sample = PointSample {
            points: rows_of(POSITIONS),
            normals: rows_of(NORMALS),
            ..PointSample::default()
        };
        let (tokens, embeddings) = self
            .model
            .embed_sample(&sample, &self.tokens)
            .map_err(|error| error.to_string())?;
        let values = tokens
            .token_of_point
            .iter()
            .flat_map(|&token| embeddings.row(token as usize))
            .copied()
            .collect();
        Ok(OutputTensor {
            shape: vec![tokens.token_of_point.len(), embeddings.dim()],
            values,
        })
    }
}
