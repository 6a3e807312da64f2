//! Exchanges the vertices of edges that a file gives in the wrong order, and joins uses of edges to closed walks.

use crate::geometry::{Curve, Surface, trim};
use crate::model::{Brep, BrepFace, EdgeUse, Loop};
use std::borrow::Cow;
use std::f64::consts::PI;

/// The edges of a loop. Returns `None` for a vertex loop.
pub(crate) fn edges_of(bound: &Loop) -> Option<&Vec<EdgeUse>> {
    match bound {
        Loop::Edges(uses) => Some(uses),
        Loop::Vertex(_) => None,
    }
}

/// Whether each use begins where the previous one ends.
pub(crate) fn is_chain(brep: &Brep, uses: &[EdgeUse]) -> bool {
    let next = uses.iter().cycle().skip(1);
    uses.iter().zip(next).all(|(&use_, &next)| {
        ends(brep, use_)
            .zip(ends(brep, next))
            .is_some_and(|(here, there)| here.1 == there.0)
    })
}

/// Joins uses of edges into closed walks. Returns `None` if a walk cannot be continued.
pub(crate) fn stitched(brep: &Brep, uses: Vec<EdgeUse>) -> Option<Vec<Vec<EdgeUse>>> {
    let mut left: Vec<Option<EdgeUse>> = uses.into_iter().map(Some).collect();
    let mut loops = Vec::new();
    for first in 0..left.len() {
        let Some(use_) = left[first].take() else {
            continue;
        };
        let (start, mut at) = ends(brep, use_)?;
        let (mut walk, mut last, mut n_reversed) = (vec![use_], first, 0);
        while at != start {
            let (index, use_) = continuation(brep, &left, last, at)?;
            n_reversed += usize::from(left[index].take() != Some(use_));
            at = ends(brep, use_)?.1;
            walk.push(use_);
            last = index;
        }
        // If most uses were reversed, the first use has the wrong direction.
        if 2 * n_reversed > walk.len() {
            walk = walk
                .iter()
                .rev()
                .map(|use_| EdgeUse {
                    forward: !use_.forward,
                    ..*use_
                })
                .collect();
        }
        loops.push(walk);
    }
    Some(loops)
}

/// The loop in its own order, with some uses reversed so that each begins where the previous one ends. Returns `None` if the loop
/// does not close.
fn in_order(brep: &Brep, uses: &[EdgeUse]) -> Option<Vec<EdgeUse>> {
    let reversed = |use_: EdgeUse| EdgeUse {
        forward: !use_.forward,
        ..use_
    };
    let walk_from = |first: EdgeUse| {
        let (start, mut at) = ends(brep, first)?;
        let mut walk = vec![first];
        for &use_ in &uses[1..] {
            let fits = |use_: EdgeUse| ends(brep, use_).is_some_and(|ends| ends.0 == at);
            let use_ = [use_, reversed(use_)]
                .into_iter()
                .find(|&use_| fits(use_))?;
            at = ends(brep, use_)?.1;
            walk.push(use_);
        }
        (at == start).then_some(walk)
    };
    let first = *uses.first()?;
    let n_reversed = |walk: &Vec<EdgeUse>| walk.iter().zip(uses).filter(|(a, b)| a != b).count();
    [first, reversed(first)]
        .into_iter()
        .filter_map(walk_from)
        .min_by_key(n_reversed)
}

/// The next use in the loop's own order that begins at vertex `at`. In some files, the flag of an edge has the wrong sense. So if
/// no use begins there, a use that ends there is reversed.
fn continuation(
    brep: &Brep,
    left: &[Option<EdgeUse>],
    last: usize,
    at: u32,
) -> Option<(usize, EdgeUse)> {
    let candidates = || {
        let order = (1..=left.len()).map(|step| (last + step) % left.len());
        order.filter_map(|i| left[i].map(|use_| (i, use_)))
    };
    let begins_here =
        |(_, use_): &(usize, EdgeUse)| ends(brep, *use_).is_some_and(|ends| ends.0 == at);
    let reversed = |(i, use_): (usize, EdgeUse)| {
        (
            i,
            EdgeUse {
                forward: !use_.forward,
                ..use_
            },
        )
    };
    candidates()
        .find(begins_here)
        .or_else(|| candidates().map(reversed).find(begins_here))
}

/// The vertices at which a use of an edge begins and ends.
fn ends(brep: &Brep, use_: EdgeUse) -> Option<(u32, u32)> {
    let edge = brep.edges.get(use_.edge as usize)?;
    Some(if use_.forward {
        (edge.start, edge.end)
    } else {
        (edge.end, edge.start)
    })
}

/// The shape, with the two vertices of an edge exchanged if more loops contradict the direction of the edge than agree with it.
///
/// Some writers exchange the vertices, and then an arc is read as the rest of its circle. If the loops do not decide, the
/// vertices of an arc of more than half a turn are exchanged.
pub(crate) fn repaired(brep: &Brep) -> Cow<'_, Brep> {
    let mut votes: Vec<i32> = Vec::new();
    let mut is_contested: Vec<bool> = Vec::new();
    // The loops around triangles were made by this program, so they say nothing about the file.
    let is_written = |face: &&BrepFace| !matches!(*face.surface, Surface::Facets(_));
    let loops = || {
        brep.faces
            .iter()
            .filter(is_written)
            .flat_map(|face| face.loops.iter().filter_map(edges_of))
    };
    for uses in loops().filter(|uses| !is_chain(brep, uses)) {
        votes.resize(brep.edges.len(), 0);
        is_contested.resize(brep.edges.len(), false);
        for use_ in uses {
            is_contested[use_.edge as usize] = true;
        }
        for walked in walked(brep, uses) {
            votes[walked.edge as usize] += if uses.contains(&walked) { -1 } else { 1 };
        }
    }
    if !is_contested.contains(&true) {
        return Cow::Borrowed(brep);
    }
    for use_ in loops().filter(|uses| is_chain(brep, uses)).flatten() {
        votes[use_.edge as usize] -= 1;
    }
    let is_exchanged = |edge: usize| {
        votes[edge] > 0 || (votes[edge] == 0 && is_contested[edge] && is_long_arc(brep, edge))
    };
    let exchanged: Vec<usize> = (0..votes.len())
        .filter(|&edge| is_exchanged(edge))
        .collect();
    if exchanged.is_empty() {
        return Cow::Borrowed(brep);
    }
    let mut repaired = brep.clone();
    for edge in exchanged {
        let edge = &mut repaired.edges[edge];
        std::mem::swap(&mut edge.start, &mut edge.end);
    }
    Cow::Owned(repaired)
}

/// The uses of a loop that is not a chain, joined end to end: in the order of the file, or else in any order. The result is empty
/// if the loop is a chain when it is read backwards, or if it has only two edges and the sense is open.
fn walked(brep: &Brep, uses: &[EdgeUse]) -> Vec<EdgeUse> {
    let is_backwards = is_chain(brep, &uses.iter().rev().copied().collect::<Vec<_>>());
    if uses.len() < 3 || is_backwards {
        return Vec::new();
    }
    in_order(brep, uses)
        .or_else(|| stitched(brep, uses.to_vec()).map(|walks| walks.concat()))
        .unwrap_or_default()
}

/// Whether an edge takes more than half a turn of a conic.
fn is_long_arc(brep: &Brep, edge: usize) -> bool {
    let edge = &brep.edges[edge];
    let (start, end) = trim(edge, &brep.vertices);
    matches!(*edge.curve, Curve::Ellipse { .. })
        && edge.start != edge.end
        && (end - start).abs() > PI
}
