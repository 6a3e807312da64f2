//! Finds the range of thresholds over which hardly any shape's partition changes.

use partprobe_sources::ANGLE_TIE_DEG;
use serde::Serialize;

/// The lowest and the highest threshold that is tried, in degrees. Tessellated and noisy files need lower ones.
const LOWEST_DEG: f64 = 1.0;
const HIGHEST_DEG: f64 = 45.0;
/// The distance between neighboring thresholds that are tried, in degrees.
const STEP_DEG: f64 = 0.5;

/// A range of thresholds over which few partitions change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StableRange {
    /// The lowest threshold of the range, in degrees.
    pub low_deg: f64,
    /// The highest threshold of the range, in degrees.
    pub high_deg: f64,
    /// Fraction of the shapes whose partition at the highest threshold differs from that at the lowest.
    pub changed: f64,
}

/// Finds the widest range between 1° and 45°, in steps of 0.5°, over which the partition of at most the fraction
/// `tolerance` of the shapes changes. If several ranges are equally wide, the lowest one is returned. Returns `None` if
/// more partitions change over every single step. With `around_deg`, only ranges that contain this threshold count.
///
/// `merges` holds the merges of each shape, ascending. A partition only becomes coarser as θ grows, so it is the same
/// at both ends of a range exactly if no merge lies between them. Cost: `O(shapes × thresholds²)` at worst.
#[must_use]
pub fn stable_range(
    merges: &[Vec<f64>],
    tolerance: f64,
    around_deg: Option<f64>,
) -> Option<StableRange> {
    let thresholds: Vec<f64> = thresholds().collect();
    let counts: Vec<Vec<u32>> = merges
        .iter()
        .map(|merges| counts_at(merges, &thresholds))
        .collect();
    let changed = |low: usize, high: usize| {
        let n = counts
            .iter()
            .filter(|counts| counts[low] != counts[high])
            .count();
        n as f64 / counts.len().max(1) as f64
    };
    let counts_here = |low: usize, high: usize| {
        high > low
            && around_deg.is_none_or(|theta| (thresholds[low]..=thresholds[high]).contains(&theta))
    };
    let mut best: Option<(usize, usize)> = None;
    let mut high = 0;
    for low in 0..thresholds.len() {
        high = high.max(low);
        // Every range inside a stable range is stable, so `high` never has to decrease.
        while high + 1 < thresholds.len() && changed(low, high + 1) <= tolerance {
            high += 1;
        }
        if counts_here(low, high) && best.is_none_or(|(from, to)| high - low > to - from) {
            best = Some((low, high));
        }
    }
    best.map(|(low, high)| StableRange {
        low_deg: thresholds[low],
        high_deg: thresholds[high],
        changed: changed(low, high),
    })
}

fn thresholds() -> impl Iterator<Item = f64> {
    let n = ((HIGHEST_DEG - LOWEST_DEG) / STEP_DEG) as u32;
    (0..=n).map(|step| LOWEST_DEG + f64::from(step) * STEP_DEG)
}

/// The number of merges up to each threshold.
fn counts_at(merges: &[f64], thresholds: &[f64]) -> Vec<u32> {
    thresholds
        .iter()
        .map(|theta| merges.partition_point(|&phi| phi <= theta + ANGLE_TIE_DEG) as u32)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(
        merges: &[&[f64]],
        tolerance: f64,
        around: Option<f64>,
        expected: Option<(f64, f64, f64)>,
    ) {
        let merges: Vec<Vec<f64>> = merges.iter().map(|merges| merges.to_vec()).collect();
        let found = stable_range(&merges, tolerance, around)
            .map(|range| (range.low_deg, range.high_deg, range.changed));
        assert_eq!(found, expected);
    }

    #[test]
    fn the_widest_range_without_merges_is_found() {
        check(&[], 0.0, None, Some((1.0, 45.0, 0.0)));
        check(&[&[0.2, 90.0]], 0.0, None, Some((1.0, 45.0, 0.0)));
        check(&[&[3.2, 12.2], &[30.0]], 0.0, None, Some((12.5, 29.5, 0.0)));
        // Three equally wide ranges: the lowest one counts.
        check(&[&[15.2, 29.7, 44.2]], 0.0, None, Some((1.0, 15.0, 0.0)));
        // One shape of two may change.
        check(&[&[3.2, 12.2], &[30.0]], 0.5, None, Some((12.5, 45.0, 0.5)));
        check(
            &[&[3.2, 12.2], &[30.0]],
            0.0,
            Some(8.0),
            Some((3.5, 12.0, 0.0)),
        );
        check(&[&[7.7, 8.0, 8.3]], 0.0, Some(8.0), None);
        let everywhere: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.25).collect();
        check(&[&everywhere], 0.0, None, None);
    }
}
