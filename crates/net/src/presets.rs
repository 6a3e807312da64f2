//! Depths and widths of the named sizes of PTv3.

use crate::config::Preset;

/// Depths and widths of the stages of a PTv3.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stages {
    /// Blocks of each stage of the encoder, from the finest one up.
    pub encoder_depths: Vec<usize>,
    /// Channels of each stage of the encoder.
    pub encoder_widths: Vec<usize>,
    /// Blocks of each stage of the decoder, from the finest one up; one stage fewer than the encoder has.
    pub decoder_depths: Vec<usize>,
    /// Channels of each stage of the decoder.
    pub decoder_widths: Vec<usize>,
}

impl Stages {
    /// The stages of a preset; `base` is PTv3 as published.
    #[must_use]
    pub fn of(preset: Preset) -> Self {
        let new = |encoder: &[(usize, usize)], decoder: &[(usize, usize)]| {
            let (encoder_depths, encoder_widths) = encoder.iter().copied().unzip();
            let (decoder_depths, decoder_widths) = decoder.iter().copied().unzip();
            Self {
                encoder_depths,
                encoder_widths,
                decoder_depths,
                decoder_widths,
            }
        };
        match preset {
            Preset::Micro => new(&[(1, 32), (1, 48), (1, 64)], &[(1, 48), (1, 48)]),
            Preset::Tiny => new(
                &[(1, 32), (1, 64), (2, 96), (1, 128)],
                &[(1, 64), (1, 64), (1, 96)],
            ),
            Preset::Mini => new(
                &[(1, 32), (1, 48), (1, 96), (2, 160), (1, 192)],
                &[(1, 48), (1, 48), (1, 96), (1, 160)],
            ),
            Preset::Base => new(
                &[(2, 32), (2, 64), (2, 128), (6, 256), (2, 512)],
                &[(2, 64), (2, 64), (2, 128), (2, 256)],
            ),
        }
    }

    /// Levels of the hierarchy that the network walks through.
    #[must_use]
    pub fn n_levels(&self) -> usize {
        self.encoder_widths.len()
    }

    /// Width of the output.
    #[must_use]
    pub fn output_width(&self) -> usize {
        self.decoder_widths
            .first()
            .or(self.encoder_widths.last())
            .copied()
            .unwrap_or(0)
    }
}
