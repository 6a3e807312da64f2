//! Lists the trunks: networks from a position to a signed distance.

use super::activation::Activation;
use super::layout::Layout;
use std::fmt;
use std::str::FromStr;

/// A multilayer perceptron from three coordinates to one distance, with one input layer, four hidden layers and a linear
/// output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trunk {
    /// Sines with frequency 30 (SIREN), 256 neurons per layer: the size of FlatCAD.
    Siren256x4,
    /// Sines, 128 neurons per layer: the default.
    Siren128x4,
    /// Sines, 64 neurons per layer: for tests and quick looks.
    Siren64x4,
    /// Softplus with β = 100, 128 neurons per layer. Its initial surface is a sphere.
    Softplus128x4,
}

/// A name that no trunk has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a trunk; choose one of {known}", known = known_names())]
pub struct UnknownTrunk(pub String);

fn known_names() -> String {
    Trunk::ALL.map(Trunk::name).join(", ")
}

impl Trunk {
    /// All trunks.
    pub const ALL: [Self; 4] = [
        Self::Siren256x4,
        Self::Siren128x4,
        Self::Siren64x4,
        Self::Softplus128x4,
    ];

    /// Its name in configs and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Siren256x4 => "siren-256x4",
            Self::Siren128x4 => "siren-128x4",
            Self::Siren64x4 => "siren-64x4",
            Self::Softplus128x4 => "softplus100-128x4",
        }
    }

    /// The number of neurons of each layer.
    #[must_use]
    pub fn width(self) -> usize {
        match self {
            Self::Siren256x4 => 256,
            Self::Siren128x4 | Self::Softplus128x4 => 128,
            Self::Siren64x4 => 64,
        }
    }

    /// The number of weights and biases, without the segmentation head.
    #[must_use]
    pub fn n_parameters(self) -> usize {
        Layout::new(self.width(), 0).n_trunk_parameters()
    }

    pub(crate) fn activation(self) -> Activation {
        match self {
            Self::Siren256x4 | Self::Siren128x4 | Self::Siren64x4 => Activation::Sine,
            Self::Softplus128x4 => Activation::Softplus,
        }
    }
}

impl fmt::Display for Trunk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Trunk {
    type Err = UnknownTrunk;

    fn from_str(name: &str) -> Result<Self, UnknownTrunk> {
        let found = Self::ALL.into_iter().find(|trunk| trunk.name() == name);
        found.ok_or_else(|| UnknownTrunk(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trunks_have_the_number_of_parameters_of_their_sizes() {
        for (name, expected) in [
            ("siren-256x4", 264_449),
            ("siren-128x4", 66_689),
            ("siren-64x4", 16_961),
            ("softplus100-128x4", 66_689),
        ] {
            let trunk: Trunk = name.parse().unwrap();
            assert_eq!((trunk.name(), trunk.n_parameters()), (name, expected));
        }
        let message = "siren".parse::<Trunk>().unwrap_err().to_string();
        assert!(message.contains("siren-128x4"), "{message}");
    }
}
