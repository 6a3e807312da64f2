//! Measures the agreement of labels with those of their neighborhood, without a reference.
//!
//! The paper reports a consistency and does not define it. This module has two: among neighbors on the surface, and across the
//! surface.

use super::reconstruction::Reconstruction;
use crate::geometry::Reference;
use crate::network::Network;
use partprobe_carrier::PointSample;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The number of neighbors of a point.
const NEIGHBORS: usize = 16;
/// The cosine of the largest angle between the normals of neighbors, 30°.
const MIN_COSINE: f32 = 0.866_025_4;
/// The approximate number of points whose neighbors are compared. They are evenly spaced in the sample.
const N_COMPARED: usize = 20_000;
/// The distance above and below the surface at which labels are compared, in units of the longest side.
const OFFSET: f32 = 0.005;

/// The mean fraction of the 16 nearest points with a normal within 30° that have the same label as a point (`cons_knn`).
///
/// It is computed for about 20 000 points, which are evenly spaced in the sample.
#[must_use]
pub fn cons_knn(sample: &PointSample, labels: &[u32]) -> f64 {
    let grid = Grid::new(sample);
    let step = (sample.points.len() / N_COMPARED).max(1);
    let compared: Vec<usize> = (0..sample.points.len()).step_by(step).collect();
    let fractions: Vec<Option<f64>> = compared
        .par_iter()
        .map(|&point| {
            let neighbors = grid.neighbors(point);
            let same = neighbors
                .iter()
                .filter(|&&other| labels[other] == labels[point])
                .count();
            (!neighbors.is_empty()).then(|| same as f64 / neighbors.len() as f64)
        })
        .collect();
    let n_found = fractions.iter().flatten().count();
    fractions.iter().flatten().sum::<f64>() / n_found.max(1) as f64
}

/// The fraction of points whose label is the same 0.005 of the longest side above and below the surface, averaged over both sides
/// (`cons_normal`).
#[must_use]
pub fn cons_normal(
    network: &Network,
    reference: &Reference,
    reconstruction: &Reconstruction,
) -> f64 {
    let positions = reference.in_frame(&reconstruction.sample);
    let agreeing = [1.0, -1.0].map(|side: f32| {
        let moved: Vec<[f32; 3]> = positions
            .iter()
            .zip(&reconstruction.sample.normals)
            .map(|(x, n)| std::array::from_fn(|axis| x[axis] + side * 2.0 * OFFSET * n[axis]))
            .collect();
        let labels = network.labels(&moved);
        labels
            .iter()
            .zip(&reconstruction.labels)
            .filter(|(a, b)| a == b)
            .count()
    });
    (agreeing[0] + agreeing[1]) as f64 / (2 * positions.len()).max(1) as f64
}

/// Points in cubic cells whose side is the radius in which neighbors are searched.
struct Grid<'a> {
    sample: &'a PointSample,
    cells: BTreeMap<[i32; 3], Vec<u32>>,
    side: f32,
}

impl<'a> Grid<'a> {
    fn new(sample: &'a PointSample) -> Self {
        // The area is estimated by that of the bounding box. On an area A, a disk with n of N points has the radius √(nA/πN).
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for point in &sample.points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| (high[axis] - low[axis]).max(0.0));
        let area = 2.0 * (x * y + y * z + z * x);
        let per_point = area / sample.points.len().max(1) as f32;
        let side = (2.0 * NEIGHBORS as f32 * per_point / std::f32::consts::PI)
            .sqrt()
            .max(f32::MIN_POSITIVE);
        let mut cells: BTreeMap<[i32; 3], Vec<u32>> = BTreeMap::new();
        for (idx, point) in (0..).zip(&sample.points) {
            cells.entry(cell_of(point, side)).or_default().push(idx);
        }
        Self {
            sample,
            cells,
            side,
        }
    }

    /// The nearest points with a similar normal, at most 16.
    fn neighbors(&self, point: usize) -> Vec<usize> {
        let (position, normal) = (self.sample.points[point], self.sample.normals[point]);
        let center = cell_of(&position, self.side);
        let mut found: Vec<(f32, usize)> = Vec::new();
        for offset in 0..27 {
            let cell =
                std::array::from_fn(|axis| center[axis] + offset / 3i32.pow(axis as u32) % 3 - 1);
            for &other in self.cells.get(&cell).into_iter().flatten() {
                let other = other as usize;
                let cosine: f32 = (0..3)
                    .map(|axis| normal[axis] * self.sample.normals[other][axis])
                    .sum();
                if other == point || cosine < MIN_COSINE {
                    continue;
                }
                let squared: f32 = (0..3)
                    .map(|axis| (position[axis] - self.sample.points[other][axis]).powi(2))
                    .sum();
                found.push((squared, other));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(NEIGHBORS);
        found.into_iter().map(|(_, other)| other).collect()
    }
}

fn cell_of(point: &[f32; 3], side: f32) -> [i32; 3] {
    point.map(|x| (x / side).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::cuboid;
    use crate::scores::reference_sample;

    #[test]
    fn labels_in_one_piece_agree_and_random_ones_do_not() {
        let reference = Reference::new(&cuboid([1.0, 1.0, 1.0])).unwrap();
        let sample = reference_sample(&reference, 30_000, "box", 0);
        let by_side: Vec<u32> = sample
            .triangles
            .iter()
            .map(|triangle| triangle / 2)
            .collect();
        // Neighbors have similar normals, so no neighbor is on another side.
        assert_eq!(cons_knn(&sample, &by_side), 1.0);
        let random: Vec<u32> = (0..30_000u32)
            .map(|i| i.wrapping_mul(2_654_435_761) >> 30)
            .collect();
        let found = cons_knn(&sample, &random);
        assert!((found - 0.25).abs() < 0.02, "{found}");
    }
}
