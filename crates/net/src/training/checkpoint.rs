//! Writes and reads a training exactly: weights, moments, step count and settings in one safetensors file.
//!
//! No state of a random generator is kept, because the random numbers of a step are keyed by its index.

use crate::config::{Backend, TrainSettings};
use crate::model::Model;
use crate::model::net_config::NetConfig;
use crate::model::parameters::{self, ParameterShape};
use crate::model::weights::{TensorFile, WeightsError, named};
use crate::training::optimizer::AdamW;
use crate::training::{TrainError, Training};
use serde::{Deserialize, Serialize};

/// The reason why a training cannot be resumed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// The bytes are not a checkpoint.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// The settings inside are out of range, or no thread can be started.
    #[error(transparent)]
    Training(#[from] TrainError),
}

#[derive(Deserialize, Serialize)]
struct Content {
    net: NetConfig,
    settings: TrainSettings,
    n_steps_done: usize,
    /// See [`Training::data`]. Files of earlier versions of the program do not contain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    data: Option<String>,
}

/// The three vectors of a training, by the prefix of their tensors' names.
const PREFIXES: [&str; 3] = ["weights", "first_moment", "second_moment"];

fn prefixed(shapes: &[ParameterShape], prefix: &str) -> Vec<ParameterShape> {
    let rename = |shape: &ParameterShape| ParameterShape {
        name: format!("{prefix}.{}", shape.name),
        ..shape.clone()
    };
    shapes.iter().map(rename).collect()
}

impl Training {
    /// All data that [`Training::resume`] needs to continue exactly.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn checkpoint(&self) -> Result<Vec<u8>, WeightsError> {
        let content = Content {
            net: self.model.config().clone(),
            settings: self.settings.clone(),
            n_steps_done: self.n_done,
            data: self.data.clone(),
        };
        let shapes = parameters::shapes(self.model.network());
        let vectors = [&self.values, &self.adam.first, &self.adam.second];
        let tensors = PREFIXES
            .iter()
            .zip(vectors)
            .flat_map(|(prefix, values)| named(&prefixed(&shapes, prefix), values));
        TensorFile {
            content,
            tensors: tensors.collect(),
        }
        .to_bytes()
    }

    /// Resumes a training. The same steps then give the same bytes as without the interruption.
    ///
    /// # Errors
    /// If the bytes are not a checkpoint of this program.
    pub fn resume(bytes: &[u8], backend: Backend) -> Result<Self, ResumeError> {
        let mut file = TensorFile::<Content>::from_bytes(bytes)?;
        let blank = Model::blank(&file.content.net, backend).map_err(WeightsError::from)?;
        let shapes = parameters::shapes(blank.network());
        let [weights, first, second] = PREFIXES.map(|prefix| file.take(&prefixed(&shapes, prefix)));
        let adam = AdamW {
            first: first?,
            second: second?,
        };
        let model = blank.with_values(&weights?);
        let Content {
            settings,
            n_steps_done,
            data,
            ..
        } = file.content;
        let mut training = Self::from_state(model, &settings, adam, n_steps_done)?;
        training.data = data;
        Ok(training)
    }
}
