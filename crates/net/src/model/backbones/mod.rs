//! Lists the backbones, once.
//!
//! A backbone turns the tokens of a shape into one row of features per token. To add one, write a file here with `impl Backbone`,
//! and add its `mod` line and one line to the list below. The config table `[net.backbone]`, the network and its inputs are
//! generated from the list. No other code names a backbone.

pub(crate) mod backbone;
mod dispatch;
mod leveled_tokens;
mod litept;
mod pointnet;
pub(crate) mod ptv3;
mod ptx;
mod rotary_attention;
mod serialization;
mod stages;
pub(crate) mod stem;
pub(crate) mod u_net;

pub(crate) use backbone::features;
pub use litept::LiteptPreset;
pub use ptv3::Preset;
pub use serialization::{SerializedConfig, SizePreset};
pub use stages::Stages;

use crate::config::ConfigError;
use crate::data::hierarchy::CurveOrders;
use crate::data::tokens::Tokens;
use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::Initializer;
use backbone::{Backbone, BackboneSettings};
use burn::module::Module;
use burn::tensor::{Device, Tensor};
use dispatch::backbones;
use partprobe_carrier::Rng;

// The `type` in a config, the module, the network and its settings.
backbones! {
    /// Point Transformer V3.
    "ptv3": ptv3::{Ptv3, Ptv3Config};
    /// LitePT: convolutions on the fine levels, attention with rotary positions on the coarse ones.
    "litept": litept::{Litept, LiteptConfig};
    /// PointTransformerX: no convolution, attention with rotary positions on learned axes.
    "ptx": ptx::{Ptx, PtxConfig};
    /// A shared perceptron with one global maximum: the baseline without neighborhoods.
    "pointnet": pointnet::{Pointnet, PointnetConfig};
}
