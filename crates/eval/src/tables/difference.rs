//! Computes the difference between two supervisions under one reference and clusterer, with its interval.

use super::shape_means::{ShapeMean, Shapes, metrics_of};
use crate::bootstrap::{Bootstrap, GroupSum, Interval, interval_of_mean};
use crate::metric::Metric;
use partprobe_carrier::keyed_rng;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// A mean difference over the shapes that both supervisions have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Mean of the first minus the second.
    pub mean: f64,
    /// The 95 % interval of the bootstrap, or `None` for fewer than two groups of shapes.
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
    /// The difference of each metric. A metric is absent if one of the two has no values.
    pub differences: BTreeMap<Metric, Difference>,
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
    let names_of_groups: BTreeSet<&str> = pairs.iter().map(|(first, _)| first.group).collect();
    Some(DifferenceRow {
        reference: reference.to_owned(),
        clusterer: clusterer.to_owned(),
        compared: compared.clone(),
        n_shapes: pairs.len(),
        n_groups: names_of_groups.len(),
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
        interval: interval_of_mean(groups, bootstrap.draws, &mut rng),
    })
}
