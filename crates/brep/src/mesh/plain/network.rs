//! Keeps triangles with their neighbors, flips sides until the triangulation is constrained Delaunay (Lawson's flips), and
//! inserts further vertices.
//!
//! Every predicate is exact (`robust`, after J. R. Shewchuk, *Adaptive precision floating-point arithmetic and fast robust
//! geometric predicates*, 1997), so flips end and no triangle is ever reversed. Sides of the boundary are never flipped.

use robust::{Coord, incircle, orient2d};

/// A point of the chart.
pub(super) type ChartPoint = [f64; 2];

/// Marks that no triangle lies behind a side, so that the side belongs to the boundary.
pub(super) const NOTHING: u32 = u32::MAX;

/// If a walk from triangle to triangle is longer than this, every triangle is searched instead.
const LONGEST_WALK: usize = 1000;

/// A side of a triangle: four times the triangle's number, plus the number of the corner where the side begins.
pub(super) type SideRef = u32;

/// A triangulation whose border is the boundary of a face.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    /// The vertices.
    pub(super) points: Vec<ChartPoint>,
    /// Counter-clockwise corners of each triangle.
    pub(super) corners: Vec<[u32; 3]>,
    /// For each triangle and each corner, the opposite side in the neighbor behind the side that begins there, or [`NOTHING`].
    pub(super) behind: Vec<[SideRef; 3]>,
    /// Sides that may not be Delaunay.
    open: Vec<SideRef>,
}

/// Positive if the corners run counter-clockwise, negative if they run clockwise, and 0 if they lie on one line.
pub(super) fn orientation(a: ChartPoint, b: ChartPoint, c: ChartPoint) -> f64 {
    orient2d(coord(a), coord(b), coord(c))
}

fn coord([x, y]: ChartPoint) -> Coord<f64> {
    Coord { x, y }
}

pub(super) fn side_ref(triangle: usize, side: usize) -> SideRef {
    (triangle << 2 | side) as u32
}

pub(super) fn triangle_and_side(side: SideRef) -> (usize, usize) {
    ((side >> 2) as usize, (side & 3) as usize)
}

impl Network {
    /// A network of these triangles.
    pub(super) fn new(
        points: Vec<ChartPoint>,
        corners: Vec<[u32; 3]>,
        behind: Vec<[SideRef; 3]>,
    ) -> Self {
        Self {
            points,
            corners,
            behind,
            open: Vec::new(),
        }
    }

    /// The corners of a triangle.
    pub(super) fn corner_points(&self, triangle: usize) -> [ChartPoint; 3] {
        self.corners[triangle].map(|corner| self.points[corner as usize])
    }

    /// Whether a side belongs to the boundary.
    pub(super) fn is_boundary(&self, triangle: usize, side: usize) -> bool {
        self.behind[triangle][side] == NOTHING
    }

    /// Flips sides until every side is Delaunay or belongs to the boundary.
    pub(super) fn make_delaunay(&mut self) {
        for (triangle, behind) in self.behind.iter().enumerate() {
            // Each inner side is listed once, by the first of its two triangles.
            let is_first = |side: &usize| {
                behind[*side] != NOTHING && behind[*side] > side_ref(triangle, *side)
            };
            self.open
                .extend((0..3).filter(is_first).map(|side| side_ref(triangle, side)));
        }
        while let Some(side) = self.open.pop() {
            let (t, i) = triangle_and_side(side);
            if let Some([t, u]) = self.flip_if_inside(t, i) {
                self.open.extend([
                    side_ref(t, 0),
                    side_ref(t, 2),
                    side_ref(u, 0),
                    side_ref(u, 1),
                ]);
            }
        }
    }

    /// Flips a side if the vertex behind it lies inside the triangle's circle.
    ///
    /// The side runs from `a` to `b`. The corner `c` is opposite, and `d` is behind the side. The triangles become `a d c` and `d
    /// b c`. Returns their numbers.
    fn flip_if_inside(&mut self, t: usize, i: usize) -> Option<[usize; 2]> {
        let behind = self.behind[t][i];
        if behind == NOTHING {
            return None;
        }
        let (u, j) = triangle_and_side(behind);
        let ([a, b, c], d) = (rotated(self.corners[t], i), self.corners[u][(j + 2) % 3]);
        let [pa, pb, pc, pd] = [a, b, c, d].map(|vertex| coord(self.points[vertex as usize]));
        if incircle(pa, pb, pc, pd) <= 0.0 {
            return None;
        }
        let [_, bc, ca] = rotated(self.behind[t], i);
        let [_, ad, db] = rotated(self.behind[u], j);
        self.corners[t] = [a, d, c];
        self.corners[u] = [d, b, c];
        self.behind[t] = [ad, side_ref(u, 2), ca];
        self.behind[u] = [db, bc, side_ref(t, 1)];
        self.orientation_to(ad, side_ref(t, 0));
        self.orientation_to(ca, side_ref(t, 2));
        self.orientation_to(db, side_ref(u, 0));
        self.orientation_to(bc, side_ref(u, 1));
        Some([t, u])
    }

    /// Sets what lies behind a side.
    fn orientation_to(&mut self, side: SideRef, behind: SideRef) {
        if side != NOTHING {
            let (triangle, i) = triangle_and_side(side);
            self.behind[triangle][i] = behind;
        }
    }

    /// Inserts a vertex. The search for its triangle begins at the triangle `start`. Returns a triangle at the new vertex.
    ///
    /// Returns `None` if the point lies outside, on the boundary or on another vertex.
    pub(super) fn insert(&mut self, point: ChartPoint, start: usize) -> Option<usize> {
        let (triangle, on_side) = self.locate(point, start)?;
        let vertex = self.points.len() as u32;
        self.points.push(point);
        match on_side {
            None => self.split_triangle(triangle, vertex),
            Some(side) => self.split_side(triangle, side, vertex),
        }
        while let Some(side) = self.open.pop() {
            let (t, i) = triangle_and_side(side);
            if let Some([t, u]) = self.flip_if_inside(t, i) {
                self.open.extend([side_ref(t, 0), side_ref(u, 0)]);
            }
        }
        Some(triangle)
    }

    /// `a b c` becomes `a b v`, `b c v` and `c a v`.
    fn split_triangle(&mut self, t: usize, vertex: u32) {
        let (u, w) = (self.corners.len(), self.corners.len() + 1);
        let ([a, b, c], [ab, bc, ca]) = (self.corners[t], self.behind[t]);
        self.corners[t] = [a, b, vertex];
        self.corners.extend([[b, c, vertex], [c, a, vertex]]);
        self.behind[t] = [ab, side_ref(u, 2), side_ref(w, 1)];
        self.behind.push([bc, side_ref(w, 2), side_ref(t, 1)]);
        self.behind.push([ca, side_ref(t, 2), side_ref(u, 1)]);
        self.orientation_to(bc, side_ref(u, 0));
        self.orientation_to(ca, side_ref(w, 0));
        self.open
            .extend([t, u, w].map(|triangle| side_ref(triangle, 0)));
    }

    /// The triangles `a b c` and `b a d` at the side from `a` to `b` become `c a v`, `b c v`, `d b v` and `a d v`.
    fn split_side(&mut self, t: usize, i: usize, vertex: u32) {
        let (u, j) = triangle_and_side(self.behind[t][i]);
        let (w, x) = (self.corners.len(), self.corners.len() + 1);
        let ([a, b, c], [_, bc, ca]) = (rotated(self.corners[t], i), rotated(self.behind[t], i));
        let ([_, _, d], [_, ad, db]) = (rotated(self.corners[u], j), rotated(self.behind[u], j));
        self.corners[t] = [c, a, vertex];
        self.corners[u] = [d, b, vertex];
        self.corners.extend([[b, c, vertex], [a, d, vertex]]);
        self.behind[t] = [ca, side_ref(x, 2), side_ref(w, 1)];
        self.behind[u] = [db, side_ref(w, 2), side_ref(x, 1)];
        self.behind.push([bc, side_ref(t, 2), side_ref(u, 1)]);
        self.behind.push([ad, side_ref(u, 2), side_ref(t, 1)]);
        self.orientation_to(ca, side_ref(t, 0));
        self.orientation_to(db, side_ref(u, 0));
        self.orientation_to(bc, side_ref(w, 0));
        self.orientation_to(ad, side_ref(x, 0));
        self.open
            .extend([t, u, w, x].map(|triangle| side_ref(triangle, 0)));
    }

    /// The triangle that holds a point, and the inner side on which the point lies, if it lies on one.
    fn locate(&self, point: ChartPoint, start: usize) -> Option<(usize, Option<usize>)> {
        let mut triangle = start;
        for _ in 0..LONGEST_WALK {
            let orientations = self.orientations(triangle, point);
            let beyond = (0..3)
                .filter(|&side| orientations[side] < 0.0)
                .map(|side| self.behind[triangle][side]);
            let Some(next) = beyond.reduce(|a, b| if a == NOTHING { b } else { a }) else {
                return self.location_in(triangle, orientations);
            };
            if next == NOTHING {
                break;
            }
            triangle = triangle_and_side(next).0;
        }
        let all =
            (0..self.corners.len()).map(|triangle| (triangle, self.orientations(triangle, point)));
        let (triangle, orientations) = all
            .into_iter()
            .find(|(_, orientations)| orientations.iter().all(|&orientation| orientation >= 0.0))?;
        self.location_in(triangle, orientations)
    }

    /// For each side of a triangle, on which side of it a point lies.
    fn orientations(&self, triangle: usize, point: ChartPoint) -> [f64; 3] {
        let [a, b, c] = self.corner_points(triangle);
        [
            orientation(a, b, point),
            orientation(b, c, point),
            orientation(c, a, point),
        ]
    }

    /// The result of [`Network::locate`] for a triangle that holds the point.
    fn location_in(
        &self,
        triangle: usize,
        orientations: [f64; 3],
    ) -> Option<(usize, Option<usize>)> {
        let mut on = (0..3).filter(|&side| orientations[side] == 0.0);
        match (on.next(), on.next()) {
            (None, _) => Some((triangle, None)),
            (Some(side), None) if !self.is_boundary(triangle, side) => Some((triangle, Some(side))),
            _ => None,
        }
    }
}

/// Three values, rotated so that the one at `first` comes first.
fn rotated<T: Copy>(values: [T; 3], first: usize) -> [T; 3] {
    [
        values[first],
        values[(first + 1) % 3],
        values[(first + 2) % 3],
    ]
}
