//! Averages the rows of scores of each shape over seeds.

use crate::k_bin::KBin;
use crate::metric::Metric;
use crate::score_row::ScoreRow;
use std::collections::{BTreeMap, BTreeSet};

/// One shape under one reference, clusterer and supervision, averaged over seeds.
pub(super) struct ShapeMean<'a> {
    pub(super) bin: KBin,
    pub(super) group: &'a str,
    pub(super) means: BTreeMap<Metric, f64>,
    /// The rows that were averaged, by seed.
    pub(super) by_seed: BTreeMap<u64, &'a ScoreRow>,
}

/// The shapes of one table row, by id.
pub(super) type Shapes<'a> = BTreeMap<&'a str, ShapeMean<'a>>;

/// The number of parts of each shape under the reference that determines bins. If rows disagree, it is the smallest number.
pub(super) fn bin_sizes<'a>(rows: &'a [ScoreRow], bin_reference: &str) -> BTreeMap<&'a str, usize> {
    let mut sizes = BTreeMap::new();
    for row in rows.iter().filter(|row| row.reference == bin_reference) {
        let size = sizes.entry(row.shape.as_str()).or_insert(row.k);
        *size = row.k.min(*size);
    }
    sizes
}

/// Averages the rows of one table row, shape by shape.
pub(super) fn shape_means<'a>(
    cell: &[&'a ScoreRow],
    k_of_shape: &BTreeMap<&str, usize>,
) -> Shapes<'a> {
    let mut by_shape: BTreeMap<&str, Vec<&ScoreRow>> = BTreeMap::new();
    for row in cell {
        by_shape.entry(&row.shape).or_default().push(row);
    }

    let mut shapes = Shapes::new();
    for (shape, mut rows) in by_shape {
        // Sums are in the order of seeds, so that the order of the rows does not change a digit.
        rows.sort_by_key(|row| row.seed);
        let k = k_of_shape.get(shape).copied().unwrap_or(rows[0].k);
        let mean = ShapeMean {
            bin: KBin::of(k),
            group: &rows[0].group,
            means: means_over_seeds(&rows),
            by_seed: rows.iter().map(|row| (row.seed, *row)).collect(),
        };
        shapes.insert(shape, mean);
    }
    shapes
}

fn means_over_seeds(rows: &[&ScoreRow]) -> BTreeMap<Metric, f64> {
    let metrics: BTreeSet<Metric> = rows
        .iter()
        .flat_map(|row| row.scores.keys().copied())
        .collect();
    let mut means = BTreeMap::new();
    for metric in metrics {
        if let Some(mean) = mean(rows.iter().filter_map(|row| metric.of(row))) {
            means.insert(metric, mean);
        }
    }
    means
}

/// The metrics that some of the shapes have.
pub(super) fn metrics_of<'a>(shapes: impl Iterator<Item = &'a ShapeMean<'a>>) -> BTreeSet<Metric> {
    shapes
        .flat_map(|shape| shape.means.keys().copied())
        .collect()
}

/// The mean of the values in their order, or `None` without values.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sum = 0.0;
    let mut n = 0usize;
    for value in values {
        sum += value;
        n += 1;
    }
    (n > 0).then(|| sum / n as f64)
}
