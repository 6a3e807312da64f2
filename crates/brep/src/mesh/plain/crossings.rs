//! Checks that closed walks are clean. No two of their sides may meet, except neighbors at their common corner.

use super::network::{ChartPoint, orientation};

/// A side with its extent.
#[derive(Clone, Copy)]
struct Side {
    from: u32,
    to: u32,
    low: ChartPoint,
    high: ChartPoint,
}

/// Whether no two sides of the walks cross, touch or lie on one another. Walks share no vertex.
pub(super) fn are_clean(points: &[ChartPoint], walks: &[Vec<u32>]) -> bool {
    let mut sides: Vec<Side> = walks
        .iter()
        .flat_map(|walk| sides_of(points, walk))
        .collect();
    sides.sort_unstable_by(|a, b| a.low[0].total_cmp(&b.low[0]).then(a.from.cmp(&b.from)));
    let mut open: Vec<Side> = Vec::new();
    for side in sides {
        // Sides that end before this one begins will meet none that follows.
        open.retain(|other| other.high[0] >= side.low[0]);
        if open.iter().any(|other| meet(points, side, *other)) {
            return false;
        }
        open.push(side);
    }
    true
}

fn sides_of<'a>(points: &'a [ChartPoint], walk: &'a [u32]) -> impl Iterator<Item = Side> + 'a {
    let next = walk.iter().cycle().skip(1);
    walk.iter().zip(next).map(|(&from, &to)| {
        let (a, b) = (points[from as usize], points[to as usize]);
        let low = [a[0].min(b[0]), a[1].min(b[1])];
        let high = [a[0].max(b[0]), a[1].max(b[1])];
        Side {
            from,
            to,
            low,
            high,
        }
    })
}

fn meet(points: &[ChartPoint], s: Side, t: Side) -> bool {
    if (0..2).any(|axis| s.low[axis] > t.high[axis] || t.low[axis] > s.high[axis]) {
        return false;
    }
    let at = |vertex: u32| points[vertex as usize];
    let [a, b, c, d] = [s.from, s.to, t.from, t.to].map(at);
    if s.to == t.from {
        return folds_back(a, b, d);
    }
    if s.from == t.to {
        return folds_back(c, a, b);
    }
    let is_parted = |p: f64, q: f64| (p > 0.0 && q > 0.0) || (p < 0.0 && q < 0.0);
    !is_parted(orientation(a, b, c), orientation(a, b, d))
        && !is_parted(orientation(c, d, a), orientation(c, d, b))
}

/// Whether the side from `b` to `c` runs back along the one from `a` to `b`, or one of them has no length.
fn folds_back(a: ChartPoint, b: ChartPoint, c: ChartPoint) -> bool {
    orientation(a, b, c) == 0.0
        && (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]) <= 0.0
}
