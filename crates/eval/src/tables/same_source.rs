//! Compares trainings of one supervision that differ only in their seed (A/A). It shows the differences that chance alone causes.

use super::difference::{DifferenceRow, difference_row};
use super::order::is_trained;
use super::shape_means::shape_means;
use super::{ScoreRow, TableSettings};
use std::collections::{BTreeMap, BTreeSet};

/// One row per supervision and pair of consecutive seeds, for one table.
///
/// `cell` has the rows of one supervision under one reference and clusterer.
pub(super) fn same_source_rows(
    cell: &[&ScoreRow],
    k_of_shape: &BTreeMap<&str, usize>,
    settings: &TableSettings,
) -> Vec<DifferenceRow> {
    let supervision = &cell[0].supervision;
    let seeds: BTreeSet<u64> = cell.iter().map(|row| row.seed).collect();
    if !is_trained(supervision) || seeds.len() < 2 {
        return Vec::new();
    }
    let table = [cell[0].reference.as_str(), cell[0].clusterer.as_str()];
    let seeds: Vec<u64> = seeds.into_iter().collect();
    let of_pair = |pair: &[u64]| {
        let names = [pair[0], pair[1]].map(|seed| format!("{supervision}, seed {seed}"));
        let mut shapes = BTreeMap::new();
        for (name, &seed) in names.iter().zip(pair) {
            let of_seed: Vec<&ScoreRow> = cell
                .iter()
                .copied()
                .filter(|row| row.seed == seed)
                .collect();
            let mut of_seed = shape_means(&of_seed, k_of_shape);
            for shape in of_seed.values_mut() {
                // The two arms are compared as if they had one seed in common.
                shape.by_seed = shape.by_seed.values().map(|row| (0, *row)).collect();
            }
            shapes.insert(name.as_str(), of_seed);
        }
        difference_row(table, &names, &shapes, settings, settings.bootstrap)
    };
    seeds.windows(2).filter_map(of_pair).collect()
}
