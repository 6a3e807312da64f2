//! Normalizes the features of a batch (Ioffe and Szegedy, 2015), with the constants of PTv3.
//!
//! It normalizes each channel to mean 0 and variance 1, then scales and shifts it. In training, mean and variance are those of
//! the batch. The forward pass returns them as statistics, and the trainer moves the running statistics toward them. At test time
//! the running statistics are used, so no shape depends on another.

use crate::model::forward_mode::ForwardMode;
use crate::model::parameters::{Initializer, ParameterShape, host_values};
use burn::module::{Module, Param};
use burn::tensor::Tensor;

/// The number that the norm adds to the variance, as in PTv3.
const EPSILON: f64 = 1e-3;
/// The fraction by which a batch moves the running statistics toward its own, as in PTv3.
const MOMENTUM: f32 = 0.01;

/// A batch norm. The fields are in the order in which a pass records its statistics.
#[derive(Module, Debug)]
pub(crate) struct BatchNorm {
    weight: Param<Tensor<1>>,
    bias: Param<Tensor<1>>,
    running_mean: Param<Tensor<1>>,
    running_variance: Param<Tensor<1>>,
}

impl BatchNorm {
    pub(crate) fn new(init: &Initializer, dim: usize) -> Self {
        Self {
            weight: init.constant(dim, 1.0),
            bias: init.constant(dim, 0.0),
            running_mean: init.constant(dim, 0.0),
            running_variance: init.constant(dim, 1.0),
        }
    }

    /// # Shapes
    /// - rows and output: `[token, channel]`
    pub(crate) fn forward(&self, rows: Tensor<2>, mode: &mut ForwardMode) -> Tensor<2> {
        let (centered, variance) = match mode {
            ForwardMode::Test => (
                rows - self.running_mean.val().unsqueeze(),
                self.running_variance.val().unsqueeze(),
            ),
            ForwardMode::Training { statistics, .. } => {
                let n = rows.dims()[0];
                let mean = rows.clone().mean_dim(0);
                let centered = rows - mean.clone();
                let variance = (centered.clone() * centered.clone()).mean_dim(0);
                let unbiased = n as f32 / n.saturating_sub(1).max(1) as f32;
                statistics.extend(host_values(mean));
                statistics.extend(
                    host_values(variance.clone())
                        .into_iter()
                        .map(|variance| variance * unbiased),
                );
                (centered, variance)
            }
        };
        centered / (variance + EPSILON).sqrt() * self.weight.val().unsqueeze()
            + self.bias.val().unsqueeze()
    }
}

/// Moves the running statistics in `values` toward those that a pass has recorded. Frozen tensors do not change.
pub(crate) fn move_running_statistics(
    shapes: &[ParameterShape],
    values: &mut [f32],
    recorded: &[f32],
    is_kept: impl Fn(&str) -> bool,
) {
    let (mut values, mut recorded) = (values, recorded.iter());
    for shape in shapes {
        let (own, rest) = values.split_at_mut(shape.len().min(values.len()));
        values = rest;
        if !shape.is_statistic() {
            continue;
        }
        let recorded = recorded.by_ref().take(shape.len());
        if is_kept(&shape.name) {
            recorded.for_each(drop);
            continue;
        }
        for (running, batch) in own.iter_mut().zip(recorded) {
            *running += MOMENTUM * (batch - *running);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::{shapes, values};
    use burn::tensor::Device;

    fn rows() -> Tensor<2> {
        Tensor::from_data([[1.0, -4.0], [3.0, 0.0], [5.0, 4.0]], &Device::flex())
    }

    fn norm() -> BatchNorm {
        BatchNorm::new(&Initializer::zeros(&Device::flex()), 2)
    }

    #[test]
    fn a_batch_is_measured_by_itself_and_leaves_its_statistics() {
        let mut mode = ForwardMode::repeatable();
        let found = host_values(norm().forward(rows(), &mut mode));
        let unit = |centered: f32, variance: f32| centered / (variance + 1e-3).sqrt();
        let expected = [
            [unit(-2.0, 8.0 / 3.0), unit(-4.0, 32.0 / 3.0)],
            [0.0, 0.0],
            [unit(2.0, 8.0 / 3.0), unit(4.0, 32.0 / 3.0)],
        ];
        for (found, expected) in found.iter().zip(expected.iter().flatten()) {
            assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
        }
        assert_eq!(mode.into_statistics(), [3.0, 0.0, 4.0, 16.0]);
    }

    #[test]
    fn running_statistics_move_by_a_hundredth_and_are_used_at_test_time() {
        let norm = norm();
        let mut values = values(&norm);
        move_running_statistics(&shapes(&norm), &mut values, &[3.0, 0.0, 4.0, 16.0], |_| {
            false
        });
        assert_eq!(values[..4], [1.0, 1.0, 0.0, 0.0]);
        for (found, expected) in values[4..].iter().zip([0.03, 0.0, 1.03, 1.15]) {
            assert!((found - expected).abs() < 1e-6, "{values:?}");
        }
        let found = host_values(norm.forward(rows(), &mut ForwardMode::Test));
        for (found, row) in found.iter().zip(host_values(rows())) {
            assert!((found - row / 1.001f32.sqrt()).abs() < 1e-6);
        }
    }

    #[test]
    fn a_batch_of_one_token_is_finite() {
        let mut mode = ForwardMode::repeatable();
        let one = norm().forward(rows().slice_dim(0, 0..1), &mut mode);
        assert_eq!(host_values(one), [0.0, 0.0]);
        assert_eq!(mode.into_statistics(), [1.0, -4.0, 0.0, 0.0]);
    }
}
