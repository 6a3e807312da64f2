//! The boundary of a face as closed polygons of space: its loops and the edges' points in, polygons out that
//! keep the face on their left against the *surface* normal.
//!
//! Edges that the face uses in both directions (seams, slits) bound nothing: they are left out, and what
//! remains is joined again vertex by vertex. Files with and without seams become one case.

use super::edge_points::EdgePoints;
use crate::model::{Brep, BrepFace, EdgeUse, Loop};
use carrier::Point;

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

/// A corner of a boundary polygon and the piece of curve that leads to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BoundaryPoint {
    /// Its place.
    pub(crate) point: Point,
    /// The curve that the polygon's next side stands for.
    pub(crate) segment: Segment,
}

/// What bounds a face.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct BoundingLoops {
    /// Closed walks along edges, without seams and slits.
    pub(crate) loops: Vec<Vec<EdgeUse>>,
    /// The edges that were left out: they lie inside the face.
    pub(crate) seams: Vec<u32>,
}

/// Finds the walks that bound a face.
pub(crate) fn bounding_loops(brep: &Brep, face: &BrepFace) -> BoundingLoops {
    let loops: Vec<&Vec<EdgeUse>> = face.loops.iter().filter_map(edges_of).collect();
    let seams = used_both_ways(&loops);
    let mut kept = Vec::with_capacity(loops.len());
    for uses in loops {
        let has_seam = uses.iter().any(|use_| seams.binary_search(&use_.edge).is_ok());
        if !has_seam && is_chain(brep, uses) {
            kept.push(uses.clone());
            continue;
        }
        let rest = uses.iter().filter(|use_| seams.binary_search(&use_.edge).is_err()).copied().collect();
        match stitched(brep, rest) {
            Some(stitched) => kept.extend(stitched),
            None => kept.push(uses.clone()),
        }
    }
    kept.retain(|uses| !uses.is_empty());
    BoundingLoops { loops: kept, seams }
}

/// Whether each use begins where the one before it ends.
fn is_chain(brep: &Brep, uses: &[EdgeUse]) -> bool {
    let next = uses.iter().cycle().skip(1);
    uses.iter()
        .zip(next)
        .all(|(&use_, &next)| ends(brep, use_).zip(ends(brep, next)).is_some_and(|(here, there)| here.1 == there.0))
}

fn edges_of(bound: &Loop) -> Option<&Vec<EdgeUse>> {
    match bound {
        Loop::Edges(uses) => Some(uses),
        Loop::Vertex(_) => None,
    }
}

/// The edges that a face walks in both directions, sorted.
fn used_both_ways(loops: &[&Vec<EdgeUse>]) -> Vec<u32> {
    let mut walks: Vec<(u32, bool)> = loops.iter().flat_map(|uses| uses.iter()).map(|u| (u.edge, u.forward)).collect();
    walks.sort_unstable();
    let opposite = walks.windows(2).filter(|pair| pair[0].0 == pair[1].0 && pair[0].1 != pair[1].1);
    let mut edges: Vec<u32> = opposite.map(|pair| pair[0].0).collect();
    edges.dedup();
    edges
}

/// Joins uses of edges into closed walks; nothing where an end finds no continuation.
fn stitched(brep: &Brep, uses: Vec<EdgeUse>) -> Option<Vec<Vec<EdgeUse>>> {
    let mut left: Vec<Option<EdgeUse>> = uses.into_iter().map(Some).collect();
    let mut loops = Vec::new();
    for first in 0..left.len() {
        let Some(use_) = left[first].take() else { continue };
        let (start, mut at) = ends(brep, use_)?;
        let (mut walk, mut last) = (vec![use_], first);
        while at != start {
            let (index, use_) = continuation(brep, &left, last, at)?;
            left[index] = None;
            at = ends(brep, use_)?.1;
            walk.push(use_);
            last = index;
        }
        loops.push(walk);
    }
    Some(loops)
}

/// The next use in the loop's own order that leaves vertex `at`. Files exist whose flags turn an edge of a
/// loop the wrong way: only if no use begins there, one that ends there is turned.
fn continuation(brep: &Brep, left: &[Option<EdgeUse>], last: usize, at: u32) -> Option<(usize, EdgeUse)> {
    let candidates = || {
        let order = (1..=left.len()).map(|step| (last + step) % left.len());
        order.filter_map(|i| left[i].map(|use_| (i, use_)))
    };
    let begins_here = |(_, use_): &(usize, EdgeUse)| ends(brep, *use_).is_some_and(|ends| ends.0 == at);
    let turned = |(i, use_): (usize, EdgeUse)| (i, EdgeUse { forward: !use_.forward, ..use_ });
    candidates().find(begins_here).or_else(|| candidates().map(turned).find(begins_here))
}

/// The vertices at which a use of an edge begins and ends.
fn ends(brep: &Brep, use_: EdgeUse) -> Option<(u32, u32)> {
    let edge = brep.edges.get(use_.edge as usize)?;
    Some(if use_.forward { (edge.start, edge.end) } else { (edge.end, edge.start) })
}

/// The polygon of a loop; `against` walks it backwards. Nothing where an edge has no points.
pub(crate) fn polygon(uses: &[EdgeUse], edges: &[Option<EdgePoints>], against: bool) -> Option<Vec<BoundaryPoint>> {
    let mut corners = Vec::new();
    let mut walk = |use_: &EdgeUse| {
        let EdgePoints { parameters, points } = edges.get(use_.edge as usize)?.as_ref()?;
        let last = points.len().checked_sub(1)?;
        let forward = use_.forward != against;
        corners.extend((0..last).map(|i| {
            let (here, next) = if forward { (i, i + 1) } else { (last - i, last - i - 1) };
            let segment = Segment { edge: use_.edge, from: parameters[here], to: parameters[next] };
            BoundaryPoint { point: points[here], segment }
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
