//! Backbones and how they learn: `PointSample → Tokens → Embeddings`, and shapes with labels → a trained [`Model`].
//!
//! Nothing here opens a file, prints or asks the clock, and no type of the tensor library shows in the interface.
//! The same shapes, settings and seed give the same bytes for any number of threads: tensor operations run in pools
//! of one thread, parallelism is over shapes, and sums go in the order of the shapes.

mod augment;
mod backbones;
mod batch_norm;
mod checkpoint;
mod config;
mod curve;
mod forward_mode;
mod fused;
mod hierarchy;
mod layers;
mod level_rows;
mod loss;
mod model;
mod neighbors;
mod network;
mod one_thread;
mod ops;
mod optimizer;
mod pairs;
mod parameters;
mod parity;
#[cfg(test)]
mod planted;
mod shape_order;
mod tokens;
mod trained_on;
mod training;
mod weights;

pub use backbones::{BackboneConfig, PointnetConfig, Preset, Ptv3Config, Stages};
pub use checkpoint::ResumeError;
pub use config::{
    AugmentConfig, Backend, ConfigError, Hinge, LossConfig, LossWeight, NetConfig, NoDefect,
    OptimConfig, ScheduleConfig, TokenConfig, TrainConfig, TrainSettings,
};
pub use curve::Curve;
pub use layers::NormKind;
pub use loss::LossTerms;
pub use model::{EmbedError, Model, ParameterCount, PreparedTokens};
pub use one_thread::ThreadError;
pub use parity::{ParityError, tokens_file};
pub use tokens::{TokenizeError, Tokens, Voxels, tokenize};
pub use trained_on::{ShapeKeys, TrainedOn};
pub use training::{
    Batches, Fault, Faulty, Gradient, LoadedShape, Loading, Observer, StepReport, TrainError,
    TrainShape, Training, fit,
};
pub use weights::{ModelFile, WeightsError};
