//! Computes the difference between two supervisions under one reference and clusterer, with its interval.

use super::shape_means::{ShapeMean, Shapes, metrics_of};
use crate::bootstrap::{Bootstrap, GroupSum, Interval, effective_groups, interval_of_mean};
use crate::metric::Metric;
use crate::metrics::MIOU;
use partprobe_carrier::{Rng, keyed_rng};
use serde::Serialize;
use std::collections::BTreeMap;

/// A mean difference over the shapes that both supervisions have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Mean of the first minus the second.
    pub mean: f64,
    /// The 95 % interval of the bootstrap, or `None` if there are too few groups of shapes.
    pub interval: Option<Interval>,
}

/// The difference between the two compared supervisions under one reference and clusterer.
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
    /// How many groups of one size would say as much.
    pub effective_groups: f64,
    /// The difference of each metric. A metric is absent if one of the two has no values.
    pub differences: BTreeMap<Metric, Difference>,
}

/// A difference of mIoU that one may want to see.
const SMALL_DIFFERENCE: f64 = 0.02;

impl DifferenceRow {
    /// A sentence on what the comparison can resolve: the half-width of the interval of mIoU, and how many shapes would
    /// make it 0.02, if their differences scatter alike.
    #[must_use]
    pub fn resolution(&self) -> String {
        let Self {
            n_shapes, n_groups, ..
        } = self;
        let counts = format!(
            "{n_shapes} shapes in {n_groups} groups of related shapes (effectively {:.1})",
            self.effective_groups
        );
        let miou = self.differences.get(&MIOU);
        let Some(interval) = miou.and_then(|difference| difference.interval) else {
            return format!("Δ: {counts} are too few for an interval.");
        };
        let half_width = interval.half_width();
        let n_needed = (*n_shapes as f64 * (half_width / SMALL_DIFFERENCE).powi(2))
            .ceil()
            .max(1.0);
        format!(
            "Δ: {counts} resolve a difference of mIoU of ±{half_width:.3}. About {n_needed} such shapes would resolve \
             ±{SMALL_DIFFERENCE}."
        )
    }
}

/// The same shape under the two compared supervisions.
type Pair<'a> = (&'a ShapeMean<'a>, &'a ShapeMean<'a>);

/// The Δ row of one table. Returns `None` if one of the compared supervisions has no row in it.
pub(super) fn difference_row(
    [reference, clusterer]: [&str; 2],
    compared: &[String; 2],
    shapes: &BTreeMap<&str, Shapes<'_>>,
    bootstrap: Bootstrap,
) -> Option<DifferenceRow> {
    let first = shapes.get(compared[0].as_str())?;
    let second = shapes.get(compared[1].as_str())?;
    let pairs = pairs_in_mean(first, second);

    let mut differences = BTreeMap::new();
    for metric in metrics_of(pairs.iter().map(|(first, _)| *first)) {
        let groups = group_sums(&pairs, metric);
        if let Some(difference) = difference_of_means(&groups, reference, bootstrap) {
            differences.insert(metric, difference);
        }
    }
    let mut group_sizes: BTreeMap<&str, usize> = BTreeMap::new();
    for (first, _) in &pairs {
        *group_sizes.entry(first.group).or_default() += 1;
    }
    Some(DifferenceRow {
        reference: reference.to_owned(),
        clusterer: clusterer.to_owned(),
        compared: compared.clone(),
        n_shapes: pairs.len(),
        n_groups: group_sizes.len(),
        effective_groups: effective_groups(group_sizes.values().copied()),
        differences,
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

/// The differences of a metric, summed by group of related shapes. Shapes that lack the metric on one side are skipped.
fn group_sums(pairs: &[Pair<'_>], metric: Metric) -> Vec<GroupSum> {
    let mut groups: BTreeMap<&str, GroupSum> = BTreeMap::new();
    for (first, second) in pairs {
        if let (Some(a), Some(b)) = (first.means.get(&metric), second.means.get(&metric)) {
            let group = groups.entry(first.group).or_default();
            group.sum += a - b;
            group.n += 1;
        }
    }
    groups.into_values().collect()
}

/// The mean of one value per shape, each with the group of the shape, or `None` without values.
pub(super) fn difference_of_values<'a>(
    values: impl Iterator<Item = (&'a str, f64)>,
    bootstrap: Bootstrap,
    rng: &mut Rng,
) -> Option<Difference> {
    let mut groups: BTreeMap<&str, GroupSum> = BTreeMap::new();
    for (group, value) in values {
        let group = groups.entry(group).or_default();
        group.sum += value;
        group.n += 1;
    }
    let groups: Vec<GroupSum> = groups.into_values().collect();
    let n: usize = groups.iter().map(|group| group.n).sum();
    let sum: f64 = groups.iter().map(|group| group.sum).sum();
    (n > 0).then(|| Difference {
        mean: sum / n as f64,
        interval: interval_of_mean(&groups, bootstrap, rng),
    })
}

fn difference_of_means(
    groups: &[GroupSum],
    reference: &str,
    bootstrap: Bootstrap,
) -> Option<Difference> {
    let n: usize = groups.iter().map(|group| group.n).sum();
    if n == 0 {
        return None;
    }
    let sum: f64 = groups.iter().map(|group| group.sum).sum();
    // One stream for all metrics and clusterers: each draw takes the same shapes under each of them.
    let mut rng = keyed_rng(bootstrap.seed, &["bootstrap", reference]);
    Some(Difference {
        mean: sum / n as f64,
        interval: interval_of_mean(groups, bootstrap, &mut rng),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_times_the_shapes_halve_the_interval() {
        let row = |half_width: Option<f64>| DifferenceRow {
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
                    interval: half_width.map(|half_width| Interval {
                        low: 0.01 - half_width,
                        high: 0.01 + half_width,
                    }),
                },
            )]),
        };
        assert_eq!(
            row(Some(0.04)).resolution(),
            "Δ: 80 shapes in 34 groups of related shapes (effectively 21.2) resolve a difference of mIoU of ±0.040. About \
             320 such shapes would resolve ±0.02."
        );
        assert_eq!(
            row(None).resolution(),
            "Δ: 80 shapes in 34 groups of related shapes (effectively 21.2) are too few for an interval."
        );
    }

    #[test]
    fn groups_of_one_size_count_fully() {
        let groups = |sizes: &[usize]| effective_groups(sizes.iter().copied());
        assert_eq!(groups(&[3, 3, 3]), 3.0);
        assert_eq!(groups(&[8, 1, 1]), 100.0 / 66.0);
        assert_eq!(groups(&[]), 0.0);
    }
}
