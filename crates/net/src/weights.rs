//! Named tensors ↔ the bytes of a safetensors file.
//!
//! Everything that is no tensor stands in one metadata entry as JSON: the format keeps metadata in a hash map, and with
//! a single entry its order cannot reach the bytes. Matrices are stored as `[in, out]`.

use crate::config::{Backend, ConfigError, NetConfig};
use crate::model::Model;
use crate::parameters::{self, ParameterShape};
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// The metadata entry that holds all of ours.
const METADATA_KEY: &str = "partprobe";
/// Raised when a file of before can no longer be read.
const FORMAT_VERSION: u32 = 2;

/// Why bytes are not the weights of a network, or cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WeightsError {
    /// The config cannot make a network.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The bytes are no safetensors file, or the header would be too large for one.
    #[error("no readable safetensors file, it may be cut off; restore it or train again")]
    Format(#[from] SafeTensorError),
    /// The file lacks our metadata, or they do not parse.
    #[error("the safetensors file was not written by partprobe: {0}")]
    Metadata(String),
    /// The file is of another version of this format.
    #[error("the file has format version {0}, this program reads version 2; use the program that wrote it")]
    Version(u32),
    /// The weights belong to another network.
    #[error("the weights are of another network: {0}; use the config that they were trained with")]
    OtherNetwork(String),
}

#[derive(Deserialize, Serialize)]
struct Header<T> {
    format_version: u32,
    content: T,
}

/// A file in the making or a file read: f32 tensors by name, and something beside them.
pub(crate) struct TensorFile<T> {
    pub(crate) content: T,
    /// Name, shape and values, in the order of the names.
    pub(crate) tensors: Vec<(ParameterShape, Vec<f32>)>,
}

impl<T: Serialize + for<'a> Deserialize<'a>> TensorFile<T> {
    pub(crate) fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        let header = Header { format_version: FORMAT_VERSION, content: &self.content };
        let text = serde_json::to_string(&header).map_err(|error| WeightsError::Metadata(error.to_string()))?;
        let encoded: Vec<Vec<u8>> = self.tensors.iter().map(|(_, values)| little_endian(values)).collect();
        let views = self.tensors.iter().zip(&encoded).map(|((shape, _), bytes)| {
            let view = TensorView::new(Dtype::F32, shape.dims.clone(), bytes)?;
            Ok((shape.name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, SafeTensorError>>()?;
        Ok(safetensors::serialize(views, Some(HashMap::from([(METADATA_KEY.to_owned(), text)])))?)
    }

    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let (_, metadata) = SafeTensors::read_metadata(bytes)?;
        let entry = metadata.metadata().as_ref().and_then(|entries| entries.get(METADATA_KEY));
        let text = entry.ok_or_else(|| WeightsError::Metadata(format!("no metadata entry `{METADATA_KEY}`")))?;
        let unreadable = |error: serde_json::Error| WeightsError::Metadata(error.to_string());
        let version: Header<serde::de::IgnoredAny> = serde_json::from_str(text).map_err(unreadable)?;
        if version.format_version != FORMAT_VERSION {
            return Err(WeightsError::Version(version.format_version));
        }
        let header: Header<T> = serde_json::from_str(text).map_err(unreadable)?;
        let file = SafeTensors::deserialize(bytes)?;
        let mut tensors = file
            .tensors()
            .into_iter()
            .map(|(name, view)| {
                let shape = ParameterShape { name, dims: view.shape().to_vec() };
                Ok((shape, floats(&view)?))
            })
            .collect::<Result<Vec<_>, WeightsError>>()?;
        tensors.sort_by(|a, b| a.0.name.cmp(&b.0.name));
        Ok(Self { content: header.content, tensors })
    }

    /// Takes the values of the named tensors out of the file, one after the other.
    pub(crate) fn take(&mut self, shapes: &[ParameterShape]) -> Result<Vec<f32>, WeightsError> {
        let mut values = Vec::with_capacity(shapes.iter().map(ParameterShape::len).sum());
        for shape in shapes {
            let found = self.tensors.binary_search_by(|(candidate, _)| candidate.name.cmp(&shape.name));
            let Ok(at) = found else {
                return Err(WeightsError::OtherNetwork(format!("no tensor `{}`", shape.name)));
            };
            let (stored, own) = self.tensors.remove(at);
            if stored.dims != shape.dims {
                let text = format!("`{}` is {:?}, not {:?}", shape.name, stored.dims, shape.dims);
                return Err(WeightsError::OtherNetwork(text));
            }
            values.extend(own);
        }
        Ok(values)
    }
}

fn little_endian(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn floats(view: &TensorView) -> Result<Vec<f32>, WeightsError> {
    if view.dtype() != Dtype::F32 {
        return Err(WeightsError::OtherNetwork(format!("a tensor holds {:?} and no f32", view.dtype())));
    }
    let (words, _) = view.data().as_chunks::<4>();
    Ok(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
}

/// Cuts one vector of values into its named tensors.
pub(crate) fn named(shapes: &[ParameterShape], values: &[f32]) -> Vec<(ParameterShape, Vec<f32>)> {
    let mut rest = values;
    shapes
        .iter()
        .map(|shape| {
            let (own, after) = rest.split_at(shape.len().min(rest.len()));
            rest = after;
            (shape.clone(), own.to_vec())
        })
        .collect()
}

/// What a file of weights says beside them.
#[derive(Deserialize, Serialize)]
struct ModelContent {
    net: NetConfig,
    /// How the network's user prepares shapes; nothing here reads it.
    preparation: serde_json::Value,
}

pub(crate) fn write_weights(
    config: &NetConfig,
    preparation: &serde_json::Value,
    shapes: &[ParameterShape],
    values: &[f32],
) -> Result<Vec<u8>, WeightsError> {
    let content = ModelContent { net: config.clone(), preparation: preparation.clone() };
    TensorFile { content, tensors: named(shapes, values) }.to_bytes()
}

pub(crate) fn read_weights(
    config: &NetConfig,
    shapes: &[ParameterShape],
    bytes: &[u8],
) -> Result<Vec<f32>, WeightsError> {
    let mut file = TensorFile::<ModelContent>::from_bytes(bytes)?;
    if file.content.net != *config {
        return Err(WeightsError::OtherNetwork("the config inside the file differs".to_owned()));
    }
    file.take(shapes)
}

impl Model {
    /// The weights with a note on how shapes are prepared for them, which [`Model::open_safetensors`] gives back.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn to_safetensors_with(&self, preparation: &serde_json::Value) -> Result<Vec<u8>, WeightsError> {
        write_weights(self.config(), preparation, &parameters::shapes(self.network()), &self.values())
    }

    /// Makes the network that the file itself describes, and gives the note that was written with it.
    ///
    /// # Errors
    /// If the bytes are no such file.
    pub fn open_safetensors(bytes: &[u8], backend: Backend) -> Result<(Self, serde_json::Value), WeightsError> {
        let mut file = TensorFile::<ModelContent>::from_bytes(bytes)?;
        let blank = Self::blank(&file.content.net, backend)?;
        let values = file.take(&parameters::shapes(blank.network()))?;
        Ok((blank.with_values(&values), file.content.preparation))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> TensorFile<u32> {
        let shape = ParameterShape { name: name.to_owned(), dims: vec![2, 1] };
        TensorFile { content: 7, tensors: vec![(shape, vec![1.5, f32::MIN_POSITIVE])] }
    }

    #[test]
    fn tensors_and_content_come_back() {
        let mut back = TensorFile::<u32>::from_bytes(&file("a").to_bytes().unwrap()).unwrap();
        assert_eq!((back.content, &back.tensors), (7, &file("a").tensors));
        let wanted = |name: &str, dims: Vec<usize>| vec![ParameterShape { name: name.to_owned(), dims }];
        assert!(matches!(back.take(&wanted("b", vec![2, 1])), Err(WeightsError::OtherNetwork(_))));
        assert_eq!(back.take(&wanted("a", vec![2, 1])).unwrap(), [1.5, f32::MIN_POSITIVE]);
        assert!(matches!(file("a").take(&wanted("a", vec![1, 2])), Err(WeightsError::OtherNetwork(_))));
    }

    #[test]
    fn a_file_of_weights_describes_its_own_network() {
        let model = Model::init(&crate::planted::net(), 3, Backend::Flex).unwrap();
        let note = serde_json::json!({ "test_tokens": 1024 });
        let bytes = model.to_safetensors_with(&note).unwrap();
        let (back, found) = Model::open_safetensors(&bytes, Backend::Flex).unwrap();
        assert_eq!((back.config(), back.values(), found), (model.config(), model.values(), note));
        assert!(matches!(Model::open_safetensors(b"solid", Backend::Flex), Err(WeightsError::Format(_))));
    }

    #[test]
    fn what_we_did_not_write_is_named() {
        let with_metadata = |text: &str| {
            let none: [(&str, TensorView); 0] = [];
            let entries = HashMap::from([(METADATA_KEY.to_owned(), text.to_owned())]);
            safetensors::serialize(none, Some(entries)).unwrap()
        };
        let read = |bytes: &[u8]| TensorFile::<u32>::from_bytes(bytes).err();
        assert!(matches!(read(&with_metadata("{")), Some(WeightsError::Metadata(_))));
        assert!(matches!(read(&with_metadata(r#"{"format_version":9,"content":[]}"#)), Some(WeightsError::Version(9))));
        let empty: [(&str, TensorView); 0] = [];
        assert!(matches!(read(&safetensors::serialize(empty, None).unwrap()), Some(WeightsError::Metadata(_))));
        assert!(matches!(read(&[]), Some(WeightsError::Format(_))));
        let halves = TensorView::new(Dtype::F16, vec![1], &[0, 0]).unwrap();
        let header = format!(r#"{{"format_version":{FORMAT_VERSION},"content":7}}"#);
        let foreign = safetensors::serialize([("a", halves)], Some(HashMap::from([(METADATA_KEY.to_owned(), header)])));
        assert!(matches!(read(&foreign.unwrap()), Some(WeightsError::OtherNetwork(_))));
    }
}
