//! Defines depths and widths of a backbone: the numbers that describe its size.

/// Depths and widths of the stages of a backbone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stages {
    /// Number of blocks of each stage of the encoder, beginning with the finest stage.
    pub encoder_depths: Vec<usize>,
    /// Channels of each stage of the encoder.
    pub encoder_widths: Vec<usize>,
    /// Number of blocks of each stage of the decoder, beginning with the finest stage. The decoder has one stage fewer than the
    /// encoder.
    pub decoder_depths: Vec<usize>,
    /// Channels of each stage of the decoder.
    pub decoder_widths: Vec<usize>,
}

impl Stages {
    /// The number of stages of the encoder. A hierarchical backbone has one level of tokens per stage.
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
