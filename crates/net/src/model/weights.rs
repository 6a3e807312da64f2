//! Writes named tensors as a safetensors file, and reads them back.
//!
//! All data that are not tensors are in one metadata entry as JSON. The metadata are a hash map. With a single entry, the order
//! of the map cannot change the bytes. Matrices are stored as `[in, out]`.

use crate::config::{Backend, ConfigError};
use crate::model::Model;
use crate::model::net_config::NetConfig;
use crate::model::parameters::{self, ParameterShape};
use crate::model::trained_on::TrainedOn;
use partprobe_carrier::sha256_hex;
use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, TensorView};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeSet, HashMap};

/// The metadata entry with all of our data.
const METADATA_KEY: &str = "partprobe";
/// The version is increased if earlier files can no longer be read.
const FORMAT_VERSION: u32 = 2;

/// The reason why bytes are not the weights of a network, or cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// The config cannot make a network.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The bytes are not a safetensors file, or the header would be too large for one.
    #[error("the file cannot be read as safetensors and may be cut off; restore it or train again")]
    Format(#[from] SafeTensorError),
    /// The file does not have our metadata, or they do not parse.
    #[error("the safetensors file was not written by partprobe: {0}")]
    Metadata(String),
    /// The file has another version of this format.
    #[error(
        "the file has format version {0}, this program reads version 2; use the program that wrote it"
    )]
    Version(u32),
    /// The values are not those that were written.
    #[error(
        "the file is damaged: its values do not have the hash that it names; restore it or train again"
    )]
    Damaged,
    /// The tensors have the names of another program.
    #[error(
        "the tensors have Pointcept's names; convert the file with `partprobe weights from-pointcept`"
    )]
    PointceptNames,
    /// The weights belong to another network.
    #[error("the weights are of another network: {0}; use the config that they were trained with")]
    OtherNetwork(String),
}

#[derive(Deserialize, Serialize)]
struct Header<T> {
    format_version: u32,
    /// The SHA-256 of all values, in the order of their names. Files of earlier versions of the program do not contain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values_sha256: Option<String>,
    content: T,
}

/// The contents of a file: f32 tensors by name, and metadata.
pub(crate) struct TensorFile<T> {
    pub(crate) content: T,
    /// Name, shape and values, in the order of the names.
    pub(crate) tensors: Vec<(ParameterShape, Vec<f32>)>,
}

impl<T: Serialize + for<'a> Deserialize<'a>> TensorFile<T> {
    pub(crate) fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        let encoded: Vec<Vec<u8>> = self
            .tensors
            .iter()
            .map(|(_, values)| little_endian(values))
            .collect();
        let text = header_text(&self.content, Some(self.values_sha256()))?;
        let views = self
            .tensors
            .iter()
            .zip(&encoded)
            .map(|((shape, _), bytes)| {
                let view = TensorView::new(Dtype::F32, shape.dims.clone(), bytes)?;
                Ok((shape.name.as_str(), view))
            });
        let views = views.collect::<Result<Vec<_>, SafeTensorError>>()?;
        Ok(safetensors::serialize(
            views,
            Some(HashMap::from([(METADATA_KEY.to_owned(), text)])),
        )?)
    }

    pub(crate) fn from_bytes(bytes: &[u8]) -> Result<Self, WeightsError> {
        let (_, metadata) = SafeTensors::read_metadata(bytes)?;
        // PyTorch counts the batches of a batch norm, which nothing here does.
        let is_of_pytorch = |name: &String| name.ends_with("num_batches_tracked");
        if metadata.tensors().keys().any(is_of_pytorch) {
            return Err(WeightsError::PointceptNames);
        }
        let entry = metadata
            .metadata()
            .as_ref()
            .and_then(|entries| entries.get(METADATA_KEY));
        let text = entry
            .ok_or_else(|| WeightsError::Metadata(format!("no metadata entry `{METADATA_KEY}`")))?;
        let header: Header<T> = header_from_text(text)?;
        let file = SafeTensors::deserialize(bytes)?;
        let mut tensors = file
            .tensors()
            .into_iter()
            .map(|(name, view)| {
                let shape = ParameterShape {
                    name,
                    dims: view.shape().to_vec(),
                };
                Ok((shape, floats(&view)?))
            })
            .collect::<Result<Vec<_>, WeightsError>>()?;
        tensors.sort_by(|a, b| a.0.name.cmp(&b.0.name));
        let file = Self {
            content: header.content,
            tensors,
        };
        match header.values_sha256 {
            Some(stored) if stored != file.values_sha256() => Err(WeightsError::Damaged),
            _ => Ok(file),
        }
    }

    fn values_sha256(&self) -> String {
        let mut by_name: Vec<_> = self.tensors.iter().collect();
        by_name.sort_by(|a, b| a.0.name.cmp(&b.0.name));
        let values = by_name.iter().flat_map(|(_, values)| values);
        let bytes: Vec<u8> = values.flat_map(|value| value.to_le_bytes()).collect();
        sha256_hex(&bytes)
    }

    /// Takes the values of the named tensors out of the file, tensor by tensor.
    pub(crate) fn take(&mut self, shapes: &[ParameterShape]) -> Result<Vec<f32>, WeightsError> {
        let mut values = Vec::with_capacity(shapes.iter().map(ParameterShape::len).sum());
        for shape in shapes {
            let found = self
                .tensors
                .binary_search_by(|(candidate, _)| candidate.name.cmp(&shape.name));
            let Ok(at) = found else {
                return Err(WeightsError::OtherNetwork(format!(
                    "no tensor `{}`",
                    shape.name
                )));
            };
            let (stored, own) = self.tensors.remove(at);
            if stored.dims != shape.dims {
                let text = format!(
                    "`{}` is {:?}, not {:?}",
                    shape.name, stored.dims, shape.dims
                );
                return Err(WeightsError::OtherNetwork(text));
            }
            values.extend(own);
        }
        Ok(values)
    }
}

fn little_endian(values: &[f32]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect()
}

fn floats(view: &TensorView) -> Result<Vec<f32>, WeightsError> {
    if view.dtype() != Dtype::F32 {
        return Err(WeightsError::OtherNetwork(format!(
            "a tensor holds {:?} and no f32",
            view.dtype()
        )));
    }
    let (words, _) = view.data().as_chunks::<4>();
    Ok(words.iter().map(|word| f32::from_le_bytes(*word)).collect())
}

/// Divides one vector of values into its named tensors.
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

/// The metadata of a file of weights.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct ModelNote {
    pub(crate) net: NetConfig,
    /// How the user of the network prepares shapes. Nothing here reads it.
    pub(crate) preparation: serde_json::Value,
    /// The shapes that the weights were trained on. Files of earlier versions of the program do not contain them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) trained_on: Option<TrainedOn>,
}

/// The text of a metadata entry.
pub(crate) fn note_to_text<T: Serialize>(content: &T) -> Result<String, WeightsError> {
    header_text(content, None)
}

fn header_text<T: Serialize>(
    content: &T,
    values_sha256: Option<String>,
) -> Result<String, WeightsError> {
    let header = Header {
        format_version: FORMAT_VERSION,
        values_sha256,
        content,
    };
    serde_json::to_string(&header).map_err(|error| WeightsError::Metadata(error.to_string()))
}

/// The content of a metadata entry.
pub(crate) fn note_from_text<T: for<'a> Deserialize<'a>>(text: &str) -> Result<T, WeightsError> {
    Ok(header_from_text(text)?.content)
}

fn header_from_text<T: for<'a> Deserialize<'a>>(text: &str) -> Result<Header<T>, WeightsError> {
    let unreadable = |error: serde_json::Error| WeightsError::Metadata(error.to_string());
    let version: Header<serde::de::IgnoredAny> = serde_json::from_str(text).map_err(unreadable)?;
    if version.format_version != FORMAT_VERSION {
        return Err(WeightsError::Version(version.format_version));
    }
    serde_json::from_str(text).map_err(unreadable)
}

/// The contents of a file of weights: the network and the metadata.
#[derive(Clone, Debug)]
pub struct ModelFile {
    /// The network with its weights.
    pub model: Model,
    /// How the user of the network prepares shapes.
    pub preparation: serde_json::Value,
    /// The shapes that it was trained on, or `None` if the file does not name them.
    pub trained_on: Option<TrainedOn>,
}

impl ModelFile {
    /// Makes the network that the bytes describe.
    ///
    /// # Errors
    /// If the bytes are not a file of weights.
    pub fn from_bytes(bytes: &[u8], backend: Backend) -> Result<Self, WeightsError> {
        let mut file = TensorFile::<ModelNote>::from_bytes(bytes)?;
        let blank = Model::blank(&file.content.net, backend)?;
        let values = file.take(&parameters::shapes(blank.network()))?;
        let ModelNote {
            preparation,
            trained_on,
            ..
        } = file.content;
        Ok(Self {
            model: blank.with_values(&values),
            preparation,
            trained_on,
        })
    }

    /// The bytes of the file. The same weights and metadata give the same bytes.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn to_bytes(&self) -> Result<Vec<u8>, WeightsError> {
        let shapes = parameters::shapes(self.model.network());
        TensorFile {
            content: self.note(),
            tensors: named(&shapes, &self.model.values()),
        }
        .to_bytes()
    }

    /// The metadata of the file.
    pub(crate) fn note(&self) -> ModelNote {
        ModelNote {
            net: self.model.config().clone(),
            preparation: self.preparation.clone(),
            trained_on: self.trained_on.clone(),
        }
    }

    /// Refuses the network if its config differs from another one. `net.refine` may differ, because it has no weights.
    ///
    /// # Errors
    /// If the configs differ.
    pub fn ensure_network(&self, config: &NetConfig) -> Result<(), WeightsError> {
        if self.model.config().without_refine() == config.without_refine() {
            return Ok(());
        }
        Err(WeightsError::OtherNetwork(first_difference(
            self.model.config(),
            config,
        )))
    }
}

/// The first key in which the config of a file differs from another one.
fn first_difference(of_file: &NetConfig, wanted: &NetConfig) -> String {
    let json = |config: &NetConfig| serde_json::to_value(config.without_refine()).ok();
    let found = json(of_file).zip(json(wanted));
    let found = found.and_then(|(of_file, wanted)| differing_key("net", &of_file, &wanted));
    found.unwrap_or_else(|| "the config inside the file differs".to_owned())
}

fn differing_key(path: &str, of_file: &Value, wanted: &Value) -> Option<String> {
    match (of_file, wanted) {
        (Value::Object(of_file), Value::Object(wanted)) => {
            let keys: BTreeSet<&String> = of_file.keys().chain(wanted.keys()).collect();
            // Another type of backbone has other keys, so the type comes first.
            let mut keys: Vec<&String> = keys.into_iter().collect();
            keys.sort_by_key(|key| *key != "type");
            keys.into_iter().find_map(|key| {
                let value = |object: &serde_json::Map<String, Value>| {
                    object.get(key).cloned().unwrap_or(Value::Null)
                };
                differing_key(&format!("{path}.{key}"), &value(of_file), &value(wanted))
            })
        }
        (of_file, wanted) if of_file == wanted => None,
        (of_file, wanted) => Some(format!("{path} is {of_file} in the file and {wanted} here")),
    }
}

impl Model {
    /// The weights as a safetensors file whose metadata contain the config. The same weights give the same bytes.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, WeightsError> {
        ModelFile {
            model: self.clone(),
            preparation: serde_json::Value::Null,
            trained_on: None,
        }
        .to_bytes()
    }

    /// Reads weights that [`Model::to_safetensors`] wrote for the same config.
    ///
    /// # Errors
    /// If the bytes are not such a file, or belong to another network.
    pub fn from_safetensors(
        config: &NetConfig,
        bytes: &[u8],
        backend: Backend,
    ) -> Result<Self, WeightsError> {
        let file = ModelFile::from_bytes(bytes, backend)?;
        file.ensure_network(config)?;
        Ok(file.model)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(name: &str) -> TensorFile<u32> {
        let shape = ParameterShape {
            name: name.to_owned(),
            dims: vec![2, 1],
        };
        TensorFile {
            content: 7,
            tensors: vec![(shape, vec![1.5, f32::MIN_POSITIVE])],
        }
    }

    #[test]
    fn tensors_and_content_round_trip() {
        let mut back = TensorFile::<u32>::from_bytes(&file("a").to_bytes().unwrap()).unwrap();
        assert_eq!((back.content, &back.tensors), (7, &file("a").tensors));
        let wanted = |name: &str, dims: Vec<usize>| {
            vec![ParameterShape {
                name: name.to_owned(),
                dims,
            }]
        };
        assert!(matches!(
            back.take(&wanted("b", vec![2, 1])),
            Err(WeightsError::OtherNetwork(_))
        ));
        assert_eq!(
            back.take(&wanted("a", vec![2, 1])).unwrap(),
            [1.5, f32::MIN_POSITIVE]
        );
        assert!(matches!(
            file("a").take(&wanted("a", vec![1, 2])),
            Err(WeightsError::OtherNetwork(_))
        ));
    }

    #[test]
    fn a_file_of_weights_describes_its_own_network() {
        let model = Model::init(&crate::testing::net(), 3, Backend::Flex).unwrap();
        let note = serde_json::json!({ "test_tokens": 1024 });
        let file = ModelFile {
            model,
            preparation: note,
            trained_on: None,
        };
        let back = ModelFile::from_bytes(&file.to_bytes().unwrap(), Backend::Flex).unwrap();
        assert_eq!(
            (back.model.config(), back.model.values()),
            (file.model.config(), file.model.values())
        );
        assert_eq!(
            (back.preparation, back.trained_on),
            (file.preparation, None)
        );
        assert!(matches!(
            ModelFile::from_bytes(b"solid", Backend::Flex),
            Err(WeightsError::Format(_))
        ));
    }

    #[test]
    fn the_training_data_of_weights_is_read_back() {
        let trained_on = TrainedOn {
            supervision: "step-parts".to_owned(),
            settings: crate::testing::settings(3),
            train: crate::ShapeKeys::of([("text", "mesh")]),
            valid: crate::ShapeKeys::default(),
            initial: None,
        };
        let model = Model::init(&crate::testing::net(), 3, Backend::Flex).unwrap();
        let file = ModelFile {
            model,
            preparation: serde_json::Value::Null,
            trained_on: Some(trained_on),
        };
        let back = ModelFile::from_bytes(&file.to_bytes().unwrap(), Backend::Flex).unwrap();
        assert_eq!(back.trained_on, file.trained_on);
    }

    #[test]
    fn foreign_files_of_weights_are_named() {
        let with_metadata = |text: &str| {
            let none: [(&str, TensorView); 0] = [];
            let entries = HashMap::from([(METADATA_KEY.to_owned(), text.to_owned())]);
            safetensors::serialize(none, Some(entries)).unwrap()
        };
        let read = |bytes: &[u8]| TensorFile::<u32>::from_bytes(bytes).err();
        assert!(matches!(
            read(&with_metadata("{")),
            Some(WeightsError::Metadata(_))
        ));
        assert!(matches!(
            read(&with_metadata(r#"{"format_version":9,"content":[]}"#)),
            Some(WeightsError::Version(9))
        ));
        let empty: [(&str, TensorView); 0] = [];
        assert!(matches!(
            read(&safetensors::serialize(empty, None).unwrap()),
            Some(WeightsError::Metadata(_))
        ));
        assert!(matches!(read(&[]), Some(WeightsError::Format(_))));
        let halves = TensorView::new(Dtype::F16, vec![1], &[0, 0]).unwrap();
        let header = format!(r#"{{"format_version":{FORMAT_VERSION},"content":7}}"#);
        let foreign = safetensors::serialize(
            [("a", halves)],
            Some(HashMap::from([(METADATA_KEY.to_owned(), header)])),
        );
        assert!(matches!(
            read(&foreign.unwrap()),
            Some(WeightsError::OtherNetwork(_))
        ));
    }
}
