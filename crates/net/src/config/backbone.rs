//! The settings of a network: which backbone, how large, and which of its pieces are there.

use super::{ConfigError, ensure};
use crate::curve::Curve;
use serde::{Deserialize, Serialize};

/// A backbone and the embedding head above it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NetConfig {
    /// The network that gives each token its features.
    pub backbone: BackboneConfig,
    /// Length of an embedding (paper: 128).
    pub embedding_dim: usize,
}

/// The choice of a backbone; in TOML a table with the key `type`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "type", rename_all = "kebab-case", deny_unknown_fields)]
pub enum BackboneConfig {
    /// Point Transformer V3.
    Ptv3(Ptv3Config),
    /// A shared perceptron with one global maximum: the baseline without neighborhoods.
    Pointnet {
        /// Widths of the layers before the maximum; the last one is the length of the global feature.
        widths: Vec<usize>,
    },
}

/// Point Transformer V3: its size, and the switches that an ablation turns.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Ptv3Config {
    /// Depths and widths of the stages.
    pub preset: Preset,
    /// Tokens in a patch of the serialized attention.
    pub patch: usize,
    /// The norm of stem, pooling and unpooling; blocks always have LayerNorm.
    pub norm: NormKind,
    /// Highest probability with which training leaves out a branch of a block, drawn for each point.
    pub drop_path: f64,
    /// Whether blocks have xCPE, the convolution that tells neighboring tokens of each other.
    pub xcpe: bool,
    /// Whether blocks have attention.
    pub attention: bool,
    /// The curves that serialize a shape, in the order in which the blocks of a stage take turns.
    pub orders: Vec<Curve>,
    /// Whether training shuffles the curves on each level, anew for each shape and step.
    pub shuffle_orders: bool,
}

/// The named sizes of PTv3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Three stages, half a million parameters: trains on a CPU.
    Micro,
    /// Four stages, 2.4 million parameters.
    Tiny,
    /// Five stages, 5.8 million parameters.
    Mini,
    /// PTv3 as published: five stages, 46 million parameters.
    Base,
}

impl Preset {
    /// Every preset, from the smallest up.
    pub const ALL: [Self; 4] = [Self::Micro, Self::Tiny, Self::Mini, Self::Base];

    /// The name that a config file uses.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Micro => "micro",
            Self::Tiny => "tiny",
            Self::Mini => "mini",
            Self::Base => "base",
        }
    }
}

/// What brings channels to one scale where PTv3 has BatchNorm: in the stem, in pooling and in unpooling.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NormKind {
    /// LayerNorm: each token by itself, so that no shape depends on the others of its batch.
    Layer,
    /// BatchNorm as PTv3 has it: in training over all tokens of the batch, at test time by running statistics.
    Batch,
}

impl NetConfig {
    /// Refuses sizes that no network can have.
    ///
    /// # Errors
    /// If a size is 0 or a patch holds no more than one token.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure(
            (1..=4096).contains(&self.embedding_dim),
            "net.embedding_dim",
            "must lie in 1..=4096",
        )?;
        match &self.backbone {
            BackboneConfig::Ptv3(config) => config.check(),
            BackboneConfig::Pointnet { widths } => ensure(
                !widths.is_empty() && widths.iter().all(|width| (1..=4096).contains(width)),
                "net.backbone.widths",
                "must hold at least one width, each in 1..=4096",
            ),
        }
    }

    /// Whether the shapes of a batch must go through the network together.
    #[must_use]
    pub fn runs_batch_as_one(&self) -> bool {
        matches!(
            &self.backbone,
            BackboneConfig::Ptv3(Ptv3Config {
                norm: NormKind::Batch,
                ..
            })
        )
    }
}

impl Ptv3Config {
    fn check(&self) -> Result<(), ConfigError> {
        ensure(
            (2..=65_536).contains(&self.patch),
            "net.backbone.patch",
            "must lie in 2..=65536",
        )?;
        ensure(
            (0.0..1.0).contains(&self.drop_path),
            "net.backbone.drop_path",
            "must lie in 0..1",
        )?;
        let is_new = |(idx, curve)| !self.orders[..idx].contains(curve);
        ensure(
            !self.orders.is_empty() && self.orders.iter().enumerate().all(is_new),
            "net.backbone.orders",
            "must name at least one of z, z-trans, hilbert, hilbert-trans, each once",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planted::ptv3;

    #[track_caller]
    fn check(backbone: BackboneConfig, embedding_dim: usize, key: Option<&str>) {
        assert_eq!(
            NetConfig {
                backbone,
                embedding_dim
            }
            .check()
            .err()
            .map(|error| error.key),
            key
        );
    }

    #[test]
    fn sizes_of_nothing_are_refused() {
        let with = |change: fn(&mut Ptv3Config)| {
            let mut config = ptv3();
            change(&mut config);
            BackboneConfig::Ptv3(config)
        };
        check(with(|_| ()), 128, None);
        check(with(|_| ()), 0, Some("net.embedding_dim"));
        check(
            with(|config| config.patch = 1),
            128,
            Some("net.backbone.patch"),
        );
        check(
            with(|config| config.drop_path = 1.0),
            128,
            Some("net.backbone.drop_path"),
        );
        check(
            with(|config| config.drop_path = f64::NAN),
            128,
            Some("net.backbone.drop_path"),
        );
        check(
            with(|config| config.orders.clear()),
            128,
            Some("net.backbone.orders"),
        );
        check(
            with(|config| config.orders = vec![Curve::Z; 2]),
            128,
            Some("net.backbone.orders"),
        );
        check(
            BackboneConfig::Pointnet { widths: vec![] },
            128,
            Some("net.backbone.widths"),
        );
    }

    #[test]
    fn a_config_file_names_what_it_means() {
        let text = r#"{"type":"ptv3","preset":"mini","patch":48,"norm":"batch","drop_path":0.3,"xcpe":false,
            "attention":true,"orders":["hilbert-trans","z"],"shuffle_orders":false}"#;
        let config = Ptv3Config {
            preset: Preset::Mini,
            patch: 48,
            norm: NormKind::Batch,
            drop_path: 0.3,
            xcpe: false,
            attention: true,
            orders: vec![Curve::HilbertTrans, Curve::Z],
            shuffle_orders: false,
        };
        assert_eq!(
            serde_json::from_str::<BackboneConfig>(text).unwrap(),
            BackboneConfig::Ptv3(config)
        );
        let misspelt = text.replace("xcpe", "xcep");
        assert!(
            serde_json::from_str::<BackboneConfig>(&misspelt)
                .unwrap_err()
                .to_string()
                .contains("xcep")
        );
        for preset in Preset::ALL {
            assert_eq!(serde_json::to_value(preset).unwrap(), preset.name());
        }
    }
}
