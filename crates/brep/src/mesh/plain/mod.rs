//! Triangulates faces whose boundary is plain: one closed walk, or an outer walk with holes, whose sides do not meet.
//!
//! The result is the constrained Delaunay triangulation (L. P. Chew, *Constrained Delaunay triangulations*, Algorithmica 4,
//! 1989): first any triangulation of the polygon, then flips until no inner side can be improved. Other boundaries are refused
//! here and never repaired. The general triangulation handles them. Both give the same triangles, because with exact predicates a
//! constrained Delaunay triangulation is unique. This one neither triangulates the outside of the boundary nor searches for
//! triangles.

mod clipper;
mod crossings;
mod ears;
mod monotone;
mod network;
mod ring;
mod rows;
#[cfg(test)]
mod tests;

use network::{ChartPoint, Network, orientation};

/// A face between plain boundaries.
#[derive(Clone, Debug)]
pub(super) struct PlainFace {
    network: Network,
    /// For each walk: 1 if the face lies on its left, −1 if it lies on its right.
    pub(super) hands: Vec<f64>,
    /// The triangle at which the last vertex was inserted.
    last: usize,
}

/// A triangle that holds a point: its corners, and whether the side that begins at each corner bounds the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Holder {
    pub(super) corners: [ChartPoint; 3],
    pub(super) is_bounding: [bool; 3],
}

impl PlainFace {
    /// Triangulates a face. `points` lists the points of all walks one after the other, and `lengths` gives the number of points
    /// of each walk.
    ///
    /// Returns `None` if the boundary is not plain.
    pub(super) fn new(points: &[ChartPoint], lengths: &[usize]) -> Option<Self> {
        let is_usable = |&n: &usize| n >= 3;
        if !lengths.iter().all(is_usable) || !points.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let walks = walks(lengths);
        let senses: Vec<f64> = walks.iter().map(|walk| sense(points, walk)).collect();
        if senses.contains(&0.0) {
            return None;
        }
        // The walk that encloses all others has the lowest corner.
        let lowest =
            |walk: usize| points[walks[walk][lowest_corner(points, &walks[walk])] as usize];
        let outer =
            (0..walks.len()).reduce(|a, b| if is_lower(lowest(b), lowest(a)) { b } else { a })?;
        let hand = |walk: usize| {
            if (senses[walk] > 0.0) == (walk == outer) {
                1.0
            } else {
                -1.0
            }
        };
        let hands = (0..walks.len()).map(hand).collect();
        let mut network = triangulated(points, walks, &senses, outer)?;
        network.make_delaunay();
        Some(Self {
            network,
            hands,
            last: 0,
        })
    }

    /// The corners of each triangle, counter-clockwise.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.network.corners
    }

    /// For each point the triangle that holds it, or `None` if the point lies outside or on a side.
    pub(super) fn holders(&self, points: &[ChartPoint]) -> Vec<Option<Holder>> {
        let holder = |triangle: u32| Holder {
            corners: self.network.corner_points(triangle as usize),
            is_bounding: [0, 1, 2].map(|side| self.network.is_boundary(triangle as usize, side)),
        };
        rows::holders(&self.network, points)
            .into_iter()
            .map(|found| found.map(holder))
            .collect()
    }

    /// Inserts a vertex inside the face. It gets the next number. Returns `None` if the point is not inside.
    pub(super) fn insert(&mut self, point: ChartPoint) -> Option<()> {
        self.last = self.network.insert(point, self.last)?;
        Some(())
    }
}

/// The vertices of each walk.
fn walks(lengths: &[usize]) -> Vec<Vec<u32>> {
    let mut first = 0;
    let mut walk = |&n: &usize| {
        first += n as u32;
        (first - n as u32..first).collect()
    };
    lengths.iter().map(&mut walk).collect()
}

/// Any triangulation, found by the cheapest method that the boundary allows.
fn triangulated(
    points: &[ChartPoint],
    mut walks: Vec<Vec<u32>>,
    senses: &[f64],
    outer: usize,
) -> Option<Network> {
    for (walk, sense) in walks.iter_mut().zip(senses) {
        if *sense < 0.0 {
            walk.reverse();
        }
    }
    walks.swap(0, outer);
    let cheap = match walks.as_slice() {
        [walk] => {
            monotone::monotone(points, walk, 0).or_else(|| monotone::monotone(points, walk, 1))
        }
        [outer, inner] => ring::ring(points, outer, inner),
        _ => None,
    };
    cheap.or_else(|| {
        walks[1..].iter_mut().for_each(|hole| hole.reverse());
        ears::with_holes(points, &walks)
    })
}

/// The corner of a walk that is the lowest along the first axis. If there are several, it is the lowest of them along the second
/// axis.
fn lowest_corner(points: &[ChartPoint], walk: &[u32]) -> usize {
    let at = |corner: usize| points[walk[corner] as usize];
    (1..walk.len()).fold(0, |lowest, corner| {
        if is_lower(at(corner), at(lowest)) {
            corner
        } else {
            lowest
        }
    })
}

fn is_lower(a: ChartPoint, b: ChartPoint) -> bool {
    (a[0], a[1]) < (b[0], b[1])
}

/// Positive if a walk runs counter-clockwise, negative if it runs clockwise. If no two of its sides meet, the sign is exact,
/// however small the enclosed area is. It is 0 only if two sides lie on one another.
fn sense(points: &[ChartPoint], walk: &[u32]) -> f64 {
    let (n, lowest) = (walk.len(), lowest_corner(points, walk));
    let [a, b, c] =
        [lowest + n - 1, lowest, lowest + 1].map(|corner| points[walk[corner % n] as usize]);
    orientation(a, b, c)
}
