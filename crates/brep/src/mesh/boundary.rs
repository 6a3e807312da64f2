//! Makes closed polygons of the loops of a face, with the face on their left as seen against the *surface* normal.
//!
//! Edges that the face uses in both directions (seams, slits) bound nothing. They are left out, and the remaining edges are
//! joined again at their vertices. So files with and without seams are treated alike.

use super::edge_points::EdgePoints;
use super::repaired::{edges_of, is_chain, stitched};
use crate::model::{Brep, BrepFace, EdgeUse};
use partprobe_shape::Point;

/// A piece of an edge's curve, between two parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    /// Index of the edge.
    pub(crate) edge: u32,
    /// Parameter where the piece begins.
    pub(crate) from: f64,
    /// Parameter where it ends.
    pub(crate) to: f64,
}

/// A corner of a boundary polygon, and the piece of curve that leads to the next corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundaryPoint {
    /// Its position.
    pub(crate) point: Point,
    /// The piece of curve that the polygon's next side replaces.
    pub(crate) segment: Segment,
}

/// The boundary of a face.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoundingLoops {
    /// Closed walks along edges, without seams and slits.
    pub(crate) loops: Vec<Vec<EdgeUse>>,
    /// The edges that were left out because they lie inside the face.
    pub(crate) seams: Vec<u32>,
}

/// The polygon in the opposite direction.
pub(crate) fn reversed(polygon: &[BoundaryPoint]) -> Vec<BoundaryPoint> {
    let n = polygon.len();
    let reversed_point = |i: usize| {
        let Segment { edge, from, to } = polygon[(i + n - 1) % n].segment;
        BoundaryPoint {
            segment: Segment {
                edge,
                from: to,
                to: from,
            },
            ..polygon[i]
        }
    };
    (0..n).rev().map(reversed_point).collect()
}

/// Finds the walks that bound a face.
pub(crate) fn bounding_loops(brep: &Brep, face: &BrepFace) -> BoundingLoops {
    let loops: Vec<&Vec<EdgeUse>> = face.loops.iter().filter_map(edges_of).collect();
    let seams = used_both_ways(&loops);
    let mut kept = Vec::with_capacity(loops.len());
    for uses in loops {
        let has_seam = uses
            .iter()
            .any(|use_| seams.binary_search(&use_.edge).is_ok());
        if !has_seam && is_chain(brep, uses) {
            kept.push(uses.clone());
            continue;
        }
        let rest = uses
            .iter()
            .filter(|use_| seams.binary_search(&use_.edge).is_err())
            .copied()
            .collect();
        match stitched(brep, rest) {
            Some(stitched) => kept.extend(stitched),
            None => kept.push(uses.clone()),
        }
    }
    kept.retain(|uses| !uses.is_empty());
    BoundingLoops { loops: kept, seams }
}

/// The edges that a face walks in both directions, sorted.
fn used_both_ways(loops: &[&Vec<EdgeUse>]) -> Vec<u32> {
    let mut walks: Vec<(u32, bool)> = loops
        .iter()
        .flat_map(|uses| uses.iter())
        .map(|u| (u.edge, u.forward))
        .collect();
    walks.sort_unstable();
    let opposite = walks
        .windows(2)
        .filter(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1);
    let mut edges: Vec<u32> = opposite.map(|pair| pair[0].0).collect();
    edges.dedup();
    edges
}

/// The polygon of a loop, in the opposite direction if `against` is set. Returns `None` if an edge has no points.
pub(crate) fn polygon(
    uses: &[EdgeUse],
    edges: &[Option<EdgePoints>],
    against: bool,
) -> Option<Vec<BoundaryPoint>> {
    let n_points = |use_: &EdgeUse| {
        edges
            .get(use_.edge as usize)?
            .as_ref()
            .map(|edge| edge.points.len())
    };
    let mut corners = Vec::with_capacity(uses.iter().filter_map(n_points).sum());
    let mut walk = |use_: &EdgeUse| {
        let EdgePoints { parameters, points } = edges.get(use_.edge as usize)?.as_ref()?;
        let last = points.len().checked_sub(1)?;
        let forward = use_.forward != against;
        corners.extend((0..last).map(|i| {
            let (here, next) = if forward {
                (i, i + 1)
            } else {
                (last - i, last - i - 1)
            };
            let segment = Segment {
                edge: use_.edge,
                from: parameters[here],
                to: parameters[next],
            };
            BoundaryPoint {
                point: points[here],
                segment,
            }
        }));
        Some(())
    };
    if against {
        uses.iter().rev().try_for_each(&mut walk)?;
    } else {
        uses.iter().try_for_each(&mut walk)?;
    }
    Some(corners)
}
