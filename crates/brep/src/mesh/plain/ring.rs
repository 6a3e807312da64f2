//! Triangulates rings: two boundaries that both run once around the origin of the chart, like the rims of a tube in a polar
//! chart.
//!
//! Any ray from the origin meets the inside in at most one piece, so counter-clockwise triangles cover the ring once.

use super::clipper::Clipper;
use super::network::{ChartPoint, Network, orientation};

const ORIGIN: ChartPoint = [0.0, 0.0];

/// Triangulates the region between two counter-clockwise walks around the origin.
pub(super) fn ring(points: &[ChartPoint], outer: &[u32], inner: &[u32]) -> Option<Network> {
    if ![outer, inner]
        .into_iter()
        .all(|walk| runs_around(points, walk))
    {
        return None;
    }
    let start = corner_in_direction(points, inner, points[*outer.first()? as usize])?;
    let mut clipper = Clipper::new(points);
    let first = clipper.add_walk(outer.iter().copied());
    let clockwise = (0..inner.len()).map(|i| inner[(start + inner.len() - i) % inner.len()]);
    let hub = clipper.add_walk(clockwise);
    // Beginning at the bridge, both rims are followed counter-clockwise until they return to it.
    let [mut out, mut within] = clipper.add_bridge(first, hub);
    while clipper.n_left() > 2 {
        let (next_out, next_within) = (clipper.next(out), clipper.before(within));
        let is_out_nearer =
            orientation(ORIGIN, clipper.point(next_out), clipper.point(next_within)) > 0.0;
        let goes_out = out != first && (is_out_nearer || within == hub);
        // If a rim has a dent, the nearer corner may give a reversed triangle.
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

/// Whether a walk always runs counter-clockwise around the origin, and runs around it once.
fn runs_around(points: &[ChartPoint], walk: &[u32]) -> bool {
    let next = walk.iter().cycle().skip(1);
    let mut sides = walk
        .iter()
        .zip(next)
        .map(|(&from, &to)| [from, to].map(|vertex| points[vertex as usize]));
    let mut n_turns = 0;
    let always = sides.all(|[from, to]| {
        n_turns += usize::from(from[1] < 0.0 && to[1] >= 0.0);
        orientation(ORIGIN, from, to) > 0.0
    });
    always && n_turns == 1
}

/// The corner of a walk whose direction from the origin is nearest to the direction of a point.
fn corner_in_direction(points: &[ChartPoint], walk: &[u32], point: ChartPoint) -> Option<usize> {
    let cosine = |&vertex: &u32| {
        let [x, y] = points[vertex as usize];
        (x * point[0] + y * point[1]) / libm::hypot(x, y)
    };
    (0..walk.len()).max_by(|&a, &b| cosine(&walk[a]).total_cmp(&cosine(&walk[b])))
}
