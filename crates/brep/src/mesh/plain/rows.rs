//! Finds the triangles that contain many points at once.
//!
//! The points are sorted into rows, and each triangle looks only at the pieces of the rows that it covers.

use super::network::{ChartPoint, Network, orientation};

/// A piece of a row is extended beyond a triangle's sides by this fraction of its width, because the sides are computed with
/// rounding.
const SLACK: f64 = 1e-9;

/// For each point the triangle in whose interior it lies.
pub(super) fn holders(network: &Network, points: &[ChartPoint]) -> Vec<Option<u32>> {
    let mut holders = vec![None; points.len()];
    let rows = Rows::new(points);
    for triangle in 0..network.corners.len() {
        let corners = network.corner_points(triangle);
        rows.for_each_near(corners, |index| {
            if holders[index].is_none() && is_inside(corners, points[index]) {
                holders[index] = Some(triangle as u32);
            }
        });
    }
    holders
}

fn is_inside([a, b, c]: [ChartPoint; 3], p: ChartPoint) -> bool {
    orientation(a, b, p) > 0.0 && orientation(b, c, p) > 0.0 && orientation(c, a, p) > 0.0
}

/// Points by rows. Each row is sorted from left to right.
struct Rows {
    low: f64,
    height: f64,
    rows: Vec<Vec<(f64, usize)>>,
}

impl Rows {
    fn new(points: &[ChartPoint]) -> Self {
        let heights = || points.iter().map(|point| point[1]);
        let (low, high) = (
            heights().fold(f64::INFINITY, f64::min),
            heights().fold(f64::NEG_INFINITY, f64::max),
        );
        let n = ((points.len() as f64).sqrt() as usize).max(1);
        let height = if high > low {
            (high - low) / n as f64
        } else {
            1.0
        };
        let mut rows = Self {
            low,
            height,
            rows: vec![Vec::new(); n],
        };
        for (index, &[x, y]) in points.iter().enumerate() {
            let row = rows.row(y);
            rows.rows[row].push((x, index));
        }
        rows.rows
            .iter_mut()
            .for_each(|row| row.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))));
        rows
    }

    fn row(&self, y: f64) -> usize {
        // The conversion to an integer saturates, so any height has a row.
        (((y - self.low) / self.height) as usize).min(self.rows.len() - 1)
    }

    /// Visits the points that may lie in a triangle.
    fn for_each_near(&self, corners: [ChartPoint; 3], mut visit: impl FnMut(usize)) {
        let ys = corners.map(|corner| corner[1]);
        let (low, high) = (ys[0].min(ys[1]).min(ys[2]), ys[0].max(ys[1]).max(ys[2]));
        for row in self.row(low)..=self.row(high) {
            let base = self.low + row as f64 * self.height;
            let Some([left, right]) = extent_within(corners, [base, base + self.height]) else {
                continue;
            };
            let row = &self.rows[row];
            let first = row.partition_point(|&(x, _)| x < left);
            row[first..]
                .iter()
                .take_while(|&&(x, _)| x <= right)
                .for_each(|&(_, index)| visit(index));
        }
    }
}

/// The extent of a triangle between two heights, slightly enlarged. Returns `None` if the triangle does not reach there.
fn extent_within(corners: [ChartPoint; 3], [low, high]: [f64; 2]) -> Option<[f64; 2]> {
    let slack = SLACK * (high - low);
    let (low, high) = (low - slack, high + slack);
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (a, b) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        if a[1] > high || b[1] < low {
            continue;
        }
        let at = |y: f64| {
            if b[1] > a[1] {
                a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1]))
            } else {
                b[0]
            }
        };
        for x in [
            if a[1] < low { at(low) } else { a[0] },
            if b[1] > high { at(high) } else { b[0] },
        ] {
            (left, right) = (left.min(x), right.max(x));
        }
    }
    let slack = SLACK * (right - left + slack);
    (left <= right).then_some([left - slack, right + slack])
}
