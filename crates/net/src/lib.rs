//! Backbones and how they learn: `PointSample → Tokens → Embeddings`, and shapes with labels → a trained [`Model`].
//!
//! Nothing here opens a file, prints or asks the clock, and no type of the tensor library shows in the interface.
//! The same shapes, settings and seed give the same bytes for any number of threads: tensor operations run in pools
//! of one thread, parallelism is over shapes, and sums go in the order of the shapes.

mod config;
mod data;
mod kernels;
mod model;
mod parity;
#[cfg(test)]
mod testing;
mod training;

pub use config::{
    AugmentConfig, Backend, ConfigError, Hinge, LossConfig, LossWeight, NoDefect, OptimConfig,
    ScheduleConfig, TokenConfig, TrainConfig, TrainSettings, Voxels,
};
pub use data::curve::Curve;
pub use data::tokens::{TokenizeError, Tokens, tokenize};
pub use kernels::one_thread::ThreadError;
pub use model::backbones::{BackboneConfig, PointnetConfig, Preset, Ptv3Config, Stages};
pub use model::layers::NormKind;
pub use model::net_config::NetConfig;
pub use model::trained_on::{ShapeKeys, TrainedOn};
pub use model::weights::{ModelFile, WeightsError};
pub use model::{EmbedError, Model, ParameterCount, PreparedTokens};
pub use parity::{ParityError, tokens_file};
pub use training::checkpoint::ResumeError;
pub use training::loss::LossTerms;
pub use training::{
    Batches, Fault, Faulty, Gradient, LoadedShape, Loading, Observer, StepReport, TrainError,
    TrainShape, Training, fit,
};
