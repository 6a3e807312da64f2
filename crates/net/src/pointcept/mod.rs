//! Exchanges weights with Pointcept's PTv3 (`PT-v3m1`): a file of weights becomes tensors with Pointcept's names and layouts,
//! and such tensors become a file of weights.
//!
//! `names` maps the names, `state` is the safetensors file with Pointcept's names. If the two networks differ, the conversion
//! returns an error that names the setting. Pickled checkpoints are never read here.

mod names;
mod settings;
mod state;
#[cfg(test)]
mod tests;

use crate::config::{Backend, ConfigError};
use crate::model::Model;
use crate::model::backbones::{BackboneConfig, Ptv3Config};
use crate::model::layers::NormKind;
use crate::model::net_config::NetConfig;
use crate::model::parameters::{self, ParameterShape};
use crate::model::weights::{ModelFile, WeightsError};
use names::{NameMap, is_counter, is_head, transposed};
pub use settings::pointcept_backbone;
pub use state::PointceptState;
use state::StateTensor;

/// The reason why weights cannot be exchanged with Pointcept.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PointceptError {
    /// A setting of the network has no counterpart in PTv3.
    #[error("{key}: PTv3 {reason}; only weights with `{needed}` can be exchanged with it")]
    Setting {
        /// The key as a config writes it.
        key: &'static str,
        /// The property of PTv3 that differs.
        reason: &'static str,
        /// The setting that PTv3 has.
        needed: &'static str,
    },
    /// The file does not name its network, and the caller did not name one.
    #[error(
        "the file does not say which network it holds; name its size, for example --backbone base"
    )]
    NoNetwork,
    /// No tensor is the stem of PTv3.
    #[error(
        "no tensor ends in `{0}`, which PT-v3m1 has; convert a state dict of that model, saved with safetensors"
    )]
    NoBackbone(&'static str),
    /// Several tensors are a stem, so the file holds several backbones.
    #[error("the file holds {0} backbones: {1}; keep the tensors of one of them")]
    ManyBackbones(usize, String),
    /// The stem reads other features.
    #[error(
        "the stem reads {0} channels, and partprobe's tokens have 6: position and normal; train with in_channels=6 and \
         feat_keys=(\"coord\", \"normal\")"
    )]
    Channels(usize),
    /// A tensor that the named network has is missing.
    #[error("no tensor `{0}`; is it the size that --backbone names?")]
    MissingTensor(String),
    /// A tensor has another shape.
    #[error(
        "`{name}` has the shape {found:?}, not {expected:?}; is it the size that --backbone names?"
    )]
    Shape {
        /// The tensor.
        name: String,
        /// Its shape.
        found: Vec<usize>,
        /// The shape that the network needs.
        expected: Vec<usize>,
    },
    /// The backbone has a tensor that our network does not have.
    #[error(
        "`{0}` has no counterpart in partprobe (relative positions, prompt-driven norms and deeper stages have none); \
         is it the size that --backbone names?"
    )]
    UnknownTensor(String),
    /// The config cannot make a network.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The file is not safetensors, or was damaged.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

/// A file of weights made from Pointcept's tensors, and the names of the tensors that were not used.
#[derive(Clone, Debug)]
pub struct FromPointcept {
    /// The network, its preparation and what it was trained on.
    pub file: ModelFile,
    /// Whether the head was in the file. If not, it has initial weights.
    pub has_head: bool,
    /// Tensors outside of the backbone, which were not used.
    pub left: Vec<String>,
}

/// The weights with Pointcept's names and layouts. Names of the backbone begin with `backbone.`, as in its segmentors.
///
/// The head, which PTv3 does not have, becomes `partprobe_head`. The metadata of the file are kept.
///
/// # Errors
/// If a setting of the network has no counterpart in PTv3.
pub fn to_pointcept(file: &ModelFile) -> Result<PointceptState, PointceptError> {
    let config = file.model.config();
    let map = NameMap::new(&ptv3_of(config)?.preset.stages());
    let shapes = parameters::shapes(file.model.network());
    let values = file.model.values();
    let mut rest = values.as_slice();
    let mut tensors = Vec::new();
    for shape in &shapes {
        let (own, after) = rest.split_at(shape.len());
        rest = after;
        tensors.push(StateTensor {
            name: map.pointcept_name(&shape.name),
            dims: map.their_dims(shape),
            values: their_layout(shape, own),
        });
    }
    Ok(PointceptState::new(tensors, Some(file.note())))
}

/// Makes a file of weights from tensors with Pointcept's names.
///
/// `named` is the network if the file does not name it. In this case, the head gets initial weights with `seed`.
///
/// # Errors
/// If the tensors are not those of the network, or a setting of it has no counterpart in PTv3.
pub fn from_pointcept(
    state: PointceptState,
    named: Option<&NetConfig>,
    seed: u64,
    backend: Backend,
) -> Result<FromPointcept, PointceptError> {
    let (config, preparation, trained_on) = match (state.note(), named) {
        (Some(note), None) => (
            note.net.clone(),
            note.preparation.clone(),
            note.trained_on.clone(),
        ),
        (_, Some(config)) => (config.clone(), serde_json::Value::Null, None),
        (None, None) => return Err(PointceptError::NoNetwork),
    };
    let map = NameMap::new(&ptv3_of(&config)?.preset.stages());
    let prefix = state.backbone_prefix()?;
    let model = Model::init(&config, seed, backend)?;
    let shapes = parameters::shapes(model.network());
    let initial = model.values();

    let mut tensors = state.into_tensors();
    let mut values = Vec::with_capacity(initial.len());
    let mut has_head = true;
    for shape in &shapes {
        let name = map.pointcept_name_below(&shape.name, &prefix);
        match tensors.remove(&name) {
            Some(tensor) => values.extend(our_values(shape, &map, tensor)?),
            None if is_head(&shape.name) => {
                has_head = false;
                values.extend(&initial[values.len()..][..shape.len()]);
            }
            None => return Err(PointceptError::MissingTensor(name)),
        }
    }
    tensors.retain(|name, _| !is_counter(name));
    if let Some(name) = tensors
        .keys()
        .find(|name| state::is_of_backbone(name, &prefix))
    {
        return Err(PointceptError::UnknownTensor(name.clone()));
    }
    Ok(FromPointcept {
        file: ModelFile {
            model: model.with_values(&values),
            preparation,
            trained_on,
        },
        has_head,
        left: tensors.into_keys().collect(),
    })
}

/// The settings of a network that has a counterpart in Pointcept's PTv3.
fn ptv3_of(config: &NetConfig) -> Result<&Ptv3Config, PointceptError> {
    let refused = |key, reason, needed| {
        Err(PointceptError::Setting {
            key,
            reason,
            needed,
        })
    };
    let BackboneConfig::Ptv3(ptv3) = &config.backbone else {
        return refused(
            "net.backbone.type",
            "is another network",
            "net.backbone.type = \"ptv3\"",
        );
    };
    if ptv3.norm != NormKind::Batch {
        let reason = "has batch norms in stem, pooling and unpooling";
        return refused("net.backbone.norm", reason, "net.backbone.norm = \"batch\"");
    }
    if ptv3.cell_exchange {
        let reason = "has one token per cell and no layer between the tokens of a cell";
        return refused(
            "net.backbone.cell_exchange",
            reason,
            "net.backbone.cell_exchange = false",
        );
    }
    if !ptv3.xcpe_of_skip {
        let reason = "computes the first xCPE of a decoder stage on the skip alone";
        return refused(
            "net.backbone.xcpe_of_skip",
            reason,
            "net.backbone.xcpe_of_skip = true",
        );
    }
    if !ptv3.xcpe {
        return refused(
            "net.backbone.xcpe",
            "has xCPE in each block",
            "net.backbone.xcpe = true",
        );
    }
    if !ptv3.attention {
        let reason = "has attention in each block";
        return refused(
            "net.backbone.attention",
            reason,
            "net.backbone.attention = true",
        );
    }
    Ok(ptv3)
}

/// Converts values to Pointcept's layout. Matrices are `[in, out]` here and `[out, in]` there. The cells of a convolution are
/// included in its input dimension.
fn their_layout(shape: &ParameterShape, values: &[f32]) -> Vec<f32> {
    match shape.dims[..] {
        [dim_in, dim_out] => transposed(values, dim_in, dim_out),
        _ => values.to_vec(),
    }
}

fn our_values(
    shape: &ParameterShape,
    map: &NameMap,
    tensor: StateTensor,
) -> Result<Vec<f32>, PointceptError> {
    let expected = map.their_dims(shape);
    if tensor.dims == expected {
        return Ok(match shape.dims[..] {
            [dim_in, dim_out] => transposed(&tensor.values, dim_out, dim_in),
            _ => tensor.values,
        });
    }
    match (tensor.dims[..].last(), expected[..].last()) {
        (Some(&found), Some(&wanted)) if names::is_stem(&shape.name) && found != wanted => {
            Err(PointceptError::Channels(found))
        }
        _ => Err(PointceptError::Shape {
            name: tensor.name,
            found: tensor.dims,
            expected,
        }),
    }
}
