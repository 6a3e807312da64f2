//! Backbones and how they learn: `PointSample → Tokens → Embeddings`, and shapes with labels → a trained [`Model`].
//!
//! Nothing here opens a file, prints or asks the clock, and no type of the tensor library shows in the interface.
//! The same shapes, settings and seed give the same bytes for any number of threads: tensor operations run in pools
//! of one thread, parallelism is over shapes, and sums go in the order of the shapes.

mod augment;
mod checkpoint;
mod config;
mod curve;
mod fused;
mod hierarchy;
mod layers;
mod loss;
mod model;
mod neighbours;
mod network;
mod one_thread;
mod ops;
mod optimizer;
mod parameters;
#[cfg(test)]
mod planted;
mod pointnet;
mod ptv3;
mod shape_order;
mod tokens;
mod training;
mod weights;

pub use checkpoint::ResumeError;
pub use config::{
    AugmentConfig, BackboneConfig, Backend, ConfigError, Hinge, LossConfig, LossWeight, NetConfig, OptimConfig, Preset,
    Sabotage, ScheduleConfig, TokenConfig, TrainConfig, TrainSettings,
};
pub use loss::LossTerms;
pub use model::{EmbedError, Model};
pub use one_thread::ThreadError;
pub use tokens::{TokenizeError, Tokens, tokenize};
pub use training::{LoadedShape, Loading, StepReport, TrainError, TrainShape, Training, UnfinishedUpdate};
pub use weights::WeightsError;
