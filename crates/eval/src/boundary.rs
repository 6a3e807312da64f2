//! Finds the points that lie near a boundary between two reference parts.
//!
//! Points with their labels go in, and one truth value per point comes out. The mesh is not needed, so predictions of other
//! programs can be scored in the same way.

use std::collections::BTreeMap;

/// The largest distance of a point from a point of another part, as a fraction of the diagonal of the bounding box of all points.
///
/// 20 000 points on a cube are about 1 % of the diagonal apart. So a point on a boundary has several points of the other part
/// within this distance.
pub const BOUNDARY_RADIUS: f64 = 0.02;

/// Two points whose normals differ by more than 120° are on opposite sides of a thin wall, which is not a boundary.
const LEAST_COSINE: f32 = -0.5;

/// Whether a point of another part lies within [`BOUNDARY_RADIUS`] of each point.
///
/// `normals` has one unit normal per point, or is empty if they are not known. Without normals, both sides of a thin wall are
/// near each other. Points with a negative label are not near a boundary and do not make one.
///
/// # Shapes
/// - points, labels and output: `[point]`
#[must_use]
pub fn near_boundary(points: &[[f32; 3]], normals: &[[f32; 3]], labels: &[i32]) -> Vec<bool> {
    let grid = Grid::new(points);
    let has_normals = normals.len() == points.len();
    let is_same_side = |a: usize, b: usize| {
        !has_normals || {
            let cosine: f32 = normals[a].iter().zip(&normals[b]).map(|(x, y)| x * y).sum();
            cosine >= LEAST_COSINE
        }
    };
    let n_labeled = points.len().min(labels.len());
    let mut is_near = vec![false; points.len()];
    for (cell, own) in &grid.points_of_cell {
        let around: Vec<usize> = grid.around(*cell).filter(|&idx| idx < n_labeled).collect();
        let first = around.first().map(|&idx| labels[idx]);
        if around.iter().all(|&idx| Some(labels[idx]) == first) {
            continue;
        }
        for &idx in own.iter().filter(|&&idx| idx < n_labeled) {
            is_near[idx] = labels[idx] >= 0
                && around.iter().any(|&other| {
                    labels[other] >= 0
                        && labels[other] != labels[idx]
                        && grid.is_within(points[idx], points[other])
                        && is_same_side(idx, other)
                });
        }
    }
    is_near
}

/// The points by cells as wide as the radius.
struct Grid {
    radius: f64,
    low: [f64; 3],
    points_of_cell: BTreeMap<[i32; 3], Vec<usize>>,
}

impl Grid {
    fn new(points: &[[f32; 3]]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in points {
            for axis in 0..3 {
                low[axis] = low[axis].min(f64::from(point[axis]));
                high[axis] = high[axis].max(f64::from(point[axis]));
            }
        }
        let diagonal = (0..3)
            .map(|axis| (high[axis] - low[axis]).powi(2))
            .sum::<f64>()
            .sqrt();
        let mut grid = Self {
            radius: BOUNDARY_RADIUS * diagonal,
            low,
            points_of_cell: BTreeMap::new(),
        };
        for (idx, &point) in points.iter().enumerate() {
            grid.points_of_cell
                .entry(grid.cell(point))
                .or_default()
                .push(idx);
        }
        grid
    }

    fn cell(&self, point: [f32; 3]) -> [i32; 3] {
        if self.radius > 0.0 {
            [0, 1, 2].map(|axis| ((f64::from(point[axis]) - self.low[axis]) / self.radius) as i32)
        } else {
            [0; 3]
        }
    }

    /// The points of a cell and of the 26 cells around it.
    fn around(&self, [x, y, z]: [i32; 3]) -> impl Iterator<Item = usize> + '_ {
        let steps = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [dx, dy]));
        let cells =
            steps.flat_map(move |[dx, dy]| (-1..=1).map(move |dz| [x + dx, y + dy, z + dz]));
        cells
            .filter_map(|cell| self.points_of_cell.get(&cell))
            .flatten()
            .copied()
    }

    fn is_within(&self, a: [f32; 3], b: [f32; 3]) -> bool {
        let squares = a.iter().zip(b).map(|(&x, y)| f64::from(x) - f64::from(y));
        squares.map(|x| x * x).sum::<f64>() <= self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_points_close_to_the_boundary_are_near() {
        // Along a line of length 100, parts meet between 49 and 50.
        let points: Vec<[f32; 3]> = (0..=100).map(|x| [x as f32, 0.0, 0.0]).collect();
        let labels: Vec<i32> = (0..=100).map(|x| i32::from(x >= 50)).collect();
        let found = near_boundary(&points, &[], &labels);
        let near: Vec<usize> = (0..=100).filter(|&idx| found[idx]).collect();
        assert_eq!(near, [48, 49, 50, 51]);
        assert!(near_boundary(&[], &[], &[]).is_empty());
        assert_eq!(near_boundary(&[[1.0; 3]; 2], &[], &[0, 1]), [true; 2]);
        assert_eq!(near_boundary(&[[1.0; 3]; 2], &[], &[0, -1]), [false; 2]);
    }

    #[test]
    fn the_two_sides_of_a_wall_do_not_meet() {
        let points = [[0.0; 3], [0.0, 0.0, 0.01], [5.0, 5.0, 5.0]];
        let up_and_down = [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        assert_eq!(near_boundary(&points, &up_and_down, &[0, 1, 1]), [false; 3]);
        assert_eq!(near_boundary(&points, &[], &[0, 1, 1]), [true, true, false]);
    }

    proptest! {
        #[test]
        fn the_grid_finds_what_all_pairs_find(
            points in proptest::collection::vec((0.0f32..9.0, 0.0f32..1.0, -1i32..3), 1..80)
        ) {
            let labels: Vec<i32> = points.iter().map(|point| point.2).collect();
            let points: Vec<[f32; 3]> = points.iter().map(|&(x, y, _)| [x, y, 0.0]).collect();
            let found = near_boundary(&points, &[], &labels);
            let grid = Grid::new(&points);
            for (idx, &is_near) in found.iter().enumerate() {
                let expected = (0..points.len()).any(|other| {
                    labels[idx] >= 0 && labels[other] >= 0 && labels[idx] != labels[other]
                        && grid.is_within(points[idx], points[other])
                });
                prop_assert_eq!(is_near, expected);
            }
        }
    }
}
