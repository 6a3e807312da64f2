//! Keeps a grid of points on a B-spline surface, from which searches for the nearest point start.

use super::nearest::squared;
use super::types::BsplineSurface;
use partprobe_shape::{Point, bounding_diagonal, cross, subtract};

/// Number of grid points from which the Gauss–Newton method starts.
const STARTS: usize = 5;

/// Number of cells of the grid from whose middles it starts again if the first searches failed.
const CELLS: usize = 8;

/// Largest number of grid points along one direction.
const MAX_GRID: usize = 160;

pub(super) struct Grid {
    pub(super) u: Vec<f64>,
    pub(super) v: Vec<f64>,
    /// `points[i * v.len() + j]`.
    pub(super) points: Vec<Point>,
    /// The diagonal of the bounding box of the points.
    pub(super) size: f64,
}

impl Grid {
    pub(super) fn of(spline: &BsplineSurface) -> Self {
        let [u, v] = spline.breaks().map(|breaks| grid_lines(&breaks));
        let points: Vec<Point> = u
            .iter()
            .flat_map(|&u| v.iter().map(move |&v| spline.derivatives(u, v).0))
            .collect();
        let size = bounding_diagonal(&points);
        Self { u, v, points, size }
    }

    /// The middles of the cells whose boxes are nearest to `p`, the nearest first. Cells without an extent are left out.
    pub(super) fn cells_near(&self, p: Point) -> Vec<[f64; 2]> {
        let n_v = self.v.len();
        let mut cells = Vec::new();
        for i in 1..self.u.len() {
            for j in 1..n_v {
                let corners = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)]
                    .map(|(i, j)| self.points[i * n_v + j]);
                let [a, b, c, d] = corners;
                if cross(subtract(c, a), subtract(d, b)) == [0.0; 3] {
                    continue;
                }
                let outside = [0, 1, 2].map(|axis| {
                    let low = corners
                        .iter()
                        .map(|corner| corner[axis])
                        .fold(f64::INFINITY, f64::min);
                    let high = corners
                        .iter()
                        .map(|corner| corner[axis])
                        .fold(f64::NEG_INFINITY, f64::max);
                    (low - p[axis]).max(p[axis] - high).max(0.0)
                });
                let middle = [0, 1, 2].map(|axis| 0.25 * (a[axis] + b[axis] + c[axis] + d[axis]));
                let order = (squared(outside), squared(subtract(middle, p)));
                cells.push((
                    order,
                    [(i - 1, &self.u), (j - 1, &self.v)]
                        .map(|(k, lines)| 0.5 * (lines[k] + lines[k + 1])),
                ));
            }
        }
        cells.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        cells.into_iter().take(CELLS).map(|(_, uv)| uv).collect()
    }

    /// The grid points that are nearer to `p` than their neighbors, nearest first.
    pub(super) fn starts(&self, p: Point) -> Vec<[f64; 2]> {
        let (n_u, n_v) = (self.u.len(), self.v.len());
        let gaps: Vec<f64> = self
            .points
            .iter()
            .map(|&point| squared(subtract(point, p)))
            .collect();
        let gap = |i: usize, j: usize| gaps[i * n_v + j];
        let mut minima = Vec::new();
        for i in 0..n_u {
            for j in 0..n_v {
                let here = gap(i, j);
                let beside_u =
                    (i == 0 || here <= gap(i - 1, j)) && (i + 1 == n_u || here <= gap(i + 1, j));
                let beside_v =
                    (j == 0 || here <= gap(i, j - 1)) && (j + 1 == n_v || here <= gap(i, j + 1));
                if beside_u && beside_v {
                    minima.push((here, [self.u[i], self.v[j]]));
                }
            }
        }
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
        minima.into_iter().take(STARTS).map(|(_, uv)| uv).collect()
    }
}

/// Parameters between the knots. A spline with few spans gets many per span. The number is limited to [`MAX_GRID`].
fn grid_lines(breaks: &[f64]) -> Vec<f64> {
    let spans = breaks.len() - 1;
    let per_span = if spans <= 3 {
        6
    } else if spans <= 16 {
        3
    } else {
        2
    };
    let steps = (spans * per_span).min(MAX_GRID);
    let at = |i: usize| {
        let position = (i * spans) as f64 / steps as f64;
        let span = (position as usize).min(spans - 1);
        breaks[span] + (breaks[span + 1] - breaks[span]) * (position - span as f64)
    };
    (0..=steps).map(at).collect()
}
