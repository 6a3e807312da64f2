//! Triangulates monotone polygons, whose two chains run from left to right: all convex ones, and most faces with four edges.
//!
//! The polygon is cut from left to right with a stack (M. R. Garey et al., *Triangulating a simple polygon*, Information
//! Processing Letters 7, 1978). A vertical line meets the inside of such a boundary in at most one piece, so counter-clockwise
//! triangles cover the inside once.

use super::clipper::Clipper;
use super::network::{ChartPoint, Network};

/// Triangulates a counter-clockwise polygon if it is monotone along the given axis.
pub(super) fn monotone(points: &[ChartPoint], walk: &[u32], axis: usize) -> Option<Network> {
    let n = walk.len();
    let at = |corner: usize| points[walk[corner % n] as usize];
    let is_before = |a: ChartPoint, b: ChartPoint| (a[axis], a[1 - axis]) < (b[axis], b[1 - axis]);
    let first = (0..n).reduce(|a, b| if is_before(at(b), at(a)) { b } else { a })?;
    let rise = (first..first + n).position(|corner| !is_before(at(corner), at(corner + 1)))?;
    let falls = (first + rise..first + n).all(|corner| is_before(at(corner + 1), at(corner)));
    if !falls {
        return None;
    }
    let mut clipper = Clipper::new(points);
    clipper.add_walk((first..first + n).map(|corner| walk[corner % n]));
    // From here on corners are counted from the first; the two chains meet again in `rise`.
    let corner_at = |corner: u32| at(first + corner as usize);
    let (last, n) = (rise as u32, n as u32);
    let (mut up, mut down) = (1, n - 1);
    let mut stack = vec![(0, true)];
    while up < last || down > last {
        let is_up = up < last && (down == last || is_before(corner_at(up), corner_at(down)));
        let corner = if is_up { up } else { down };
        if is_up {
            up += 1
        } else {
            down -= 1
        }
        match stack.last() {
            Some(&(_, top_is_up)) if top_is_up != is_up && stack.len() > 1 => {
                cut_all(&mut clipper, &stack)?;
                stack.drain(..stack.len() - 1);
            }
            _ => {
                while stack.len() > 1 && clipper.cut(stack[stack.len() - 1].0) {
                    stack.pop();
                }
            }
        }
        stack.push((corner, is_up));
    }
    cut_all(&mut clipper, &stack)?;
    clipper.finish()
}

/// Cuts off all corners of the stack but the last.
fn cut_all(clipper: &mut Clipper<'_>, stack: &[(u32, bool)]) -> Option<()> {
    stack[..stack.len() - 1]
        .iter()
        .all(|&(corner, _)| clipper.cut(corner))
        .then_some(())
}
