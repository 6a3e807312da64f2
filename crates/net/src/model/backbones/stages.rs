//! Defines depths and widths of a backbone: the numbers that describe its size.

/// Depths and widths of the stages of a backbone.
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
    /// Stages of the encoder; a hierarchical backbone has one level of tokens for each of them.
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
