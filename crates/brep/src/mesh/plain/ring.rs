//! Rings: two boundaries that both run once around the origin of the chart, as the rims of a tube do in a polar one.
//!
//! Along any ray from the origin the boundaries wind around nothing or around one piece, so triangles that all run
//! counter-clockwise cover the ring once.

use super::clipper::Clipper;
use super::network::{Network, Place, turn};

const ORIGIN: Place = [0.0, 0.0];

/// Triangulates what lies between two counter-clockwise walks around the origin.
pub(super) fn ring(places: &[Place], outer: &[u32], inner: &[u32]) -> Option<Network> {
    if ![outer, inner]
        .into_iter()
        .all(|walk| runs_around(places, walk))
    {
        return None;
    }
    let start = beside(places, inner, places[*outer.first()? as usize])?;
    let mut clipper = Clipper::new(places);
    let first = clipper.add_walk(outer.iter().copied());
    let clockwise = (0..inner.len()).map(|i| inner[(start + inner.len() - i) % inner.len()]);
    let hub = clipper.add_walk(clockwise);
    // From the bridge on both rims are followed counter-clockwise until they are back at it.
    let [mut out, mut within] = clipper.add_bridge(first, hub);
    while clipper.n_left() > 2 {
        let (next_out, next_within) = (clipper.next(out), clipper.before(within));
        let is_out_nearer = turn(ORIGIN, clipper.place(next_out), clipper.place(next_within)) > 0.0;
        let goes_out = out != first && (is_out_nearer || within == hub);
        // Where a rim has a dent the nearer corner may give a triangle that is turned over.
        if goes_out && clipper.cut(out) {
            out = next_out;
        } else if within != hub && clipper.cut(within) {
            within = next_within;
        } else if out != first && clipper.cut(out) {
            out = next_out;
        } else {
            return None;
        }
    }
    clipper.finish()
}

/// Whether a walk turns counter-clockwise around the origin all the time, and does so once.
fn runs_around(places: &[Place], walk: &[u32]) -> bool {
    let next = walk.iter().cycle().skip(1);
    let mut sides = walk
        .iter()
        .zip(next)
        .map(|(&from, &to)| [from, to].map(|vertex| places[vertex as usize]));
    let mut n_turns = 0;
    let always = sides.all(|[from, to]| {
        n_turns += usize::from(from[1] < 0.0 && to[1] >= 0.0);
        turn(ORIGIN, from, to) > 0.0
    });
    always && n_turns == 1
}

/// The corner of a walk whose direction from the origin is the nearest to that of a place.
fn beside(places: &[Place], walk: &[u32], place: Place) -> Option<usize> {
    let cosine = |&vertex: &u32| {
        let [x, y] = places[vertex as usize];
        (x * place[0] + y * place[1]) / libm::hypot(x, y)
    };
    (0..walk.len()).max_by(|&a, &b| cosine(&walk[a]).total_cmp(&cosine(&walk[b])))
}
