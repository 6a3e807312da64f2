//! Defines the settings of a network: its backbone, and the length of an embedding.

use super::backbones::{BackboneConfig, Ptv3Config};
use super::refine::RefineConfig;
use crate::config::{ConfigError, ensure};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;

/// A backbone and the embedding head above it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct NetConfig {
    /// The network that gives each token its features.
    pub backbone: BackboneConfig,
    /// Length of an embedding (paper: 128).
    pub embedding_dim: usize,
    /// The layer after the embedding head. It has no parameters and is not used in training. `None` gives the plain head of the
    /// paper. A file may write it as `"none"`.
    #[serde(
        default,
        deserialize_with = "refine_or_none",
        skip_serializing_if = "Option::is_none"
    )]
    pub refine: Option<RefineConfig>,
}

/// Reads the layer, or the word `none`: a config takes away the layer of its base by this word.
fn refine_or_none<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<RefineConfig>, D::Error> {
    deserializer.deserialize_any(RefineOrNone)
}

struct RefineOrNone;

impl<'de> Visitor<'de> for RefineOrNone {
    type Value = Option<RefineConfig>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table with the key `type`, or \"none\"")
    }

    fn visit_unit<E: de::Error>(self) -> Result<Self::Value, E> {
        Ok(None)
    }

    fn visit_str<E: de::Error>(self, word: &str) -> Result<Self::Value, E> {
        if word == "none" {
            Ok(None)
        } else {
            Err(E::invalid_value(de::Unexpected::Str(word), &self))
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        RefineConfig::deserialize(MapAccessDeserializer::new(map)).map(Some)
    }
}

impl Default for NetConfig {
    /// The smallest PTv3, with embeddings of 128 numbers.
    fn default() -> Self {
        Self {
            backbone: BackboneConfig::Ptv3(Ptv3Config::default()),
            embedding_dim: 128,
            refine: None,
        }
    }
}

impl NetConfig {
    /// Refuses sizes that no network can have.
    ///
    /// # Errors
    /// If a size is out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        ensure(
            (1..=4096).contains(&self.embedding_dim),
            "net.embedding_dim",
            "must be from 1 to 4096",
        )?;
        if let Some(refine) = &self.refine {
            refine.check()?;
        }
        self.backbone.check()
    }

    /// The same network with the plain head. The weights depend only on these settings.
    #[must_use]
    pub fn without_refine(&self) -> Self {
        Self {
            refine: None,
            ..self.clone()
        }
    }

    /// Whether the shapes of a batch must go through the network together.
    #[must_use]
    pub fn runs_batch_as_one(&self) -> bool {
        self.backbone.runs_batch_as_one()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::curve::Curve;
    use crate::model::backbones::{PointnetConfig, Ptv3Config};
    use crate::testing::ptv3;

    #[track_caller]
    fn check(backbone: BackboneConfig, embedding_dim: usize, key: Option<&str>) {
        assert_eq!(
            NetConfig {
                backbone,
                embedding_dim,
                refine: None
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
            BackboneConfig::Pointnet(PointnetConfig { widths: vec![] }),
            128,
            Some("net.backbone.widths"),
        );
    }
}
