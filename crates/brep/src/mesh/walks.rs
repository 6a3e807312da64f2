//! Walks along edges: uses of edges in, closed walks out, and the edges whose vertices a file has exchanged.

use crate::model::{Brep, EdgeUse, Loop};
use std::borrow::Cow;

/// The edges of a loop; none of a vertex loop.
pub(crate) fn edges_of(bound: &Loop) -> Option<&Vec<EdgeUse>> {
    match bound {
        Loop::Edges(uses) => Some(uses),
        Loop::Vertex(_) => None,
    }
}

/// Whether each use begins where the one before it ends.
pub(crate) fn is_chain(brep: &Brep, uses: &[EdgeUse]) -> bool {
    let next = uses.iter().cycle().skip(1);
    uses.iter()
        .zip(next)
        .all(|(&use_, &next)| ends(brep, use_).zip(ends(brep, next)).is_some_and(|(here, there)| here.1 == there.0))
}

/// Joins uses of edges into closed walks; nothing where an end finds no continuation.
pub(crate) fn stitched(brep: &Brep, uses: Vec<EdgeUse>) -> Option<Vec<Vec<EdgeUse>>> {
    let mut left: Vec<Option<EdgeUse>> = uses.into_iter().map(Some).collect();
    let mut loops = Vec::new();
    for first in 0..left.len() {
        let Some(use_) = left[first].take() else { continue };
        let (start, mut at) = ends(brep, use_)?;
        let (mut walk, mut last, mut n_turned) = (vec![use_], first, 0);
        while at != start {
            let (index, use_) = continuation(brep, &left, last, at)?;
            n_turned += usize::from(left[index].take() != Some(use_));
            at = ends(brep, use_)?.1;
            walk.push(use_);
            last = index;
        }
        // Where most uses were turned it was the first that lies the wrong way.
        if 2 * n_turned > walk.len() {
            walk = walk.iter().rev().map(|use_| EdgeUse { forward: !use_.forward, ..*use_ }).collect();
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

/// The shape with the vertices of such edges exchanged as are turned in more loops than not.
///
/// Some writers exchange them, and then an arc is taken for the rest of its circle.
pub(crate) fn mended(brep: &Brep) -> Cow<'_, Brep> {
    let mut votes: Vec<i32> = Vec::new();
    let loops = || brep.faces.iter().flat_map(|face| face.loops.iter().filter_map(edges_of));
    for uses in loops().filter(|uses| !is_chain(brep, uses)) {
        votes.resize(brep.edges.len(), 0);
        let walks = stitched(brep, uses.clone()).unwrap_or_default();
        for walked in walks.iter().flatten() {
            let is_turned = !uses.contains(walked);
            votes[walked.edge as usize] += if is_turned { 1 } else { -1 };
        }
    }
    if votes.iter().all(|&votes| votes <= 0) {
        return Cow::Borrowed(brep);
    }
    for use_ in loops().filter(|uses| is_chain(brep, uses)).flatten() {
        votes[use_.edge as usize] -= 1;
    }
    let mut mended = brep.clone();
    for (edge, _) in mended.edges.iter_mut().zip(votes).filter(|(_, votes)| *votes > 0) {
        std::mem::swap(&mut edge.start, &mut edge.end);
    }
    Cow::Owned(mended)
}
