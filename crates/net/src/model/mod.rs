//! Computes unit embeddings of tokens with a network and its weights.
//!
//! `backbones` are the networks, `layers` their layers, `parameters` all weights as one vector, and `weights` the files.

pub(crate) mod backbones;
pub(crate) mod batch_norm;
pub(crate) mod forward_mode;
mod joined_rows;
pub(crate) mod layers;
pub(crate) mod net_config;
pub(crate) mod network;
pub(crate) mod parameters;
pub(crate) mod poses;
pub(crate) mod refine;
mod row_span;
pub(crate) mod trained_on;
pub(crate) mod weights;

use crate::config::{Backend, ConfigError};
use crate::data::tokens::Tokens;
use crate::kernels::one_thread::{ThreadError, on_one_thread};
use crate::model::backbones::ShapeInput;
use crate::model::forward_mode::ForwardMode;
use crate::model::net_config::NetConfig;
use crate::model::network::Network;
use crate::model::parameters::Initializer;
use burn::tensor::Device;
use partprobe_carrier::Embeddings;

/// A network and the values of its parameters.
#[derive(Clone, Debug)]
pub struct Model {
    config: NetConfig,
    backend: Backend,
    network: Network,
}

/// The number of values that training learns. Running statistics of batch norms do not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParameterCount {
    /// The number of parameters of the network below the embedding head.
    pub backbone: usize,
    /// The number of parameters of the embedding head.
    pub head: usize,
}

/// The reason why tokens could not be embedded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EmbedError {
    /// The operating system could not start a thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// The network's output holds NaN or infinity.
    #[error("the network's output is not finite; train again with a lower `optim.learning_rate`")]
    NotFinite,
}

pub(crate) fn device_of(backend: Backend) -> Device {
    match backend {
        Backend::Flex => Device::flex(),
        #[cfg(feature = "ndarray")]
        #[allow(
            deprecated,
            reason = "kept as the portable cross-check of the flex backend"
        )]
        Backend::Ndarray => Device::ndarray(),
        #[cfg(feature = "wgpu")]
        Backend::Wgpu => Device::wgpu(burn::tensor::DeviceKind::DefaultDevice),
        #[cfg(feature = "cuda")]
        Backend::Cuda => Device::cuda(burn::tensor::DeviceIndex::Default),
    }
}

/// Tokens of one shape with all data that do not depend on the weights.
pub struct PreparedTokens(ShapeInput);

impl Model {
    /// A network with initial weights, which depend only on `config` and `seed`.
    ///
    /// # Errors
    /// If the config contains a size that no network can have.
    pub fn init(config: &NetConfig, seed: u64, backend: Backend) -> Result<Self, ConfigError> {
        Self::new(
            config,
            &Initializer::seeded(seed, &device_of(backend)),
            backend,
        )
    }

    /// The same network before it has weights: zeros that [`Model::with_values`] replaces.
    pub(crate) fn blank(config: &NetConfig, backend: Backend) -> Result<Self, ConfigError> {
        Self::new(config, &Initializer::zeros(&device_of(backend)), backend)
    }

    fn new(config: &NetConfig, init: &Initializer, backend: Backend) -> Result<Self, ConfigError> {
        config.check()?;
        Ok(Self {
            config: config.clone(),
            backend,
            network: Network::new(config, init),
        })
    }

    /// The settings of the network.
    #[must_use]
    pub fn config(&self) -> &NetConfig {
        &self.config
    }

    /// The number of parameters of the network of a config.
    ///
    /// # Errors
    /// If the config contains a size that no network can have.
    pub fn count_parameters(config: &NetConfig) -> Result<ParameterCount, ConfigError> {
        let blank = Self::blank(config, Backend::default())?;
        Ok(ParameterCount {
            backbone: blank.n_parameters(),
            head: blank.n_head_parameters(),
        })
    }

    /// The names of the sections of a network that `train.freeze` accepts, without `backbone`.
    ///
    /// # Errors
    /// If the config contains a size that no network can have.
    pub fn part_names(config: &NetConfig) -> Result<Vec<String>, ConfigError> {
        let blank = Self::blank(config, Backend::default())?;
        let mut names = std::collections::BTreeSet::new();
        for shape in parameters::shapes(&blank.network) {
            let name = shape.name.strip_prefix("backbone.").unwrap_or(&shape.name);
            let ends = name.match_indices('.').map(|(end, _)| end);
            names.extend(ends.map(|end| name[..end].to_owned()));
            names.insert(name.to_owned());
        }
        Ok(names.into_iter().collect())
    }

    /// The number of parameters of the backbone, without the head.
    #[must_use]
    pub fn n_parameters(&self) -> usize {
        let learned = parameters::shapes(&self.network)
            .into_iter()
            .filter(|shape| !shape.is_statistic());
        learned.map(|shape| shape.len()).sum::<usize>() - self.n_head_parameters()
    }

    /// The number of parameters of the embedding head.
    #[must_use]
    pub fn n_head_parameters(&self) -> usize {
        self.network.n_head_parameters()
    }

    /// One unit embedding per token. The order of serialization is fixed, and the computation uses one thread.
    ///
    /// # Errors
    /// If no thread can be started, or the weights make numbers that are not finite.
    pub fn embed(&self, tokens: &Tokens) -> Result<Embeddings, EmbedError> {
        self.embed_prepared(&self.prepare(tokens))
    }

    /// The tables of neighbors and patches that the network uses at test time.
    #[must_use]
    pub fn prepare(&self, tokens: &Tokens) -> PreparedTokens {
        let backbone = &self.config.backbone;
        PreparedTokens(backbone.prepare(tokens, &backbone.test_orders()))
    }

    /// The result of [`Model::embed`], for tokens that [`Model::prepare`] of this model has prepared.
    ///
    /// # Errors
    /// If no thread can be started, or the weights make numbers that are not finite.
    pub fn embed_prepared(&self, tokens: &PreparedTokens) -> Result<Embeddings, EmbedError> {
        let raw = on_one_thread(|| self.forward(&tokens.0))?;
        let unit = unit_rows(raw, self.config.embedding_dim);
        if unit.iter().any(|x| !x.is_finite()) {
            return Err(EmbedError::NotFinite);
        }
        Embeddings::new(self.config.embedding_dim, unit).map_err(|_| EmbedError::NotFinite)
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
        Self {
            network: parameters::with_values(self.network, values),
            ..self
        }
    }

    fn forward(&self, input: &ShapeInput) -> Vec<f32> {
        parameters::host_values(self.network.forward(
            &[input],
            &device_of(self.backend),
            &mut ForwardMode::Test,
        ))
    }
}

/// Divides each row by its length.
fn unit_rows(mut values: Vec<f32>, dim: usize) -> Vec<f32> {
    for row in values.chunks_exact_mut(dim) {
        let norm = row
            .iter()
            .map(|&x| f64::from(x).powi(2))
            .sum::<f64>()
            .sqrt()
            .max(1e-12);
        row.iter_mut()
            .for_each(|x| *x = (f64::from(*x) / norm) as f32);
    }
    values
}

#[cfg(test)]
mod tests {
    use super::weights::WeightsError;
    use super::*;
    use crate::config::Voxels;
    use crate::data::curve::Curve;
    use crate::data::tokens::tokenize;
    use crate::model::backbones::{
        BackboneConfig, LiteptConfig, LiteptPreset, PointnetConfig, Preset, Ptv3Config, PtxConfig,
        Stages,
    };
    use crate::model::layers::NormKind;
    use crate::testing::{labeled_box, net, net_with};

    fn pointnet() -> NetConfig {
        NetConfig {
            backbone: BackboneConfig::Pointnet(PointnetConfig {
                widths: vec![16, 24],
            }),
            embedding_dim: 8,
            refine: None,
        }
    }

    fn tokens() -> Tokens {
        tokenize(&labeled_box(2.0, 900).sample, 60, Voxels::NormalKeyed).unwrap()
    }

    /// The sum of the blocks (40C² + 17C each), the pools and unpools with their norms, and the 5³ stem.
    fn parameters_by_formula(stages: &Stages) -> usize {
        let blocks = |depths: &[usize], widths: &[usize]| {
            depths
                .iter()
                .zip(widths)
                .map(|(depth, width)| depth * (40 * width * width + 17 * width))
                .sum::<usize>()
        };
        let projection = |from: usize, to: usize| from * to + 3 * to;
        let widths = &stages.encoder_widths;
        let pools: usize = widths
            .windows(2)
            .map(|pair| projection(pair[0], pair[1]))
            .sum();
        let below = stages.decoder_widths[1..].iter().chain(widths.last());
        let unpools: usize = stages
            .decoder_widths
            .iter()
            .zip(below.zip(widths))
            .map(|(&to, (&below, &skip))| projection(below, to) + projection(skip, to))
            .sum();
        let stem = 125 * 6 * widths[0] + 2 * widths[0];
        let decoder = blocks(&stages.decoder_depths, &stages.decoder_widths);
        blocks(&stages.encoder_depths, widths) + pools + decoder + unpools + stem
    }

    #[test]
    fn presets_have_their_parameters_with_either_norm() {
        let counts = [524_160, 2_389_280, 5_790_496, 46_166_272];
        for (preset, expected) in Preset::ALL.into_iter().zip(counts) {
            assert_eq!(parameters_by_formula(&preset.stages()), expected);
            for norm in [NormKind::Layer, NormKind::Batch] {
                let config = net_with(|ptv3| (ptv3.preset, ptv3.norm) = (preset, norm));
                let count = Model::count_parameters(&NetConfig {
                    embedding_dim: 128,
                    ..config
                })
                .unwrap();
                assert_eq!(count.backbone, expected, "{preset:?} {norm:?}");
                assert_eq!(count.head, preset.stages().output_width() * 128 + 128);
            }
        }
    }

    /// The parameters of a backbone below its head.
    fn n_parameters(backbone: BackboneConfig) -> usize {
        let config = NetConfig {
            backbone,
            embedding_dim: 128,
            refine: None,
        };
        Model::count_parameters(&config).unwrap().backbone
    }

    #[test]
    fn litept_and_ptx_are_as_large_as_published() {
        let litept = |preset| {
            n_parameters(BackboneConfig::Litept(LiteptConfig {
                preset,
                ..LiteptConfig::default()
            }))
        };
        // The paper says 12.7 million.
        assert_eq!(litept(LiteptPreset::Small), 12_712_932);
        // 79.2 % less than PTv3, whose paper says 46.2 million.
        let ptx = n_parameters(BackboneConfig::Ptx(PtxConfig {
            preset: Preset::Base,
            ..PtxConfig::default()
        }));
        assert_eq!(ptx, 9_616_264);
    }

    #[test]
    fn attention_depends_on_the_positions_of_tokens() {
        let backbones = [
            BackboneConfig::Litept(LiteptConfig::default()),
            BackboneConfig::Ptx(PtxConfig::default()),
        ];
        for backbone in backbones {
            let config = NetConfig {
                backbone,
                embedding_dim: 8,
                refine: None,
            };
            let model = Model::init(&config, 1, Backend::Flex).unwrap();
            let here = tokens();
            let mut moved = here.clone();
            for cell in &mut moved.cells {
                // Cells that are twice as far apart have other neighborhoods but the same features.
                *cell = cell.map(|x| 2 * x);
            }
            assert_ne!(model.embed(&moved).unwrap(), model.embed(&here).unwrap());
        }
    }

    #[test]
    fn what_is_switched_off_has_no_parameters_and_changes_the_output() {
        let whole = Model::init(&net(), 1, Backend::Flex).unwrap();
        let embeddings = whole.embed(&tokens()).unwrap();
        let widths = [32, 48, 64, 48, 48];
        let xcpe: usize = widths
            .iter()
            .map(|width| 28 * width * width + 4 * width)
            .sum();
        let attention: usize = widths
            .iter()
            .map(|width| 4 * width * width + 6 * width)
            .sum();
        type Change = fn(&mut Ptv3Config);
        let cases: [(usize, Change); 5] = [
            (xcpe, |ptv3| ptv3.xcpe = false),
            (attention, |ptv3| ptv3.attention = false),
            (0, |ptv3| ptv3.orders = vec![Curve::Hilbert]),
            (0, |ptv3| ptv3.patch = 8),
            (0, |ptv3| ptv3.xcpe_of_skip = true),
        ];
        for (less, change) in cases {
            let model = Model::init(&net_with(change), 1, Backend::Flex).unwrap();
            assert_eq!(whole.n_parameters() - model.n_parameters(), less);
            assert_ne!(model.embed(&tokens()).unwrap(), embeddings);
        }
    }

    #[test]
    fn cell_exchange_adds_a_layer_to_each_block() {
        let plain = Model::init(&net(), 1, Backend::Flex).unwrap();
        let config = net_with(|ptv3| ptv3.cell_exchange = true);
        let model = Model::init(&config, 1, Backend::Flex).unwrap();

        let per_block = |width: usize| width * width + 3 * width;
        let expected: usize = [32, 48, 64, 48, 48].map(per_block).iter().sum();
        assert_eq!(model.n_parameters() - plain.n_parameters(), expected);
        assert_ne!(
            model.embed(&tokens()).unwrap(),
            plain.embed(&tokens()).unwrap()
        );
    }

    #[test]
    fn embeddings_are_one_unit_row_per_token() {
        for config in [net(), pointnet()] {
            let model = Model::init(&config, 1, Backend::Flex).unwrap();
            let embeddings = model.embed(&tokens()).unwrap();
            assert_eq!(
                (embeddings.n_rows(), embeddings.dim()),
                (tokens().n(), config.embedding_dim)
            );
            for row in embeddings.rows() {
                assert!((row.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn permuting_the_points_permutes_the_embeddings() {
        let sample = labeled_box(2.0, 900).sample;
        let mut turned = sample.clone();
        turned.points.rotate_left(123);
        turned.normals.rotate_left(123);
        let model = Model::init(&net(), 1, Backend::Flex).unwrap();
        let of_points = |sample| {
            let tokens = tokenize(sample, 60, Voxels::NormalKeyed).unwrap();
            let embeddings = model.embed(&tokens).unwrap();
            tokens
                .token_of_point
                .iter()
                .map(|&token| embeddings.row(token as usize).to_vec())
                .collect::<Vec<_>>()
        };
        let mut back = of_points(&turned);
        back.rotate_right(123);
        for (a, b) in of_points(&sample)
            .iter()
            .flatten()
            .zip(back.iter().flatten())
        {
            assert!((a - b).abs() < 1e-4);
        }
    }

    #[test]
    fn weights_and_statistics_round_trip() {
        let config = net_with(|ptv3| ptv3.norm = NormKind::Batch);
        let model = Model::init(&config, 7, Backend::Flex).unwrap();
        let names: Vec<String> = parameters::shapes(model.network())
            .into_iter()
            .map(|shape| shape.name)
            .collect();
        for name in [
            "backbone.stem.norm.running_mean",
            "backbone.encoder.2.blocks.0.attention.qkv.weight",
            "head.bias",
        ] {
            assert!(
                names.iter().any(|found| found == name),
                "no {name} in {names:?}"
            );
        }
        let moved: Vec<f32> = model.values().iter().map(|value| value + 0.25).collect();
        let bytes = model.with_values(&moved).to_safetensors().unwrap();
        assert_eq!(
            Model::from_safetensors(&config, &bytes, Backend::Flex)
                .unwrap()
                .values(),
            moved
        );
    }

    #[test]
    fn weights_round_trip_and_foreign_bytes_are_refused() {
        let model = Model::init(&net(), 7, Backend::Flex).unwrap();
        let bytes = model.to_safetensors().unwrap();
        let read = |config: &NetConfig, bytes: &[u8]| {
            Model::from_safetensors(config, bytes, Backend::Flex)
        };
        let back = read(&net(), &bytes).unwrap();
        assert_eq!(back.values(), model.values());
        assert_eq!(back.to_safetensors().unwrap(), bytes);
        assert!(matches!(
            read(&pointnet(), &bytes),
            Err(WeightsError::OtherNetwork(_))
        ));
        assert!(matches!(
            read(&net(), &bytes[..bytes.len() / 2]),
            Err(WeightsError::Format(_))
        ));
        assert!(matches!(
            read(&net(), b"solid"),
            Err(WeightsError::Format(_))
        ));
    }

    #[test]
    fn seeds_give_different_weights_and_one_seed_the_same() {
        let values = |seed| Model::init(&net(), seed, Backend::Flex).unwrap().values();
        assert_eq!(values(3), values(3));
        assert_ne!(values(3), values(4));
    }

    #[test]
    fn a_single_token_has_an_embedding() {
        let one = partprobe_carrier::PointSample {
            points: vec![[1.0; 3]; 4],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            triangles: vec![0; 4],
        };
        for config in [net(), pointnet()] {
            let model = Model::init(&config, 1, Backend::Flex).unwrap();
            assert_eq!(
                model
                    .embed(&tokenize(&one, 60, Voxels::NormalKeyed).unwrap())
                    .unwrap()
                    .n_rows(),
                1
            );
        }
    }
}
