//! Trains point-cloud backbones, and embeds points with them.
//!
//! [`tokenize`] groups the points of a shape into tokens. A [`Model`] turns tokens into embeddings. [`fit()`] trains a model
//! on shapes with labels.
//!
//! ```
//! use partprobe_carrier::PointSample;
//! use partprobe_net::{Backend, BackboneConfig, Model, NetConfig, PointnetConfig, Voxels, tokenize};
//!
//! // 400 points of a square, with their normals.
//! let mut sample = PointSample::default();
//! for idx in 0..400 {
//!     sample.points.push([(idx % 20) as f32, (idx / 20) as f32, 0.0]);
//!     sample.normals.push([0.0, 0.0, 1.0]);
//! }
//! let tokens = tokenize(&sample, 64, Voxels::NormalKeyed)?;
//!
//! let config = NetConfig {
//!     backbone: BackboneConfig::Pointnet(PointnetConfig { widths: vec![16, 32] }),
//!     embedding_dim: 8,
//!     refine: None,
//! };
//! let model = Model::init(&config, 0, Backend::Flex)?;
//! let embeddings = model.embed(&tokens)?;
//! assert_eq!(embeddings.n_rows(), tokens.n());
//! assert_eq!(embeddings.dim(), 8);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The example `train_tiny` trains a backbone on generated parts.
//!
//! # What it guarantees
//!
//! - The same shapes, settings and seed give the same bytes for any number of threads: tensor operations run in pools of
//!   one thread, threads work on different shapes, and sums are in the order of the shapes.
//! - A training that was stopped continues from its checkpoint to the same bytes.
//! - A loss or gradient that is not finite ends the training with the shape and the update that made it.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing and does not read the clock. No type of the tensor library is part of the interface.

mod config;
mod data;
mod kernels;
mod model;
mod parity;
mod pointcept;
#[cfg(test)]
mod testing;
mod training;

pub use config::{
    AugmentConfig, Backend, ConfigError, Hinge, LossConfig, LossWeight, NoFault, OptimConfig, Pull,
    ScheduleConfig, TokenConfig, TrainConfig, TrainSettings, TrainTokens, Voxels,
};
pub use data::curve::Curve;
pub use data::tokens::{TokenizeError, Tokens, tokenize};
pub use kernels::one_thread::ThreadError;
pub use model::backbones::{
    BackboneConfig, LiteptConfig, LiteptPreset, PointnetConfig, Preset, Ptv3Config, PtxConfig,
    SerializedConfig, SizePreset, Stages,
};
pub use model::layers::NormKind;
pub use model::net_config::NetConfig;
pub use model::poses::EmbedSampleError;
pub use model::refine::{RefineConfig, RefineError};
pub use model::trained_on::{InitialWeights, ShapeKeys, TrainedOn};
pub use model::weights::{ModelFile, WeightsError};
pub use model::{EmbedError, Model, ParameterCount, PreparedTokens};
pub use parity::{ParityError, tokens_file};
pub use pointcept::{
    FromPointcept, PointceptError, PointceptState, from_pointcept, pointcept_backbone, to_pointcept,
};
pub use training::checkpoint::ResumeError;
pub use training::loss::LossTerms;
pub use training::{
    Batches, Fault, FaultInjection, Gradient, LoadedShape, Loading, MemoryBatches, Observer,
    StepReport, TrainError, TrainShape, Training, fit,
};
