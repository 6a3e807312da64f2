//! Cuts corners off a polygon one by one. Each cut is a triangle that knows its neighbors.
//!
//! Every triangulation of a polygon without further vertices is a sequence of such cuts. A cut whose triangle is not
//! counter-clockwise by an exact predicate is refused. So after all cuts, the triangles cover each point as often as the boundary
//! winds around it.

use super::network::{
    ChartPoint, NOTHING, Network, SideRef, orientation, side_ref, triangle_and_side,
};

/// This bit is set in the mark of a side that belongs to a bridge.
const BRIDGE: u32 = 1 << 31;

/// A polygon that is being cut up. Its corners are numbered. Where a bridge joins two boundaries, each end of the bridge has two
/// corners.
pub(super) struct Clipper<'a> {
    points: &'a [ChartPoint],
    /// The vertex of each corner.
    vertex: Vec<u32>,
    before: Vec<u32>,
    next: Vec<u32>,
    /// What lies behind the side from each corner to the next: a triangle's side, a bridge or [`NOTHING`].
    behind: Vec<SideRef>,
    /// For each bridge the triangle's side that was the first to reach it, or [`NOTHING`].
    bridges: Vec<SideRef>,
    n_left: usize,
    corners: Vec<[u32; 3]>,
    sides: Vec<[SideRef; 3]>,
}

impl<'a> Clipper<'a> {
    /// A polygon without corners, over these vertices.
    pub(super) fn new(points: &'a [ChartPoint]) -> Self {
        let n = points.len();
        Self {
            points,
            vertex: Vec::with_capacity(n),
            before: Vec::with_capacity(n),
            next: Vec::with_capacity(n),
            behind: Vec::with_capacity(n),
            bridges: Vec::new(),
            n_left: 0,
            corners: Vec::with_capacity(n),
            sides: Vec::with_capacity(n),
        }
    }

    /// Adds a closed walk and returns its first corner; the others follow it in order.
    pub(super) fn add_walk(&mut self, vertices: impl Iterator<Item = u32>) -> u32 {
        let first = self.vertex.len() as u32;
        self.vertex.extend(vertices);
        let end = self.vertex.len() as u32;
        self.next.extend((first + 1..end).chain([first]));
        self.before
            .extend([end - 1].into_iter().chain(first..end - 1));
        self.behind.resize(end as usize, NOTHING);
        self.n_left += (end - first) as usize;
        first
    }

    /// Joins two walks by a side from the corner `a` to `b` and back. Returns the second corners of `a` and `b`, which are used
    /// on the way back.
    pub(super) fn add_bridge(&mut self, a: u32, b: u32) -> [u32; 2] {
        let (back_a, back_b) = (self.vertex.len() as u32, self.vertex.len() as u32 + 1);
        let (after_a, before_b) = (self.next[a as usize], self.before[b as usize]);
        let mark = BRIDGE | self.bridges.len() as u32;
        self.bridges.push(NOTHING);
        self.vertex
            .extend([self.vertex[a as usize], self.vertex[b as usize]]);
        self.behind.extend([self.behind[a as usize], mark]);
        self.next.extend([after_a, back_a]);
        self.before.extend([back_b, before_b]);
        self.before[after_a as usize] = back_a;
        self.next[before_b as usize] = back_b;
        self.next[a as usize] = b;
        self.before[b as usize] = a;
        self.behind[a as usize] = mark;
        self.n_left += 2;
        [back_a, back_b]
    }

    pub(super) fn before(&self, corner: u32) -> u32 {
        self.before[corner as usize]
    }

    pub(super) fn next(&self, corner: u32) -> u32 {
        self.next[corner as usize]
    }

    /// The vertex at a corner.
    pub(super) fn vertex(&self, corner: u32) -> u32 {
        self.vertex[corner as usize]
    }

    /// The point of a corner.
    pub(super) fn point(&self, corner: u32) -> ChartPoint {
        self.points[self.vertex[corner as usize] as usize]
    }

    /// The number of corners that are left.
    pub(super) fn n_left(&self) -> usize {
        self.n_left
    }

    /// The points of the corner before, the corner itself and the corner after it.
    pub(super) fn around(&self, corner: u32) -> [ChartPoint; 3] {
        [self.before(corner), corner, self.next(corner)].map(|corner| self.point(corner))
    }

    /// Cuts a corner off. Returns `false` and cuts nothing if the triangle would not be counter-clockwise.
    pub(super) fn cut(&mut self, corner: u32) -> bool {
        let [a, b, c] = self.around(corner);
        if self.n_left < 3 || orientation(a, b, c) <= 0.0 {
            return false;
        }
        let (before, next) = (self.before(corner), self.next(corner));
        let triangle = self.corners.len();
        self.corners
            .push([before, corner, next].map(|corner| self.vertex(corner)));
        self.sides.push([NOTHING; 3]);
        self.attach(side_ref(triangle, 0), self.behind[before as usize]);
        self.attach(side_ref(triangle, 1), self.behind[corner as usize]);
        self.next[before as usize] = next;
        self.before[next as usize] = before;
        self.behind[before as usize] = side_ref(triangle, 2);
        self.n_left -= 1;
        if self.n_left == 2 {
            self.attach(side_ref(triangle, 2), self.behind[next as usize]);
        }
        true
    }

    /// Records what lies behind a triangle's side.
    fn attach(&mut self, side: SideRef, behind: SideRef) {
        let behind = match behind {
            NOTHING => return,
            mark if mark & BRIDGE != 0 => {
                let reached = &mut self.bridges[(mark & !BRIDGE) as usize];
                if *reached == NOTHING {
                    *reached = side;
                    return;
                }
                *reached
            }
            behind => behind,
        };
        for (from, to) in [(side, behind), (behind, side)] {
            let (triangle, i) = triangle_and_side(from);
            self.sides[triangle][i] = to;
        }
    }

    /// Returns the triangles if only two corners are left.
    pub(super) fn finish(self) -> Option<Network> {
        (self.n_left == 2).then(|| Network::new(self.points.to_vec(), self.corners, self.sides))
    }
}
