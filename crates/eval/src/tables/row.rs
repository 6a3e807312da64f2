//! Computes the means of one supervision under one reference and clusterer.

use super::shape_means::{ShapeMean, Shapes, mean, metrics_of};
use crate::k_bin::KBin;
use crate::metric::Metric;
use crate::metrics::MIOU;
use crate::score_row::ScoreRow;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// A mean over the shapes of one bin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BinMean {
    /// The bin.
    pub bin: KBin,
    /// Mean mIoU, or `None` for an empty bin.
    pub miou: Option<f64>,
    /// The number of shapes in the bin.
    pub n_shapes: usize,
}

/// The means of one supervision under one reference and clusterer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// The label source that the clusters are scored against.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// The label source that the backbone was trained on.
    pub supervision: String,
    /// The number of seeds that were averaged.
    pub n_seeds: usize,
    /// The number of shapes with 2 to 19 parts, over which the means are.
    pub n_shapes: usize,
    /// Mean of each metric over these shapes. The value of a shape is its mean over seeds. A metric without values is absent.
    pub means: BTreeMap<Metric, f64>,
    /// Standard deviation of the mIoU of the shapes, or `None` for fewer than two shapes.
    pub miou_deviation: Option<f64>,
    /// Mean mIoU by number of parts, including shapes with one part and with 20 or more.
    pub bins: Vec<BinMean>,
    /// The mIoU that follows from the bins if they had the paper's fractions of the shapes ([`KBin::PAPER_MIX`]), or `None` if
    /// one of the three has fewer than three shapes.
    pub miou_at_paper_mix: Option<f64>,
}

/// A bin with fewer shapes has too uncertain a mean to be weighted.
const MIN_OF_MIX: usize = 3;

/// Averages the shapes of one supervision, reference and clusterer. `cell` must have at least one row.
pub(super) fn table_row(cell: &[&ScoreRow], shapes: &Shapes<'_>) -> TableRow {
    let in_mean: Vec<&ShapeMean<'_>> = shapes
        .values()
        .filter(|shape| shape.bin.is_in_mean())
        .collect();
    let seeds: BTreeSet<u64> = cell.iter().map(|row| row.seed).collect();
    let bins = KBin::ALL.map(|bin| bin_mean(bin, shapes)).to_vec();
    TableRow {
        miou_at_paper_mix: miou_at_paper_mix(&bins),
        reference: cell[0].reference.clone(),
        clusterer: cell[0].clusterer.clone(),
        supervision: cell[0].supervision.clone(),
        n_seeds: seeds.len(),
        n_shapes: in_mean.len(),
        means: means(&in_mean),
        miou_deviation: miou_deviation(&in_mean),
        bins,
    }
}

fn means(shapes: &[&ShapeMean<'_>]) -> BTreeMap<Metric, f64> {
    let mut means = BTreeMap::new();
    for metric in metrics_of(shapes.iter().copied()) {
        if let Some(mean) = mean(values(shapes, metric)) {
            means.insert(metric, mean);
        }
    }
    means
}

/// The values of a metric, shape by shape. Shapes without a value are skipped.
fn values(shapes: &[&ShapeMean<'_>], metric: Metric) -> impl Iterator<Item = f64> {
    shapes
        .iter()
        .filter_map(move |shape| shape.means.get(&metric).copied())
}

/// The standard deviation of the mIoU of a sample of shapes.
fn miou_deviation(shapes: &[&ShapeMean<'_>]) -> Option<f64> {
    let mean = mean(values(shapes, MIOU))?;
    if shapes.len() < 2 {
        return None;
    }
    let squares: f64 = values(shapes, MIOU).map(|miou| (miou - mean).powi(2)).sum();
    Some((squares / (shapes.len() - 1) as f64).sqrt())
}

fn miou_at_paper_mix(bins: &[BinMean]) -> Option<f64> {
    let share = |(bin, share): (KBin, f64)| {
        let found = bins.iter().find(|found| found.bin == bin)?;
        let miou = found.miou.filter(|_| found.n_shapes >= MIN_OF_MIX)?;
        Some(share * miou)
    };
    KBin::PAPER_MIX.into_iter().map(share).sum()
}

fn bin_mean(bin: KBin, shapes: &Shapes<'_>) -> BinMean {
    let of_bin: Vec<&ShapeMean<'_>> = shapes.values().filter(|shape| shape.bin == bin).collect();
    BinMean {
        bin,
        miou: mean(values(&of_bin, MIOU)),
        n_shapes: of_bin.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(n_shapes: [usize; 5], expected: Option<f64>) {
        let mean = |(bin, n_shapes): (KBin, usize)| BinMean {
            bin,
            miou: (n_shapes > 0).then_some(if bin == KBin::K2To4 { 0.75 } else { 0.5 }),
            n_shapes,
        };
        let bins: Vec<BinMean> = KBin::ALL.into_iter().zip(n_shapes).map(mean).collect();
        let found = miou_at_paper_mix(&bins);
        assert_eq!(
            found.map(|x| (x * 1e9).round()),
            expected.map(|x| (x * 1e9).round())
        );
    }

    #[test]
    fn the_paper_has_more_shapes_with_few_parts() {
        check([0, 3, 50, 400, 0], Some(0.4 * 0.75 + 0.6 * 0.5));
        check([9, 40, 3, 3, 7], Some(0.4 * 0.75 + 0.6 * 0.5));
        check([9, 2, 50, 400, 7], None);
        check([9, 40, 50, 0, 7], None);
    }
}
