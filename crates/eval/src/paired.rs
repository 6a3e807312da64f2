//! Tests whether the mean difference of paired scores could be due to chance.
//!
//! Differences go in, by group of related shapes and by seed. A mean, its standard error, an interval and a p-value come out.
//! Two things make a difference vary: which shapes are in the test set, and the seeds of the trainings. Both are drawn
//! with replacement (the crossed bootstrap of Owen 2007, "The pigeonhole bootstrap"), and each draw is divided by its own
//! standard error (the bootstrap-t of Efron 1981), since a plain bootstrap over few groups gives intervals that are too
//! narrow. The interval is the symmetric one (Hall 1988), so it excludes 0 if and only if p is below 0.05.

use crate::bootstrap::{Bootstrap, GroupSum, Interval, drawn_index};
use partprobe_carrier::Rng;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A difference with a smaller p-value is more than chance. The level of the intervals is 1 minus this value.
pub const SIGNIFICANCE: f64 = 0.05;

/// A mean paired difference, and how far it may be due to chance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Mean of the first minus the second, over the shapes that both have and the seeds that both were trained with.
    pub mean: f64,
    /// The number of seeds that both were trained with. With one, nothing is known about the variance between trainings.
    pub n_seeds: usize,
    /// The standard deviation of the difference between trainings that differ only in their seeds, or `None` for one seed.
    pub seed_deviation: Option<f64>,
    /// The standard error of the mean, or `None` if there are too few groups of shapes.
    pub standard_error: Option<f64>,
    /// The 95 % interval, or `None` if there are too few groups of shapes.
    pub interval: Option<Interval>,
    /// The probability of such a difference or a larger one if there is none, or `None` if there are too few groups of shapes.
    pub p: Option<f64>,
    /// The same after Holm's correction for all differences of its family: the primary endpoints, or all others.
    pub adjusted_p: Option<f64>,
}

/// The differences of one group of related shapes: their sum and number, by seed.
pub(crate) type GroupOfSeeds = Vec<GroupSum>;

/// Sums differences of shapes by group of related shapes and by seed. Each difference comes with its group and the position of its seed.
pub(crate) fn by_group_and_seed<'a>(
    n_seeds: usize,
    differences: impl Iterator<Item = (&'a str, usize, f64)>,
) -> Vec<GroupOfSeeds> {
    let mut groups: BTreeMap<&str, GroupOfSeeds> = BTreeMap::new();
    for (group, seed, difference) in differences {
        let of_seeds = groups
            .entry(group)
            .or_insert_with(|| vec![GroupSum::default(); n_seeds]);
        of_seeds[seed].sum += difference;
        of_seeds[seed].n += 1;
    }
    groups.into_values().collect()
}

/// The test of a mean difference. Returns `None` without any difference.
///
/// Each group has one sum per seed, in the same order. `seed_variance` is the variance of the difference between trainings, if it
/// is known from many other trainings. Then the seeds are not drawn, because two or three of them give little information about
/// their variance: the known variance is taken, or that of these seeds if it is larger.
pub(crate) fn paired_difference(
    groups: &[GroupOfSeeds],
    seed_variance: Option<f64>,
    bootstrap: Bootstrap,
    rng: &mut Rng,
) -> Option<Difference> {
    let n_seeds = groups.first()?.len();
    let all_groups: Vec<usize> = (0..groups.len()).collect();
    let all_seeds: Vec<usize> = (0..n_seeds).collect();
    let found = Moments::of(groups, &all_groups, &all_seeds)?;
    let mut difference = Difference {
        mean: found.mean,
        n_seeds,
        seed_deviation: (n_seeds > 1).then(|| found.seed_variance.sqrt()),
        standard_error: None,
        interval: None,
        p: None,
        adjusted_p: None,
    };
    let too_few = groups.len() < bootstrap.least_groups.max(2);
    if too_few || bootstrap.draws == 0 {
        return Some(difference);
    }
    let (groups, variance) = match seed_variance {
        None => (Cow::Borrowed(groups), found.variance()),
        Some(known) => {
            let of_seeds = known.max(found.seed_variance) / n_seeds as f64;
            (
                Cow::Owned(without_seeds(groups)),
                found.group_variance + of_seeds,
            )
        }
    };
    let standard_error = variance.sqrt();
    let distances = drawn_distances(&groups, found.mean, bootstrap, rng);
    let half_width = distance_beyond(&distances, SIGNIFICANCE) * standard_error;
    difference.standard_error = Some(standard_error);
    difference.interval = Some(Interval {
        low: found.mean - half_width,
        high: found.mean + half_width,
    });
    difference.p = Some(p_value(found.mean, standard_error, &distances));
    Some(difference)
}

/// The groups with the sums of their seeds added, as if there were one seed.
fn without_seeds(groups: &[GroupOfSeeds]) -> Vec<GroupOfSeeds> {
    groups
        .iter()
        .map(|group| vec![total(group.iter().copied())])
        .collect()
}

/// The mean of the differences of some groups and seeds, and its variance from either.
struct Moments {
    mean: f64,
    /// The variance of the mean that comes from the choice of the shapes, robust to groups of related shapes.
    group_variance: f64,
    /// The variance of the difference between seeds. It is 0 for one seed.
    seed_variance: f64,
    n_seeds: usize,
}

impl Moments {
    /// Returns `None` if these groups and seeds have no shape.
    fn of(groups: &[GroupOfSeeds], drawn_groups: &[usize], drawn_seeds: &[usize]) -> Option<Self> {
        let of_group: Vec<GroupSum> = drawn_groups
            .iter()
            .map(|&group| total(drawn_seeds.iter().map(|&seed| groups[group][seed])))
            .collect();
        let all = total(of_group.iter().copied());
        if all.n == 0 {
            return None;
        }
        let mean = all.sum / all.n as f64;

        let residual = |group: &GroupSum| (group.sum - group.n as f64 * mean).powi(2);
        let n_groups = of_group.len() as f64;
        let squares: f64 = of_group.iter().map(residual).sum();
        let group_variance = if n_groups > 1.0 {
            n_groups / (n_groups - 1.0) * squares / (all.n as f64).powi(2)
        } else {
            0.0
        };

        let of_seed = drawn_seeds.iter().map(|&seed| {
            let sum = total(drawn_groups.iter().map(|&group| groups[group][seed]));
            sum.sum / sum.n.max(1) as f64
        });
        Some(Self {
            mean,
            group_variance,
            seed_variance: sample_variance(&of_seed.collect::<Vec<f64>>()),
            n_seeds: drawn_seeds.len(),
        })
    }

    /// The variance of the mean.
    fn variance(&self) -> f64 {
        self.group_variance + self.seed_variance / self.n_seeds.max(1) as f64
    }
}

fn total(sums: impl Iterator<Item = GroupSum>) -> GroupSum {
    sums.fold(GroupSum::default(), |total, group| GroupSum {
        sum: total.sum + group.sum,
        n: total.n + group.n,
    })
}

/// The variance of a sample. It is 0 for fewer than two values.
fn sample_variance(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    if values.len() < 2 {
        return 0.0;
    }
    let mean = values.iter().sum::<f64>() / n;
    values
        .iter()
        .map(|value| (value - mean).powi(2))
        .sum::<f64>()
        / (n - 1.0)
}

/// The distances of the means of the draws from the mean of the data, in units of the standard error of the draw, sorted.
fn drawn_distances(
    groups: &[GroupOfSeeds],
    mean: f64,
    bootstrap: Bootstrap,
    rng: &mut Rng,
) -> Vec<f64> {
    let n_seeds = groups[0].len();
    let mut distances = Vec::with_capacity(bootstrap.draws);
    for _ in 0..bootstrap.draws {
        let drawn_groups: Vec<usize> = (0..groups.len())
            .map(|_| drawn_index(groups.len(), rng))
            .collect();
        let drawn_seeds: Vec<usize> = (0..n_seeds).map(|_| drawn_index(n_seeds, rng)).collect();
        let Some(drawn) = Moments::of(groups, &drawn_groups, &drawn_seeds) else {
            continue;
        };
        let distance = ((drawn.mean - mean) / drawn.variance().sqrt()).abs();
        // A draw of one group alone has no variance. If all differences are equal, no draw has any.
        distances.push(if distance.is_finite() { distance } else { 0.0 });
    }
    distances.sort_by(f64::total_cmp);
    distances
}

/// The distance beyond which [`p_value`] is below the limit, as far as this number of draws can show it.
fn distance_beyond(sorted: &[f64], limit: f64) -> f64 {
    // With one more draw at this distance, p would reach the limit.
    let n_as_far = (limit * (sorted.len() + 1) as f64).ceil() as usize;
    let n_as_far = n_as_far.saturating_sub(1).max(1);
    let idx = sorted.len().saturating_sub(n_as_far);
    sorted.get(idx).copied().unwrap_or(0.0)
}

/// The fraction of draws that are at least as far from their mean as the mean is from 0, in units of standard errors. It is never 0,
/// since finitely many draws cannot show that.
fn p_value(mean: f64, standard_error: f64, distances: &[f64]) -> f64 {
    if mean == 0.0 {
        return 1.0;
    }
    let found = (mean / standard_error).abs();
    let n_further = distances
        .iter()
        .filter(|&&distance| distance >= found)
        .count();
    (n_further + 1) as f64 / (distances.len() + 1) as f64
}

/// The least number of draws with which the smallest p-value of `n_tests` tests can be below the limit after Holm's correction.
pub(crate) fn least_draws(n_tests: usize) -> usize {
    (n_tests as f64 / SIGNIFICANCE).ceil() as usize
}

/// Holm's correction (1979): p-values that are corrected for the number of tests.
pub(crate) fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|&a, &b| p[a].total_cmp(&p[b]));
    let mut adjusted = vec![0.0; p.len()];
    let mut largest: f64 = 0.0;
    for (rank, idx) in order.into_iter().enumerate() {
        largest = largest.max(p[idx] * (p.len() - rank) as f64).min(1.0);
        adjusted[idx] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_carrier::{keyed_rng, unit_interval};
    use proptest::{prop_assert, prop_assert_eq, proptest};

    const BOOTSTRAP: Bootstrap = Bootstrap {
        draws: 400,
        seed: 0,
        least_groups: 10,
    };

    /// About normal, with a variance of 1: the sum of twelve uniform draws, less six.
    fn normal(rng: &mut Rng) -> f64 {
        (0..12).map(|_| unit_interval(rng)).sum::<f64>() - 6.0
    }

    /// Differences of trainings with a planted mean: each seed, each group and each shape has a deviation of its own.
    fn planted(mean: f64, n_groups: usize, n_seeds: usize, rng: &mut Rng) -> Vec<GroupOfSeeds> {
        let of_seed: Vec<f64> = (0..n_seeds).map(|_| 0.01 * normal(rng)).collect();
        let mut group = || {
            let of_group = 0.05 * normal(rng);
            let n = 1 + (6.0 * unit_interval(rng)) as usize;
            let shapes: Vec<f64> = (0..n).map(|_| 0.1 * normal(rng)).collect();
            let sum_of = |seed: &f64| GroupSum {
                sum: shapes
                    .iter()
                    .map(|shape| mean + seed + of_group + shape)
                    .sum(),
                n,
            };
            of_seed.iter().map(sum_of).collect()
        };
        (0..n_groups).map(|_| group()).collect()
    }

    fn tested(groups: &[GroupOfSeeds]) -> Difference {
        paired_difference(groups, None, BOOTSTRAP, &mut keyed_rng(1, &["test"])).unwrap()
    }

    #[test]
    fn about_one_in_twenty_intervals_misses_the_planted_mean() {
        let mut rng = keyed_rng(5, &["planted"]);
        for (n_groups, n_seeds) in [(12, 3), (30, 3), (30, 5)] {
            let n = 300;
            let mut n_missed = 0;
            for _ in 0..n {
                let interval = tested(&planted(0.03, n_groups, n_seeds, &mut rng))
                    .interval
                    .unwrap();
                n_missed += usize::from(interval.low > 0.03 || interval.high < 0.03);
            }
            let rate = n_missed as f64 / f64::from(n);
            assert!(
                (0.005..0.10).contains(&rate),
                "{n_groups} groups, {n_seeds} seeds: {rate}"
            );
        }
    }

    #[test]
    fn a_planted_difference_is_found_and_no_difference_is_not() {
        let mut rng = keyed_rng(6, &["planted"]);
        for _ in 0..20 {
            let large = tested(&planted(0.2, 30, 3, &mut rng));
            assert!(large.interval.unwrap().low > 0.0 && large.p.unwrap() < 0.05);
        }
        let p: Vec<f64> = (0..40)
            .map(|_| tested(&planted(0.0, 30, 3, &mut rng)).p.unwrap())
            .collect();
        assert!(p.iter().filter(|&&p| p < 0.5).count() > 8, "{p:?}");
        assert!(p.iter().filter(|&&p| p < 0.05).count() < 8, "{p:?}");
    }

    #[test]
    fn an_interval_excludes_0_if_and_only_if_p_is_small() {
        let mut rng = keyed_rng(8, &["planted"]);
        let mut n_found = 0;
        for draws in [399, 400, 1000] {
            for _ in 0..40 {
                let groups = planted(0.03, 15, 3, &mut rng);
                let bootstrap = Bootstrap { draws, ..BOOTSTRAP };
                let found = paired_difference(&groups, None, bootstrap, &mut rng).unwrap();
                let interval = found.interval.unwrap();
                let excludes = interval.low > 0.0 || interval.high < 0.0;
                assert_eq!(excludes, found.p.unwrap() < SIGNIFICANCE);
                n_found += usize::from(excludes);
            }
        }
        assert!((10..110).contains(&n_found), "{n_found}");
    }

    #[test]
    fn enough_draws_make_one_of_many_tests_significant() {
        for n_tests in [1, 20, 598] {
            let draws = least_draws(n_tests);
            let mut p = vec![1.0; n_tests];
            p[0] = 1.0 / (draws + 1) as f64;
            assert!(holm(&p)[0] < SIGNIFICANCE);
            p[0] = 1.0 / draws as f64;
            assert!(holm(&p)[0] >= SIGNIFICANCE - 1e-12);
        }
    }

    #[test]
    fn the_seeds_widen_the_interval() {
        let mut rng = keyed_rng(7, &["planted"]);
        let calm = planted(0.0, 30, 3, &mut rng);
        let mut restless = calm.clone();
        for group in &mut restless {
            for (seed, shift) in group.iter_mut().zip([-0.1, 0.0, 0.1]) {
                seed.sum += shift * seed.n as f64;
            }
        }
        let [calm, restless] = [calm, restless].map(|groups| tested(&groups));
        assert!((calm.mean - restless.mean).abs() < 1e-12);
        let width = |found: &Difference| found.interval.unwrap().half_width();
        assert!(width(&restless) > 1.5 * width(&calm));
        assert!(restless.seed_deviation.unwrap() > 0.09);
    }

    #[test]
    fn a_known_variance_of_the_seeds_is_a_lower_bound() {
        for n_seeds in [1, 3] {
            let groups = planted(0.0, 30, n_seeds, &mut keyed_rng(8, &["planted"]));
            let error = |seed_variance| {
                let mut rng = keyed_rng(1, &["test"]);
                let found = paired_difference(&groups, seed_variance, BOOTSTRAP, &mut rng).unwrap();
                assert_eq!(found.seed_deviation.is_none(), n_seeds == 1);
                found.standard_error.unwrap()
            };
            let own = error(None);
            assert!((error(Some(0.0)) - own).abs() < 1e-12);
            assert!(error(Some(0.01)) > (0.01 / n_seeds as f64).sqrt());
            assert!(error(Some(0.01)) > own);
        }
    }

    #[test]
    fn too_few_groups_have_only_a_mean() {
        let groups = planted(0.0, 9, 2, &mut keyed_rng(9, &["planted"]));
        let found = tested(&groups);
        assert_eq!(
            (found.interval, found.p, found.standard_error),
            (None, None, None)
        );
        assert_eq!(found.n_seeds, 2);
        assert_eq!(
            paired_difference(&[], None, BOOTSTRAP, &mut keyed_rng(1, &["test"])),
            None
        );
    }

    #[test]
    fn holm_multiplies_by_the_tests_that_are_left() {
        for (p, expected) in [
            (&[0.01, 0.04, 0.03][..], &[0.03, 0.06, 0.06][..]),
            (&[0.5, 0.9], &[1.0, 1.0]),
            (&[], &[]),
        ] {
            let found = holm(p);
            assert!(
                found
                    .iter()
                    .zip(expected)
                    .all(|(a, b)| (a - b).abs() < 1e-12),
                "{found:?}"
            );
            assert_eq!(found.len(), expected.len());
        }
    }

    proptest! {
        #[test]
        fn the_reverse_comparison_has_the_reverse_interval(seed in 0u64..50) {
            let groups = planted(0.02, 15, 3, &mut keyed_rng(seed, &["planted"]));
            let reverse: Vec<GroupOfSeeds> = groups
                .iter()
                .map(|group| group.iter().map(|sum| GroupSum { sum: -sum.sum, ..*sum }).collect())
                .collect();
            let (found, reverse) = (tested(&groups), tested(&reverse));
            let (a, b) = (found.interval.unwrap(), reverse.interval.unwrap());
            prop_assert!((a.low + b.high).abs() < 1e-9 && (a.high + b.low).abs() < 1e-9);
            prop_assert_eq!(found.p, reverse.p);
        }
    }
}
