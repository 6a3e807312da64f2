//! Finds the edges between faces that are given as triangles.
//!
//! A side belongs to an edge if its triangles belong to several faces, or if it has only one triangle. Consecutive sides between
//! the same faces form one edge. Two points are one vertex if their coordinates are equal to the last bit. Nothing is sewn.

use crate::geometry::Curve;
use partprobe_shape::{Point, subtract};
use std::sync::Arc;

/// The triangles of one face. Their corners are numbered over all faces of the body.
pub(super) struct NumberedFace {
    pub(super) triangles: Vec<[u32; 3]>,
}

/// One edge: its vertices in walking order, and the faces that walk along it in this direction or against it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FacetEdge {
    pub(super) corners: Vec<u32>,
    pub(super) walks: Vec<FaceUse>,
}

/// The use of an edge by a face, which lies on the left of the walk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FaceUse {
    pub(super) face: u32,
    pub(super) forward: bool,
}

/// A side that bounds a face. The directions of the walks refer to the side from its lower to its higher end.
struct Side {
    ends: [u32; 2],
    walks: Vec<FaceUse>,
}

impl Side {
    /// The walks along the side, if the side is walked toward `to`.
    fn walks_to(&self, to: u32) -> Vec<FaceUse> {
        let is_reversed = to == self.ends[0];
        let mut walks = self.walks.clone();
        walks
            .iter_mut()
            .for_each(|walk| walk.forward ^= is_reversed);
        walks.sort_unstable();
        walks
    }

    fn other_end(&self, end: u32) -> u32 {
        if self.ends[0] == end {
            self.ends[1]
        } else {
            self.ends[0]
        }
    }
}

/// The edges of these faces, in the order of their lowest corners.
pub(super) fn facet_edges(faces: &[NumberedFace], n_corners: usize) -> Vec<FacetEdge> {
    let sides = bounding_sides(faces);
    let mut at_corner: Vec<Vec<u32>> = vec![Vec::new(); n_corners];
    for (index, side) in (0..).zip(&sides) {
        side.ends
            .iter()
            .for_each(|&end| at_corner[end as usize].push(index));
    }
    let mut is_taken = vec![false; sides.len()];
    let mut edges = Vec::new();
    // First the edges that have ends are walked from their ends, and then the rings from any corner.
    for is_ring in [false, true] {
        for first in 0..sides.len() {
            for begin in sides[first].ends {
                if is_taken[first]
                    || (!is_ring && continuation(&sides, &at_corner, first as u32, begin).is_some())
                {
                    continue;
                }
                edges.push(walk_from(
                    &sides,
                    &at_corner,
                    first as u32,
                    begin,
                    &mut is_taken,
                ));
            }
        }
    }
    edges.sort_by(|a, b| a.corners.cmp(&b.corners));
    edges
}

/// The curve of an edge. It is straight between the corners.
pub(super) fn curve_of(corners: &[u32], points: &[Point]) -> Arc<Curve> {
    let corner_points: Vec<Point> = corners
        .iter()
        .map(|&corner| points[corner as usize])
        .collect();
    Arc::new(match corner_points.as_slice() {
        [start, end] => Curve::Line {
            origin: *start,
            direction: subtract(*end, *start),
        },
        _ => Curve::Polyline(corner_points),
    })
}

/// The sides that bound a face, sorted by their ends.
fn bounding_sides(faces: &[NumberedFace]) -> Vec<Side> {
    let mut uses: Vec<([u32; 2], FaceUse)> = Vec::new();
    for (face, NumberedFace { triangles }) in (0..).zip(faces) {
        for &[a, b, c] in triangles {
            uses.extend([[a, b], [b, c], [c, a]].map(|[from, to]| {
                let walk = FaceUse {
                    face,
                    forward: from < to,
                };
                ([from.min(to), from.max(to)], walk)
            }));
        }
    }
    uses.sort_unstable();
    let mut sides = Vec::new();
    for uses in uses.chunk_by(|a, b| a.0 == b.0) {
        let is_inside = uses.len() > 1 && uses.iter().all(|(_, walk)| walk.face == uses[0].1.face);
        if !is_inside {
            sides.push(Side {
                ends: uses[0].0,
                walks: uses.iter().map(|(_, walk)| *walk).collect(),
            });
        }
    }
    sides
}

/// The side that continues an edge at `corner`. Returns `None` unless exactly one other side meets this one there, between the
/// same faces.
fn continuation(sides: &[Side], at_corner: &[Vec<u32>], side: u32, corner: u32) -> Option<u32> {
    let [a, b] = at_corner[corner as usize][..] else {
        return None;
    };
    let next = if a == side { b } else { a };
    let (here, there) = (&sides[side as usize], &sides[next as usize]);
    (here.walks_to(corner) == there.walks_to(there.other_end(corner))).then_some(next)
}

fn walk_from(
    sides: &[Side],
    at_corner: &[Vec<u32>],
    first: u32,
    begin: u32,
    is_taken: &mut [bool],
) -> FacetEdge {
    let mut corners = vec![begin];
    let walks = sides[first as usize].walks_to(sides[first as usize].other_end(begin));
    let mut next = Some(first);
    while let Some(side) =
        next.filter(|&side| !std::mem::replace(&mut is_taken[side as usize], true))
    {
        let corner = sides[side as usize].other_end(corners[corners.len() - 1]);
        corners.push(corner);
        next = continuation(sides, at_corner, side, corner);
    }
    FacetEdge { corners, walks }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of an edge, and its walks: a face, and whether it walks along the edge.
    type Expected<'a> = (&'a [u32], &'a [(u32, bool)]);

    #[track_caller]
    fn check(faces: &[&[[u32; 3]]], expected: &[Expected<'_>]) {
        let faces: Vec<_> = faces
            .iter()
            .map(|triangles| NumberedFace {
                triangles: triangles.to_vec(),
            })
            .collect();
        let found = facet_edges(&faces, 16);
        let walk = |&(face, forward): &(u32, bool)| FaceUse { face, forward };
        let expected: Vec<FacetEdge> = expected
            .iter()
            .map(|(corners, walks)| FacetEdge {
                corners: corners.to_vec(),
                walks: walks.iter().map(walk).collect(),
            })
            .collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn sides_in_a_row_are_one_edge() {
        // A single triangle, and a square of two triangles. The border of each is a ring.
        check(&[&[[0, 1, 2]]], &[(&[0, 1, 2, 0], &[(0, true)])]);
        check(
            &[&[[0, 1, 2], [0, 2, 3]]],
            &[(&[0, 1, 2, 3, 0], &[(0, true)])],
        );
        // Two triangles of two faces. They share the diagonal, and the rest of each border is one edge.
        let shared: Expected<'_> = (&[0, 2], &[(0, false), (1, true)]);
        check(
            &[&[[0, 1, 2]], &[[0, 2, 3]]],
            &[
                (&[0, 1, 2], &[(0, true)]),
                shared,
                (&[0, 3, 2], &[(1, false)]),
            ],
        );
    }

    #[test]
    fn triangles_of_opposite_sense_are_found_by_their_walks() {
        let shared: Expected<'_> = (&[0, 2], &[(0, false), (1, false)]);
        check(
            &[&[[0, 1, 2]], &[[0, 3, 2]]],
            &[
                (&[0, 1, 2], &[(0, true)]),
                shared,
                (&[0, 3, 2], &[(1, true)]),
            ],
        );
    }
}
