//! Lists the named sizes of PTv3.

use crate::model::backbones::serialization::SizePreset;
use crate::model::backbones::stages::Stages;
use serde::{Deserialize, Serialize};

/// The named sizes of PTv3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Three stages, half a million parameters. It can be trained on a CPU.
    #[default]
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

    /// Depths and widths. `base` is PTv3 as published.
    #[must_use]
    pub fn stages(self) -> Stages {
        let new = |encoder: &[(usize, usize)], decoder: &[(usize, usize)]| {
            let (encoder_depths, encoder_widths) = encoder.iter().copied().unzip();
            let (decoder_depths, decoder_widths) = decoder.iter().copied().unzip();
            Stages {
                encoder_depths,
                encoder_widths,
                decoder_depths,
                decoder_widths,
            }
        };
        match self {
            Self::Micro => new(&[(1, 32), (1, 48), (1, 64)], &[(1, 48), (1, 48)]),
            Self::Tiny => new(
                &[(1, 32), (1, 64), (2, 96), (1, 128)],
                &[(1, 64), (1, 64), (1, 96)],
            ),
            Self::Mini => new(
                &[(1, 32), (1, 48), (1, 96), (2, 160), (1, 192)],
                &[(1, 48), (1, 48), (1, 96), (1, 160)],
            ),
            Self::Base => new(
                &[(2, 32), (2, 64), (2, 128), (6, 256), (2, 512)],
                &[(2, 64), (2, 64), (2, 128), (2, 256)],
            ),
        }
    }
}

impl SizePreset for Preset {
    const SIZES: &'static [Self] = &Self::ALL;

    fn size_name(self) -> &'static str {
        self.name()
    }

    fn size_stages(self) -> Stages {
        self.stages()
    }
}
