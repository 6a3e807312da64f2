//! Defines the two modes of a forward pass: test and training.
//!
//! At test time a network is a function of its input. In training it also drops paths at random and records the statistics
//! of its batch norms.

use burn::tensor::{Tensor, TensorData};
use partprobe_carrier::{Rng, unit_interval};

/// The purpose of a forward pass, and the data that it records in addition to its output.
pub(crate) enum ForwardMode {
    /// Nothing is random, and batch norms use their running statistics.
    Test,
    /// Paths are dropped, and batch norms use the statistics of the batch.
    Training {
        /// The generator of the dropped paths, or `None` if no path is dropped.
        rng: Option<Box<Rng>>,
        /// Mean and unbiased variance of each batch norm, in the order of the pass.
        statistics: Vec<f32>,
    },
}

impl ForwardMode {
    /// A pass for a gradient.
    pub(crate) fn training(rng: Rng) -> Self {
        Self::Training {
            rng: Some(Box::new(rng)),
            statistics: Vec::new(),
        }
    }

    /// A pass for a gradient in which nothing is random.
    pub(crate) fn repeatable() -> Self {
        Self::Training {
            rng: None,
            statistics: Vec::new(),
        }
    }

    /// The statistics of the batch norms, in the order of the pass. At test time the list is empty.
    pub(crate) fn into_statistics(self) -> Vec<f32> {
        match self {
            Self::Test => Vec::new(),
            Self::Training { statistics, .. } => statistics,
        }
    }

    /// Drop path, also called stochastic depth (Huang et al., ECCV 2016), independently for each token.
    ///
    /// Sets a row to 0 with this probability, and scales the others so that the mean does not change.
    ///
    /// # Shapes
    /// - rows and output: `[token, channel]`
    pub(crate) fn drop_path(&mut self, rows: Tensor<2>, probability: f64) -> Tensor<2> {
        let Self::Training { rng: Some(rng), .. } = self else {
            return rows;
        };
        if probability <= 0.0 {
            return rows;
        }
        let n = rows.dims()[0];
        let kept = (1.0 / (1.0 - probability)) as f32;
        let factors: Vec<f32> = (0..n)
            .map(|_| {
                if unit_interval(rng) < probability {
                    0.0
                } else {
                    kept
                }
            })
            .collect();
        let factors: Tensor<2> =
            Tensor::from_data(TensorData::new(factors, [n, 1]), &rows.device());
        rows * factors
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameters::host_values;
    use burn::tensor::Device;
    use partprobe_carrier::keyed_rng;

    fn ones() -> Tensor<2> {
        Tensor::ones([4000, 2], &Device::flex())
    }

    #[test]
    fn paths_are_dropped_by_row_and_the_mean_stays() {
        let dropped = |key: &str| {
            host_values(ForwardMode::training(keyed_rng(0, &[key])).drop_path(ones(), 0.25))
        };
        let values = dropped("a");
        assert!(
            values
                .chunks(2)
                .all(|row| row == [0.0, 0.0] || row == [4.0 / 3.0; 2])
        );
        let mean = values.iter().map(|&x| f64::from(x)).sum::<f64>() / values.len() as f64;
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
        assert_eq!(values, dropped("a"));
        assert_ne!(values, dropped("b"));
    }

    #[test]
    fn nothing_is_dropped_at_test_time_or_with_probability_0() {
        assert_eq!(
            host_values(ForwardMode::Test.drop_path(ones(), 0.9)),
            host_values(ones())
        );
        for (mut mode, probability) in [
            (ForwardMode::training(keyed_rng(0, &["a"])), 0.0),
            (ForwardMode::repeatable(), 0.9),
        ] {
            assert_eq!(
                host_values(mode.drop_path(ones(), probability)),
                host_values(ones())
            );
        }
    }
}
