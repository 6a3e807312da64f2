//! Defines the settings of PTv3: its size, and the switches for ablations.

use super::preset::Preset;
use crate::data::curve::Curve;
use crate::model::backbones::serialization::Serialization;
use crate::model::layers::NormKind;
use serde::{Deserialize, Serialize};

/// Point Transformer V3: its size, and the switches for ablations.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Ptv3Config {
    /// Depths and widths of the stages.
    pub preset: Preset,
    /// Tokens in a patch of the serialized attention.
    pub patch: usize,
    /// The norm of stem, pooling and unpooling; blocks always have LayerNorm.
    pub norm: NormKind,
    /// Highest probability with which training leaves out a branch of a block. It is drawn for each token.
    pub drop_path: f64,
    /// Whether blocks have xCPE, the convolution over neighboring tokens.
    pub xcpe: bool,
    /// Whether the first xCPE of a decoder stage sees only the skip, as in the published code of PTv3 (`PT-v3m1`), instead of the
    /// sum of the skip and the level above, as the other layers.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub xcpe_of_skip: bool,
    /// Whether blocks have a layer in which the tokens of one cell, whose normals have different dominant axes, exchange
    /// features. PTv3 has one token per cell and no such layer.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cell_exchange: bool,
    /// Whether blocks have attention.
    pub attention: bool,
    /// The curves that serialize a shape, in the order in which the blocks of a stage take turns.
    pub orders: Vec<Curve>,
    /// Whether training shuffles the curves on each level, independently for each shape and step.
    pub shuffle_orders: bool,
}

impl Default for Ptv3Config {
    /// The smallest preset, with all layers of PTv3.
    fn default() -> Self {
        Self {
            preset: Preset::Micro,
            patch: 128,
            norm: NormKind::Layer,
            drop_path: 0.0,
            xcpe: true,
            xcpe_of_skip: false,
            cell_exchange: false,
            attention: true,
            orders: Curve::ALL.to_vec(),
            shuffle_orders: true,
        }
    }
}

impl Ptv3Config {
    /// The settings that serialize shapes.
    pub(super) fn serialization(&self) -> Serialization<'_> {
        Serialization {
            n_levels: self.preset.stages().n_levels(),
            patch: self.patch,
            orders: &self.orders,
            shuffle_orders: self.shuffle_orders,
            drop_path: self.drop_path,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::backbones::BackboneConfig;

    #[test]
    fn a_config_file_names_what_it_means() {
        let text = r#"{"type":"ptv3","preset":"mini","patch":48,"norm":"batch","drop_path":0.3,"xcpe":false,
            "xcpe_of_skip":true,"cell_exchange":true,"attention":true,"orders":["hilbert-trans","z"],"shuffle_orders":false}"#;
        let config = Ptv3Config {
            preset: Preset::Mini,
            patch: 48,
            norm: NormKind::Batch,
            drop_path: 0.3,
            xcpe: false,
            xcpe_of_skip: true,
            cell_exchange: true,
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
