//! Computes the home advantage: how much more one supervision wins on its own labels than the other wins on its own labels.
//!
//! Each label source favors the backbone that was trained on it, so a single table does not answer the question. The home
//! advantage combines the two tables.

use super::shape_means::{ShapeMean, metrics_of};
use super::{Bootstrap, TableShapes};
use crate::metric::Metric;
use crate::paired::{Difference, GroupOfSeeds, by_group_and_seed, paired_difference};
use partprobe_carrier::keyed_rng;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// H = \[(S − N) scored on S\] − \[(N − S) scored on N\] of two supervisions S and N that are also references.
///
/// Above 0, S gains more over N by its own measure than N gains over S by the other. Equal gains of any size give 0.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HomeAdvantage {
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// S and N.
    pub compared: [String; 2],
    /// The number of shapes with 2 to 19 parts that have all four scores.
    pub n_shapes: usize,
    /// The number of groups of related shapes among them.
    pub n_groups: usize,
    /// H of each metric, paired shape by shape.
    pub differences: BTreeMap<Metric, Difference>,
}

/// The scores of one shape: S and N on S, then S and N on N.
type Four<'a> = [&'a ShapeMean<'a>; 4];

/// One entry per clusterer and pair of supervisions that are also references.
pub(super) fn home_advantages(
    tables: &[TableShapes<'_>],
    supervisions: &[&str],
    bootstrap: Bootstrap,
) -> Vec<HomeAdvantage> {
    let mut clusterers: Vec<&str> = Vec::new();
    for [_, clusterer] in tables.iter().map(|table| table.table) {
        if !clusterers.contains(&clusterer) {
            clusterers.push(clusterer);
        }
    }
    let mut found = Vec::new();
    for clusterer in clusterers {
        for (idx, &first) in supervisions.iter().enumerate() {
            for &second in &supervisions[idx + 1..] {
                let advantage = home_advantage(tables, clusterer, [first, second], bootstrap);
                found.extend(advantage);
            }
        }
    }
    found
}

fn home_advantage(
    tables: &[TableShapes<'_>],
    clusterer: &str,
    [s, n]: [&str; 2],
    bootstrap: Bootstrap,
) -> Option<HomeAdvantage> {
    let shapes_of = |reference: &str, supervision: &str| {
        let table = tables
            .iter()
            .find(|table| table.table == [reference, clusterer])?;
        table.of_supervision.get(supervision)
    };
    let first = shapes_of(s, s)?;
    let others = [shapes_of(s, n)?, shapes_of(n, s)?, shapes_of(n, n)?];
    let mut fours: Vec<Four<'_>> = Vec::new();
    for (shape, mean) in first.iter().filter(|(_, mean)| mean.bin.is_in_mean()) {
        if let [Some(b), Some(c), Some(d)] = others.map(|shapes| shapes.get(shape)) {
            fours.push([mean, b, c, d]);
        }
    }

    let mut differences = BTreeMap::new();
    for metric in metrics_of(fours.iter().map(|four| four[0])) {
        let groups = groups_by_seed(&fours, metric);
        // All metrics use the same random stream, as for the differences of a table.
        let mut rng = keyed_rng(bootstrap.seed, &["home-advantage", s, n]);
        if let Some(difference) = paired_difference(&groups, None, bootstrap, &mut rng) {
            differences.insert(metric, difference);
        }
    }
    let groups: BTreeSet<&str> = fours.iter().map(|four| four[0].group).collect();
    (!fours.is_empty()).then(|| HomeAdvantage {
        clusterer: clusterer.to_owned(),
        compared: [s.to_owned(), n.to_owned()],
        n_shapes: fours.len(),
        n_groups: groups.len(),
        differences,
    })
}
/// H of each shape and seed that all four have, summed by group of related shapes and seed.
fn groups_by_seed<'a>(fours: &[Four<'a>], metric: Metric) -> Vec<GroupOfSeeds> {
    let has_all = |seed: &u64| {
        let has_seed = |mean: &&ShapeMean<'_>| mean.by_seed.contains_key(seed);
        fours.iter().any(|four| four.iter().all(has_seed))
    };
    let all = fours
        .iter()
        .flat_map(|four| four[0].by_seed.keys().copied());
    let seeds: BTreeSet<u64> = all.filter(has_all).collect();
    let advantage = |four: &Four<'a>, position: usize, seed: &u64| {
        let value = |mean: &ShapeMean<'_>| metric.of(mean.by_seed.get(seed)?);
        let [ss, ns, sn, nn] = four.map(value);
        Some((four[0].group, position, (ss? - ns?) - (nn? - sn?)))
    };
    let of_four = |four: &Four<'a>| {
        let of_seed = |(position, seed)| advantage(four, position, seed);
        seeds
            .iter()
            .enumerate()
            .filter_map(of_seed)
            .collect::<Vec<_>>()
    };
    by_group_and_seed(seeds.len(), fours.iter().flat_map(of_four))
}
