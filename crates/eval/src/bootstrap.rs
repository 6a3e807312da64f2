//! Estimates how far a mean difference may be due to chance: the paired bootstrap over groups of related shapes.
//!
//! It is the percentile bootstrap (Efron 1979, "Bootstrap methods: another look at the jackknife"). Whole groups are
//! drawn, since the shapes of one group are not independent.

use partprobe_carrier::Rng;
use rand::Rng as _;

/// How the bootstrap draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bootstrap {
    /// The number of times that the groups are drawn. A value of 0 gives no interval.
    pub draws: usize,
    /// The seed of the draws.
    pub seed: u64,
    /// The smallest number of groups of related shapes for which there is an interval.
    pub least_groups: usize,
}

impl Bootstrap {
    /// With fewer groups, the bootstrap gives intervals that are too narrow.
    pub const LEAST_GROUPS: usize = 10;
}

/// The interval that contains the mean difference of 95 % of the draws.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Interval {
    /// The 2.5 % quantile.
    pub low: f64,
    /// The 97.5 % quantile.
    pub high: f64,
}

impl Interval {
    /// Half of the width.
    #[must_use]
    pub fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }
}

/// The number of groups of equal size with the same information as groups of the given sizes: (Σn)² / Σn² (Kish 1965).
#[must_use]
pub(crate) fn effective_groups(sizes: impl Iterator<Item = usize> + Clone) -> f64 {
    let sum: usize = sizes.clone().sum();
    let squares: usize = sizes.map(|n| n * n).sum();
    if squares == 0 {
        return 0.0;
    }
    (sum * sum) as f64 / squares as f64
}

/// The sum and the number of the values of one group.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GroupSum {
    pub(crate) sum: f64,
    pub(crate) n: usize,
}

/// Draws as many groups as there are, with replacement, and takes the mean over the shapes in them, `draws` times.
///
/// Returns `None` for too few groups, and always for fewer than two.
pub(crate) fn interval_of_mean(
    groups: &[GroupSum],
    bootstrap: Bootstrap,
    rng: &mut Rng,
) -> Option<Interval> {
    let draws = bootstrap.draws;
    if groups.len() < bootstrap.least_groups.max(2) || draws == 0 {
        return None;
    }
    let mut means: Vec<f64> = (0..draws).map(|_| mean_of_drawn(groups, rng)).collect();
    means.sort_by(f64::total_cmp);
    Some(Interval {
        low: quantile(&means, 0.025),
        high: quantile(&means, 0.975),
    })
}

fn mean_of_drawn(groups: &[GroupSum], rng: &mut Rng) -> f64 {
    let mut sum = 0.0;
    let mut n = 0;
    for _ in 0..groups.len() {
        let group = groups[drawn_index(groups.len(), rng)];
        sum += group.sum;
        n += group.n;
    }
    sum / n.max(1) as f64
}

/// An index below `n`, all equally likely.
pub(crate) fn drawn_index(n: usize, rng: &mut Rng) -> usize {
    // The high half of the product is uniform on 0..n.
    ((u128::from(rng.next_u64()) * n as u128) >> 64) as usize
}

/// The quantile of sorted values at a fraction from 0 to 1, linear between neighbors.
pub(crate) fn quantile(sorted: &[f64], fraction: f64) -> f64 {
    let position = fraction * (sorted.len() - 1) as f64;
    let below = sorted[position.floor() as usize];
    let above = sorted[position.ceil() as usize];
    below + (above - below) * position.fract()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::keyed_rng;

    fn interval(groups: &[(f64, usize)], draws: usize) -> Option<Interval> {
        let groups: Vec<GroupSum> = groups.iter().map(|&(sum, n)| GroupSum { sum, n }).collect();
        let bootstrap = Bootstrap {
            draws,
            seed: 0,
            least_groups: 2,
        };
        interval_of_mean(&groups, bootstrap, &mut keyed_rng(1, &["test"]))
    }

    #[test]
    fn a_constant_difference_has_an_interval_without_width() {
        assert_eq!(
            interval(&[(0.25, 1), (0.5, 2), (1.0, 4)], 100),
            Some(Interval {
                low: 0.25,
                high: 0.25
            })
        );
    }

    #[test]
    fn the_interval_is_that_of_the_normal_law_for_many_groups() {
        // 400 groups of differences ±1: the mean has a standard deviation of 1/20.
        let groups: Vec<(f64, usize)> = (0..400)
            .map(|n| (if n % 2 == 0 { 1.0 } else { -1.0 }, 1))
            .collect();
        let Interval { low, high } = interval(&groups, 4000).unwrap();
        assert!(
            (low + 1.96 / 20.0).abs() < 0.01 && (high - 1.96 / 20.0).abs() < 0.01,
            "{low} {high}"
        );
    }

    #[test]
    fn one_group_has_no_interval() {
        assert_eq!(interval(&[(3.0, 9)], 100), None);
        assert_eq!(interval(&[], 100), None);
        assert_eq!(interval(&[(3.0, 9), (1.0, 1)], 0), None);
    }

    #[test]
    fn quantiles_are_linear_between_values() {
        assert_eq!(
            [0.0, 0.25, 0.5, 1.0].map(|fraction| quantile(&[0.0, 1.0, 5.0], fraction)),
            [0.0, 0.5, 1.0, 5.0]
        );
    }
}
