//! Reads and writes a state dict with Pointcept's names as a safetensors file.
//!
//! The file holds f32 tensors, and the counters of batch norms as i64. The metadata of our file of weights are included. A file
//! of Pointcept has none.

use super::PointceptError;
use super::names::{STEM, is_counter};
use crate::model::weights::{ModelNote, WeightsError, note_from_text, note_to_text};
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use std::collections::{BTreeMap, HashMap};

/// The metadata entry with the note of our file.
const METADATA_KEY: &str = "partprobe";

/// A tensor with its name, row-major.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StateTensor {
    pub(super) name: String,
    pub(super) dims: Vec<usize>,
    pub(super) values: Vec<f32>,
}

/// Tensors with Pointcept's names, and the metadata of our file of weights.
#[derive(Clone, Debug)]
pub struct PointceptState {
    tensors: BTreeMap<String, StateTensor>,
    note: Option<ModelNote>,
}

impl PointceptState {
    pub(super) fn new(tensors: Vec<StateTensor>, note: Option<ModelNote>) -> Self {
        let named = |tensor: StateTensor| (tensor.name.clone(), tensor);
        Self {
            tensors: tensors.into_iter().map(named).collect(),
            note,
        }
    }

    pub(super) fn note(&self) -> Option<&ModelNote> {
        self.note.as_ref()
    }

    pub(super) fn into_tensors(self) -> BTreeMap<String, StateTensor> {
        self.tensors
    }

    /// The prefix of the names of the backbone.
    pub(super) fn backbone_prefix(&self) -> Result<String, PointceptError> {
        let names = self.tensors.keys();
        let prefixes: Vec<&str> = names.filter_map(|name| name.strip_suffix(STEM)).collect();
        match prefixes[..] {
            [] => Err(PointceptError::NoBackbone(STEM)),
            [prefix] => Ok(prefix.to_owned()),
            _ => Err(PointceptError::ManyBackbones(
                prefixes.len(),
                prefixes.join(", "),
            )),
        }
    }

    /// Reads a safetensors file.
    ///
    /// # Errors
    /// If the bytes are not a safetensors file, or a tensor is not f32.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let (_, metadata) = SafeTensors::read_metadata(bytes)?;
        let entry = metadata
            .metadata()
            .as_ref()
            .and_then(|entries| entries.get(METADATA_KEY));
        let note = entry.map(|text| note_from_text(text)).transpose()?;
        let file = SafeTensors::deserialize(bytes)?;
        let mut tensors = Vec::new();
        for (name, view) in file.tensors() {
            if is_counter(&name) {
                continue;
            }
            if view.dtype() != Dtype::F32 {
                let text = format!("`{name}` holds {:?} and no f32", view.dtype());
                return Err(WeightsError::OtherNetwork(text));
            }
            let (words, _) = view.data().as_chunks::<4>();
            tensors.push(StateTensor {
                name,
                dims: view.shape().to_vec(),
                values: words.iter().map(|word| f32::from_le_bytes(*word)).collect(),
            });
        }
        Ok(Self::new(tensors, note))
    }

    /// The bytes of a safetensors file. The same state gives the same bytes.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        let little_endian = |tensor: &StateTensor| -> Vec<u8> {
            tensor.values.iter().flat_map(|x| x.to_le_bytes()).collect()
        };
        let encoded: Vec<Vec<u8>> = self.tensors.values().map(little_endian).collect();
        let floats = self.tensors.values().zip(&encoded).map(|(tensor, bytes)| {
            let view = TensorView::new(Dtype::F32, tensor.dims.clone(), bytes)?;
            Ok((tensor.name.clone(), view))
        });
        let means = self.tensors.keys();
        let counters = means.filter_map(|name| name.strip_suffix("running_mean"));
        let zero = 0i64.to_le_bytes();
        let counters = counters.map(|layer| {
            let view = TensorView::new(Dtype::I64, Vec::new(), &zero)?;
            Ok((format!("{layer}num_batches_tracked"), view))
        });
        let views = floats
            .chain(counters)
            .collect::<Result<Vec<_>, SafeTensorError>>()?;
        let note = self.note.as_ref().map(note_to_text).transpose()?;
        let metadata = note.map(|text| HashMap::from([(METADATA_KEY.to_owned(), text)]));
        Ok(safetensors::serialize(views, metadata)?)
    }
}

/// Whether a tensor belongs to the backbone whose names begin with this prefix.
pub(super) fn is_of_backbone(name: &str, prefix: &str) -> bool {
    let own = ["embedding.", "enc.", "dec."];
    name.strip_prefix(prefix)
        .is_some_and(|rest| own.iter().any(|piece| rest.starts_with(piece)))
}
