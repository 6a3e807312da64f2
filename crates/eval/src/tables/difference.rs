//! Computes the difference between two supervisions under one reference and clusterer, with its interval.

use super::shape_means::{ShapeMean, Shapes, metrics_of};
use super::{Endpoint, TableSettings};
use crate::bootstrap::{Bootstrap, effective_groups};
use crate::metric::Metric;
use crate::metrics::MIOU;
use crate::paired::{Difference, GroupOfSeeds, by_group_and_seed, holm, paired_difference};
use partprobe_carrier::keyed_rng;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// The difference between two compared supervisions under one reference and clusterer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifferenceRow {
    /// The label source that the clusters are scored against.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// The supervisions: the first minus the second.
    pub compared: [String; 2],
    /// The number of shapes with 2 to 19 parts that both have.
    pub n_shapes: usize,
    /// The number of groups of related shapes among them.
    pub n_groups: usize,
    /// The number of groups of equal size with the same information.
    pub effective_groups: f64,
    /// The difference of each metric. A metric is absent if one of the two has no values.
    pub differences: BTreeMap<Metric, Difference>,
    /// The metrics that are primary endpoints of this comparison.
    pub primary: Vec<Metric>,
}

/// A small difference of mIoU that a comparison should be able to show.
const SMALL_DIFFERENCE: f64 = 0.02;

impl DifferenceRow {
    /// A sentence on what the comparison can resolve: the half-width of the interval of mIoU, and how many shapes would make it
    /// 0.02, if their differences have the same variance and the seeds are the same.
    #[must_use]
    pub fn resolution(&self) -> String {
        let Self {
            n_shapes, n_groups, ..
        } = self;
        let [first, second] = &self.compared;
        let counts = format!(
            "Δ `{first}` − `{second}`: {n_shapes} shapes in {n_groups} groups of related shapes (effectively {:.1})",
            self.effective_groups
        );
        let miou = self.differences.get(&MIOU);
        let Some((miou, interval)) = miou.and_then(|found| Some((found, found.interval?))) else {
            return format!("{counts} are too few for an interval.");
        };
        let half_width = interval.half_width();
        let resolved = format!("{counts} resolve a difference of mIoU of ±{half_width:.3}");
        if half_width <= SMALL_DIFFERENCE {
            return format!("{resolved}.");
        }
        match scale_needed(miou, half_width) {
            Some(scale) => {
                let needed = |n: usize| (n as f64 * scale).ceil();
                format!(
                    "{resolved}. About {} such shapes in {} such groups would resolve ±{SMALL_DIFFERENCE}.",
                    needed(*n_shapes),
                    needed(*n_groups)
                )
            }
            None => format!(
                "{resolved}. For ±{SMALL_DIFFERENCE}, more seeds are needed: the trainings differ too much between seeds for more \
                 shapes to be enough."
            ),
        }
    }
}

/// The factor by which the number of shapes must grow to resolve the small difference. Shapes reduce only that part of the
/// variance that is not between seeds. Returns `None` if the seeds alone are too much.
fn scale_needed(miou: &Difference, half_width: f64) -> Option<f64> {
    let variance = miou.standard_error?.powi(2);
    let n_seeds = miou.n_seeds.max(1) as f64;
    let of_seeds = (miou.seed_deviation.unwrap_or(0.0).powi(2) / n_seeds).min(variance);
    let wanted = variance * (SMALL_DIFFERENCE / half_width).powi(2) - of_seeds;
    (wanted > 0.0).then(|| (variance - of_seeds) / wanted)
}

/// The same shape under the two compared supervisions.
type Pair<'a> = (&'a ShapeMean<'a>, &'a ShapeMean<'a>);

/// The Δ row of one table. Returns `None` if one of the compared supervisions has no row in it.
pub(super) fn difference_row(
    [reference, clusterer]: [&str; 2],
    compared: &[String; 2],
    shapes: &BTreeMap<&str, Shapes<'_>>,
    settings: &TableSettings,
    bootstrap: Bootstrap,
) -> Option<DifferenceRow> {
    let first = shapes.get(compared[0].as_str())?;
    let second = shapes.get(compared[1].as_str())?;
    let pairs = pairs_in_mean(first, second);
    let seeds = common_seeds(&pairs);

    let mut differences = BTreeMap::new();
    for metric in metrics_of(pairs.iter().map(|(first, _)| *first)) {
        let groups = groups_by_seed(&pairs, &seeds, metric);
        // All metrics and clusterers use the same random stream, so each draw takes the same shapes under each of them.
        let mut rng = keyed_rng(bootstrap.seed, &["bootstrap", reference]);
        let seed_variance = settings.seed_deviation.map(|deviation| deviation.powi(2));
        if let Some(difference) = paired_difference(&groups, seed_variance, bootstrap, &mut rng) {
            differences.insert(metric, difference);
        }
    }
    let mut group_sizes: BTreeMap<&str, usize> = BTreeMap::new();
    for (first, _) in &pairs {
        *group_sizes.entry(first.group).or_default() += 1;
    }
    let is_here = |endpoint: &&Endpoint| {
        let of_clusterer = endpoint.clusterer.as_deref().unwrap_or(&settings.clusterer);
        endpoint.reference == reference && of_clusterer == clusterer
    };
    let is_main = settings.compared.first() == Some(compared);
    let primary = settings.primary.iter().filter(|_| is_main).filter(is_here);
    Some(DifferenceRow {
        reference: reference.to_owned(),
        clusterer: clusterer.to_owned(),
        compared: compared.clone(),
        n_shapes: pairs.len(),
        n_groups: group_sizes.len(),
        effective_groups: effective_groups(group_sizes.values().copied()),
        differences,
        primary: primary.map(|endpoint| endpoint.metric).collect(),
    })
}

/// The shapes that both supervisions have, if they are of a bin that counts in the mean.
fn pairs_in_mean<'a>(first: &'a Shapes<'a>, second: &'a Shapes<'a>) -> Vec<Pair<'a>> {
    let mut pairs = Vec::new();
    for (shape, mean) in first {
        if let Some(other) = second.get(shape)
            && mean.bin.is_in_mean()
        {
            pairs.push((mean, other));
        }
    }
    pairs
}

/// The seeds that both supervisions were trained with. If an arm lacks a training, the seed does not count for the other either.
fn common_seeds(pairs: &[Pair<'_>]) -> BTreeSet<u64> {
    let seeds = |shape: fn(&Pair<'_>) -> Vec<u64>| -> BTreeSet<u64> {
        pairs.iter().flat_map(shape).collect()
    };
    let first = seeds(|(first, _)| first.by_seed.keys().copied().collect());
    let second = seeds(|(_, second)| second.by_seed.keys().copied().collect());
    first.intersection(&second).copied().collect()
}

/// The differences of a metric, summed by group of related shapes and seed. Shapes that lack the metric on one side are skipped.
fn groups_by_seed<'a>(
    pairs: &[Pair<'a>],
    seeds: &BTreeSet<u64>,
    metric: Metric,
) -> Vec<GroupOfSeeds> {
    let difference = |(first, second): &Pair<'a>, position: usize, seed: &u64| {
        let value = |shape: &ShapeMean<'_>| metric.of(shape.by_seed.get(seed)?);
        Some((first.group, position, value(first)? - value(second)?))
    };
    let of_pair = |pair: &Pair<'a>| {
        let of_seed = |(position, seed)| difference(pair, position, seed);
        seeds
            .iter()
            .enumerate()
            .filter_map(of_seed)
            .collect::<Vec<_>>()
    };
    by_group_and_seed(seeds.len(), pairs.iter().flat_map(of_pair))
}

/// Corrects the p-values for their number: those of the primary endpoints together, and all others together.
pub(super) fn adjust_p(rows: &mut [DifferenceRow]) {
    for is_primary in [true, false] {
        let mut family: Vec<(&mut Difference, f64)> = Vec::new();
        for row in &mut *rows {
            let primary = &row.primary;
            let of_family = row
                .differences
                .iter_mut()
                .filter(|(metric, _)| primary.contains(metric) == is_primary);
            family.extend(of_family.filter_map(|(_, found)| found.p.map(|p| (found, p))));
        }
        let p: Vec<f64> = family.iter().map(|(_, p)| *p).collect();
        for ((difference, _), adjusted) in family.into_iter().zip(holm(&p)) {
            difference.adjusted_p = Some(adjusted);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bootstrap::Interval;

    #[test]
    fn more_shapes_narrow_only_their_part_of_the_interval() {
        let row = |half_width: Option<f64>, seed_deviation: Option<f64>| DifferenceRow {
            reference: "r".to_owned(),
            clusterer: "k-means".to_owned(),
            compared: ["a".to_owned(), "b".to_owned()],
            n_shapes: 80,
            n_groups: 34,
            effective_groups: 21.25,
            differences: BTreeMap::from([(
                MIOU,
                Difference {
                    mean: 0.01,
                    n_seeds: 1,
                    seed_deviation,
                    standard_error: half_width.map(|half_width| half_width / 2.0),
                    interval: half_width.map(|half_width| Interval {
                        low: 0.01 - half_width,
                        high: 0.01 + half_width,
                    }),
                    p: None,
                    adjusted_p: None,
                },
            )]),
            primary: Vec::new(),
        };
        let counts = "Δ `a` − `b`: 80 shapes in 34 groups of related shapes (effectively 21.2)";
        for (half_width, seed_deviation, expected) in [
            (None, None, "are too few for an interval."),
            (
                Some(0.04),
                None,
                "resolve a difference of mIoU of ±0.040. About 320 such shapes in 136 such groups would resolve ±0.02.",
            ),
            // Half of the variance that may stay is between seeds, so the other half must come from seven eighths of it now.
            (
                Some(0.04),
                Some(0.01 / 2.0f64.sqrt()),
                "resolve a difference of mIoU of ±0.040. About 560 such shapes in 238 such groups would resolve ±0.02.",
            ),
            (
                Some(0.04),
                Some(0.015),
                "resolve a difference of mIoU of ±0.040. For ±0.02, more seeds are needed: the trainings differ too much between \
                 seeds for more shapes to be enough.",
            ),
            (Some(0.01), None, "resolve a difference of mIoU of ±0.010."),
        ] {
            assert_eq!(
                row(half_width, seed_deviation).resolution(),
                format!("{counts} {expected}")
            );
        }
    }

    #[test]
    fn groups_of_one_size_count_fully() {
        let groups = |sizes: &[usize]| effective_groups(sizes.iter().copied());
        assert_eq!(groups(&[3, 3, 3]), 3.0);
        assert_eq!(groups(&[8, 1, 1]), 100.0 / 66.0);
        assert_eq!(groups(&[]), 0.0);
    }
}
