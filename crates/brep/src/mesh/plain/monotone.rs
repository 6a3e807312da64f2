//! Triangulates monotone polygons, whose two chains run from left to right. All convex polygons are monotone, and so are most
//! faces with four edges.
//!
//! The polygon is cut from left to right with a stack (M. R. Garey et al., *Triangulating a simple polygon*, Information
//! Processing Letters 7, 1978). A vertical line meets the inside of such a boundary in at most one piece, so counter-clockwise
//! triangles cover the inside once.

use super::clipper::Clipper;
use super::network::{ChartPoint, Network};

/// Triangulates a counter-clockwise polygon if it is monotone along the given axis.
pub(super) fn monotone(points: &[ChartPoint], walk: &[u32], axis: usize) -> Option<Network> {
    let chains = Chains::of(points, walk, axis)?;
    let n = walk.len();
    let mut clipper = Clipper::new(points);
    clipper.add_walk((chains.first..chains.first + n).map(|corner| walk[corner % n]));
    let mut stack = vec![(0, true)];
    let mut open = [1, n as u32 - 1];
    while let Some((corner, is_up)) = chains.next_corner(&mut open) {
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

/// The two chains of a monotone polygon. Corners are counted from the first one. The chains meet again in `last`.
struct Chains<'a> {
    points: &'a [ChartPoint],
    walk: &'a [u32],
    axis: usize,
    /// The index of the first corner in the walk.
    first: usize,
    last: u32,
}

impl<'a> Chains<'a> {
    /// Returns `None` if the polygon is not monotone along the axis.
    fn of(points: &'a [ChartPoint], walk: &'a [u32], axis: usize) -> Option<Self> {
        let n = walk.len();
        let mut chains = Self {
            points,
            walk,
            axis,
            first: 0,
            last: 0,
        };
        chains.first = (0..n).reduce(|a, b| if chains.is_before(b, a) { b } else { a })?;
        let rise = (0..n).position(|corner| !chains.is_before(corner, corner + 1))?;
        let falls = (rise..n).all(|corner| chains.is_before(corner + 1, corner));
        chains.last = rise as u32;
        falls.then_some(chains)
    }

    fn at(&self, corner: usize) -> ChartPoint {
        self.points[self.walk[(self.first + corner) % self.walk.len()] as usize]
    }

    fn is_before(&self, a: usize, b: usize) -> bool {
        let (a, b) = (self.at(a), self.at(b));
        let other = 1 - self.axis;
        (a[self.axis], a[other]) < (b[self.axis], b[other])
    }

    /// Takes the next corner from left to right, and says whether it is on the chain that begins at the first corner. `open`
    /// holds the next corner of either chain.
    fn next_corner(&self, [up, down]: &mut [u32; 2]) -> Option<(u32, bool)> {
        if *up >= self.last && *down <= self.last {
            return None;
        }
        let is_up =
            *up < self.last && (*down == self.last || self.is_before(*up as usize, *down as usize));
        if is_up {
            *up += 1;
            Some((*up - 1, true))
        } else {
            *down -= 1;
            Some((*down + 1, false))
        }
    }
}

/// Cuts off all corners of the stack except the last.
fn cut_all(clipper: &mut Clipper<'_>, stack: &[(u32, bool)]) -> Option<()> {
    stack[..stack.len() - 1]
        .iter()
        .all(|&(corner, _)| clipper.cut(corner))
        .then_some(())
}
