//! Defines the position of each weight in the vector of all parameters.

use crate::kernels::LANES;
use std::ops::Range;

/// Layers with an activation: one from the position, and four hidden ones.
pub(crate) const LAYERS: usize = 5;

/// Neurons of the head's hidden layer.
pub(crate) const HEAD_WIDTH: usize = 64;

/// The order of the parameters: for each layer its weights `[in, out]` and biases, then the output's weights and bias, and then
/// the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    pub(crate) width: usize,
    /// The number of labels of the head, or 0 without a head.
    pub(crate) n_labels: usize,
}

impl Layout {
    pub(crate) fn new(width: usize, n_labels: usize) -> Self {
        Self { width, n_labels }
    }

    /// The number of inputs of a layer.
    pub(crate) fn depth(&self, layer: usize) -> usize {
        if layer == 0 { 3 } else { self.width }
    }

    pub(crate) fn weights(&self, layer: usize) -> Range<usize> {
        let before = match layer {
            0 => 0,
            _ => 4 * self.width + (layer - 1) * (self.width + 1) * self.width,
        };
        before..before + self.depth(layer) * self.width
    }

    pub(crate) fn biases(&self, layer: usize) -> Range<usize> {
        following(self.weights(layer), self.width)
    }

    pub(crate) fn output_weights(&self) -> Range<usize> {
        following(self.biases(LAYERS - 1), self.width)
    }

    pub(crate) fn output_bias(&self) -> usize {
        self.output_weights().end
    }

    pub(crate) fn n_trunk_parameters(&self) -> usize {
        self.output_bias() + 1
    }

    /// The number of columns of the head's output: the labels, padded to whole lanes with unused columns.
    pub(crate) fn label_columns(&self) -> usize {
        self.n_labels.next_multiple_of(LANES)
    }

    pub(crate) fn head_weights(&self) -> Range<usize> {
        let first = self.n_trunk_parameters();
        first..first + self.width * HEAD_WIDTH
    }

    pub(crate) fn head_biases(&self) -> Range<usize> {
        following(self.head_weights(), HEAD_WIDTH)
    }

    pub(crate) fn label_weights(&self) -> Range<usize> {
        following(self.head_biases(), HEAD_WIDTH * self.label_columns())
    }

    pub(crate) fn label_biases(&self) -> Range<usize> {
        following(self.label_weights(), self.label_columns())
    }

    pub(crate) fn n_parameters(&self) -> usize {
        match self.n_labels {
            0 => self.n_trunk_parameters(),
            _ => self.label_biases().end,
        }
    }
}

fn following(range: Range<usize>, length: usize) -> Range<usize> {
    range.end..range.end + length
}
