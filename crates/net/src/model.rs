//! A network with its weights: tokens in, unit embeddings out; weights as safetensors with the config inside.

use crate::config::{Backend, ConfigError, NetConfig};
use crate::hierarchy::fixed_turns;
use crate::network::{Network, ShapeInput, n_levels, prepare};
use crate::one_thread::{ThreadError, one_thread_pool};
use crate::parameters::{self, Initializer};
use crate::tokens::Tokens;
use crate::weights::{WeightsError, read_weights};
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
        #[cfg(feature = "wgpu")]
        Backend::Wgpu => Device::wgpu(burn::tensor::DeviceKind::DefaultDevice),
        #[cfg(feature = "cuda")]
        Backend::Cuda => Device::cuda(burn::tensor::DeviceIndex::Default),
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
        self.to_safetensors_with(&serde_json::Value::Null)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::BackboneConfig;
    use crate::planted::{labelled_box, net};
    use crate::tokens::tokenize;

    fn pointnet() -> NetConfig {
        NetConfig { backbone: BackboneConfig::Pointnet { widths: vec![16, 24] }, embedding_dim: 8 }
    }

    fn tokens() -> Tokens {
        tokenize(&labelled_box(2.0, 900).sample, 60).unwrap()
    }

    #[test]
    fn micro_has_its_parameters() {
        let config = NetConfig { embedding_dim: 128, ..net() };
        let model = Model::init(&config, 0, Backend::Flex).unwrap();
        // Blocks 40C² + 17C, pools, unpools and the 5³ stem.
        let block = |width: usize| 40 * width * width + 17 * width;
        let blocks = block(32) + block(48) + block(64) + 2 * block(48);
        let pools = 32 * 48 + 3 * 48 + 48 * 64 + 3 * 64;
        let unpools = (64 + 48) * 48 + 6 * 48 + (48 + 32) * 48 + 6 * 48;
        let stem = 125 * 6 * 32 + 2 * 32;
        assert_eq!(model.n_parameters(), blocks + pools + unpools + stem);
        assert_eq!(model.n_parameters(), 524_160);
        assert_eq!(model.n_head_parameters(), 48 * 128 + 128);
    }

    #[test]
    fn embeddings_are_unit_rows_one_a_token() {
        for config in [net(), pointnet()] {
            let model = Model::init(&config, 1, Backend::Flex).unwrap();
            let embeddings = model.embed(&tokens()).unwrap();
            assert_eq!((embeddings.n_rows(), embeddings.dim()), (tokens().n(), config.embedding_dim));
            for row in embeddings.rows() {
                assert!((row.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn both_backends_agree() {
        for config in [net(), pointnet()] {
            let [flex, ndarray] = [Backend::Flex, Backend::Ndarray]
                .map(|backend| Model::init(&config, 1, backend).unwrap().embed(&tokens()).unwrap());
            let apart = flex.values().iter().zip(ndarray.values()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(apart < 1e-4, "{apart}");
        }
    }

    #[test]
    fn permuting_the_points_permutes_the_embeddings() {
        let sample = labelled_box(2.0, 900).sample;
        let mut turned = sample.clone();
        turned.points.rotate_left(123);
        turned.normals.rotate_left(123);
        let model = Model::init(&net(), 1, Backend::Flex).unwrap();
        let of_points = |sample| {
            let tokens = tokenize(sample, 60).unwrap();
            let embeddings = model.embed(&tokens).unwrap();
            tokens.token_of_point.iter().map(|&token| embeddings.row(token as usize).to_vec()).collect::<Vec<_>>()
        };
        let mut back = of_points(&turned);
        back.rotate_right(123);
        for (a, b) in of_points(&sample).iter().flatten().zip(back.iter().flatten()) {
            assert!((a - b).abs() < 1e-4);
        }
    }

    #[test]
    fn weights_come_back_and_foreign_bytes_do_not() {
        let model = Model::init(&net(), 7, Backend::Flex).unwrap();
        let bytes = model.to_safetensors().unwrap();
        let read = |config: &NetConfig, bytes: &[u8]| Model::from_safetensors(config, bytes, Backend::Flex);
        let back = read(&net(), &bytes).unwrap();
        assert_eq!(back.values(), model.values());
        assert_eq!(back.to_safetensors().unwrap(), bytes);
        assert!(matches!(read(&pointnet(), &bytes), Err(WeightsError::OtherNetwork(_))));
        assert!(matches!(read(&net(), &bytes[..bytes.len() / 2]), Err(WeightsError::Format(_))));
        assert!(matches!(read(&net(), b"solid"), Err(WeightsError::Format(_))));
    }

    #[test]
    fn seeds_give_different_weights_and_one_seed_the_same() {
        let values = |seed| Model::init(&net(), seed, Backend::Flex).unwrap().values();
        assert_eq!(values(3), values(3));
        assert_ne!(values(3), values(4));
    }

    #[test]
    fn a_single_token_has_an_embedding() {
        let one = carrier::PointSample {
            points: vec![[1.0; 3]; 4],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            triangles: vec![0; 4],
        };
        for config in [net(), pointnet()] {
            let model = Model::init(&config, 1, Backend::Flex).unwrap();
            assert_eq!(model.embed(&tokenize(&one, 60).unwrap()).unwrap().n_rows(), 1);
        }
    }
}
