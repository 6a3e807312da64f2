//! A network with its weights: tokens in, unit embeddings out; weights as safetensors with the config inside.

use crate::config::{Backend, ConfigError, NetConfig};
use crate::hierarchy::fixed_turns;
use crate::network::{Network, ShapeInput, n_levels, prepare};
use crate::one_thread::{ThreadError, one_thread_pool};
use crate::parameters::{self, Initializer};
use crate::tokens::Tokens;
use crate::weights::{WeightsError, read_weights, write_weights};
use burn::module::Module;
use burn::tensor::Device;
use carrier::Embeddings;

/// A network and the values of its parameters.
#[derive(Clone, Debug)]
pub struct Model {
    config: NetConfig,
    backend: Backend,
    network: Network,
}

/// Why tokens could not be embedded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EmbedError {
    /// The operating system gave no thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// The network's output holds NaN or infinity.
    #[error("the network's output is not finite; train again with a lower `optim.learning_rate`")]
    NotFinite,
}

pub(crate) fn device_of(backend: Backend) -> Device {
    match backend {
        Backend::Flex => Device::flex(),
        #[allow(deprecated, reason = "kept as the portable cross-check of the flex backend")]
        Backend::Ndarray => Device::ndarray(),
    }
}

impl Model {
    /// A network with initial weights; they depend on `config` and `seed` only.
    ///
    /// # Errors
    /// If the config holds a size that no network can have.
    pub fn init(config: &NetConfig, seed: u64, backend: Backend) -> Result<Self, ConfigError> {
        config.check()?;
        let network = Network::new(config, &Initializer { seed, device: &device_of(backend) });
        Ok(Self { config: config.clone(), backend, network })
    }

    /// What the network is.
    #[must_use]
    pub fn config(&self) -> &NetConfig {
        &self.config
    }

    /// Parameters of the backbone, without the head.
    #[must_use]
    pub fn n_parameters(&self) -> usize {
        self.network.num_params() - self.n_head_parameters()
    }

    /// Parameters of the embedding head.
    #[must_use]
    pub fn n_head_parameters(&self) -> usize {
        self.network.n_head_parameters()
    }

    /// One unit embedding for each token. The serialisation order is fixed, and one thread computes.
    ///
    /// # Errors
    /// If no thread can be started, or the weights make numbers that are not finite.
    pub fn embed(&self, tokens: &Tokens) -> Result<Embeddings, EmbedError> {
        let raw = one_thread_pool()?.install(|| {
            let input = prepare(&self.config, tokens, &fixed_turns(n_levels(&self.config)));
            self.forward(&input)
        });
        let unit = unit_rows(raw, self.config.embedding_dim);
        if unit.iter().any(|x| !x.is_finite()) {
            return Err(EmbedError::NotFinite);
        }
        Embeddings::new(self.config.embedding_dim, unit).map_err(|_| EmbedError::NotFinite)
    }

    /// The weights as a safetensors file whose metadata hold the config; the same weights give the same bytes.
    ///
    /// # Errors
    /// If the header would be larger than the format allows.
    pub fn to_safetensors(&self) -> Result<Vec<u8>, WeightsError> {
        write_weights(&self.config, &parameters::shapes(&self.network), &self.values())
    }

    /// Reads weights that [`Model::to_safetensors`] wrote for the same config.
    ///
    /// # Errors
    /// If the bytes are no such file, or belong to another network.
    pub fn from_safetensors(config: &NetConfig, bytes: &[u8], backend: Backend) -> Result<Self, WeightsError> {
        let blank = Self::init(config, 0, backend)?;
        let values = read_weights(config, &parameters::shapes(&blank.network), bytes)?;
        Ok(blank.with_values(&values))
    }

    pub(crate) fn backend(&self) -> Backend {
        self.backend
    }

    pub(crate) fn network(&self) -> &Network {
        &self.network
    }

    pub(crate) fn values(&self) -> Vec<f32> {
        parameters::values(&self.network)
    }

    pub(crate) fn with_values(self, values: &[f32]) -> Self {
        Self { network: parameters::with_values(self.network, values), ..self }
    }

    fn forward(&self, input: &ShapeInput) -> Vec<f32> {
        parameters::host_values(self.network.forward(input, &device_of(self.backend)))
    }
}

/// Divides each row by its length.
fn unit_rows(mut values: Vec<f32>, dim: usize) -> Vec<f32> {
    for row in values.chunks_exact_mut(dim) {
        let norm = row.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt().max(1e-12);
        row.iter_mut().for_each(|x| *x = (f64::from(*x) / norm) as f32);
    }
    values
}
