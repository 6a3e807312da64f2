//! Computes one number over shapes: mean, standard deviation and the interval in which the mean lies.

use crate::bootstrap::{Bootstrap, GroupSum, Interval, interval_of_mean};
use partprobe_carrier::keyed_rng;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A number over shapes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Statistic {
    /// The mean over the shapes.
    pub mean: f64,
    /// The standard deviation over the shapes. `None` if there is only one.
    pub deviation: Option<f64>,
    /// The interval that contains the mean of 95 % of the bootstrap draws. `None` if there are fewer than two groups.
    pub interval: Option<Interval>,
    /// How many shapes have a value.
    pub n_shapes: usize,
}

/// Averages values of shapes, each with its group of related shapes. Returns `None` if there is no value.
///
/// Groups are drawn together by the bootstrap. The order of the values does not change the interval. Sums are in the given order.
#[must_use]
pub fn statistic<'a>(
    values: impl Iterator<Item = (&'a str, f64)>,
    bootstrap: Bootstrap,
) -> Option<Statistic> {
    let values: Vec<(&str, f64)> = values.collect();
    let n_shapes = values.len();
    if n_shapes == 0 {
        return None;
    }
    let mean = values.iter().map(|(_, value)| value).sum::<f64>() / n_shapes as f64;
    let squares: f64 = values.iter().map(|(_, value)| (value - mean).powi(2)).sum();

    let mut groups: BTreeMap<&str, GroupSum> = BTreeMap::new();
    for &(group, value) in &values {
        let sum = groups.entry(group).or_default();
        sum.sum += value;
        sum.n += 1;
    }
    let groups: Vec<GroupSum> = groups.into_values().collect();
    // All numbers use the same random stream, so each draw takes the same shapes for each of them.
    let mut rng = keyed_rng(bootstrap.seed, &["agreement"]);
    Some(Statistic {
        mean,
        deviation: (n_shapes > 1).then(|| (squares / (n_shapes - 1) as f64).sqrt()),
        interval: interval_of_mean(&groups, bootstrap, &mut rng),
        n_shapes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const BOOTSTRAP: Bootstrap = Bootstrap {
        draws: 500,
        seed: 1,
        least_groups: 2,
    };

    #[test]
    fn mean_and_deviation_are_those_of_the_shapes() {
        let found = statistic([("a", 1.0), ("b", 2.0), ("b", 6.0)].into_iter(), BOOTSTRAP).unwrap();
        assert_eq!(
            (found.mean, found.deviation, found.n_shapes),
            (3.0, Some(7f64.sqrt()), 3)
        );
        let interval = found.interval.unwrap();
        // A draw is a twice, b twice, or one of each.
        assert_eq!((interval.low, interval.high), (1.0, 4.0));
    }

    #[test]
    fn one_shape_has_no_spread_and_none_has_no_mean() {
        let found = statistic([("a", 0.5)].into_iter(), BOOTSTRAP).unwrap();
        assert_eq!(
            (found.mean, found.deviation, found.interval),
            (0.5, None, None)
        );
        assert_eq!(statistic(std::iter::empty(), BOOTSTRAP), None);
    }
}
