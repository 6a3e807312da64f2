//! Joins the tables of a config that belong to the network and its training: `[net]`, `[tokens]`, `[loss]`, `[optim]`,
//! `[augment]`.
//!
//! A program that is built without the feature `train` accepts these tables, because a config has all of them, but does not read
//! them.

#[cfg(feature = "train")]
pub(crate) use partprobe_net::{
    AugmentConfig, LossConfig, NetConfig, NoFault, OptimConfig, TokenConfig, Voxels,
};

#[cfg(not(feature = "train"))]
pub(crate) use without_training::{
    AugmentConfig, LossConfig, NetConfig, NoFault, OptimConfig, TokenConfig, Voxels,
};

#[cfg(not(feature = "train"))]
mod without_training {
    use serde::{Deserialize, Serialize};
    use std::convert::Infallible;

    /// A table that this program cannot use.
    #[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
    #[serde(transparent)]
    pub(crate) struct Unused(toml::Value);

    /// The network.
    pub(crate) type NetConfig = Unused;
    /// The sizes of the token sets.
    pub(crate) type TokenConfig = Unused;
    /// The objective.
    pub(crate) type LossConfig = Unused;
    /// The optimizer.
    pub(crate) type OptimConfig = Unused;
    /// The augmentation.
    pub(crate) type AugmentConfig = Unused;
    /// The settings for tokens.
    pub(crate) type Voxels = Unused;
    /// A setting of earlier versions.
    pub(crate) type NoFault = Unused;

    impl Default for Unused {
        fn default() -> Self {
            Self(toml::Value::Table(toml::Table::new()))
        }
    }

    impl Unused {
        /// Accepts any value.
        pub(crate) fn check(&self) -> Result<(), Infallible> {
            Ok(())
        }
    }
}
