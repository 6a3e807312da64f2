//! The triangulation of faces with plain boundaries: closed walks in the chart in, a constrained Delaunay triangulation out.
//!
//! Plain is a boundary that is one walk or an outer one with holes, of which no two sides meet. Everything else is refused
//! here, never mended: the general triangulation takes it. Both give the same triangles, as exact predicates leave a
//! constrained Delaunay triangulation no choice; this one does without the outside of the boundary and without a search.

mod clipper;
mod crossings;
mod ears;
mod monotone;
mod network;
mod ring;
mod rows;
#[cfg(test)]
mod tests;

use network::{Network, Place};

/// A face between plain boundaries.
#[derive(Clone, Debug)]
pub(super) struct PlainFace {
    network: Network,
    /// For each walk 1 if the face lies on its left, −1 if it lies on its right.
    pub(super) hands: Vec<f64>,
    /// The triangle at which the last vertex was inserted.
    last: usize,
}

/// A triangle that holds a place: its corners, and for each side that begins there whether it bounds the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Holder {
    pub(super) corners: [Place; 3],
    pub(super) is_bounding: [bool; 3],
}

impl PlainFace {
    /// Triangulates a face; the walks go through the places one after the other, each with this many of them.
    ///
    /// Returns `None` if the boundary is not plain.
    pub(super) fn new(places: &[Place], lengths: &[usize]) -> Option<Self> {
        let is_usable = |&n: &usize| n >= 3;
        if !lengths.iter().all(is_usable) || !places.iter().flatten().all(|x| x.is_finite()) {
            return None;
        }
        let walks = walks(lengths);
        let areas: Vec<f64> = walks.iter().map(|walk| signed_area(places, walk)).collect();
        let outer = (0..walks.len()).max_by(|&a, &b| areas[a].abs().total_cmp(&areas[b].abs()))?;
        let hand = |walk: usize| if (areas[walk] > 0.0) == (walk == outer) { 1.0 } else { -1.0 };
        let hands = (0..walks.len()).map(hand).collect();
        let mut network = triangulated(places, walks, &areas, outer)?;
        network.make_delaunay();
        Some(Self { network, hands, last: 0 })
    }

    /// The corners of each triangle, counter-clockwise.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.network.corners
    }

    /// The triangle that holds each of these places; none for a place outside or on a side.
    pub(super) fn holders(&self, places: &[Place]) -> Vec<Option<Holder>> {
        let holder = |triangle: u32| Holder {
            corners: self.network.corner_places(triangle as usize),
            is_bounding: [0, 1, 2].map(|side| self.network.is_boundary(triangle as usize, side)),
        };
        rows::holders(&self.network, places).into_iter().map(|found| found.map(holder)).collect()
    }

    /// Inserts a vertex inside; it gets the next number. Returns `None` if the place is not inside.
    pub(super) fn insert(&mut self, place: Place) -> Option<()> {
        self.last = self.network.insert(place, self.last)?;
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

/// Some triangulation, by the cheapest way that the boundary allows.
fn triangulated(places: &[Place], mut walks: Vec<Vec<u32>>, areas: &[f64], outer: usize) -> Option<Network> {
    for (walk, area) in walks.iter_mut().zip(areas) {
        if *area < 0.0 {
            walk.reverse();
        }
    }
    walks.swap(0, outer);
    let cheap = match walks.as_slice() {
        [walk] => monotone::monotone(places, walk, 0).or_else(|| monotone::monotone(places, walk, 1)),
        [outer, inner] => ring::ring(places, outer, inner),
        _ => None,
    };
    cheap.or_else(|| {
        walks[1..].iter_mut().for_each(|hole| hole.reverse());
        ears::with_holes(places, &walks)
    })
}

fn signed_area(places: &[Place], walk: &[u32]) -> f64 {
    let start = places[walk[0] as usize];
    let arm = |vertex: u32| [0, 1].map(|axis| places[vertex as usize][axis] - start[axis]);
    let doubled = |pair: &[u32]| {
        let [a, b] = [arm(pair[0]), arm(pair[1])];
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * walk.windows(2).map(doubled).sum::<f64>()
}
