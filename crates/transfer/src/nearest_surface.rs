//! Takes the label of the nearest triangle, by exact distance: channel `nn-surface`.

use crate::box_tree::{Bounds, BoxTree};
use crate::point_triangle;
use crate::query::{Limits, Nearest, Query, Start, normals_agree};
use crate::surface::Surface;
use partprobe_carrier::{Point, unit_normal};
use rayon::prelude::*;

/// A surface that is prepared for searches of its nearest triangle.
///
/// Cost: `O(T log T)` for the preparation of `T` triangles, and about `O(log T)` per query.
#[derive(Clone, Debug)]
pub struct NearestSurface {
    tree: BoxTree,
    /// The corners of the triangles, in the order of the tree.
    corners: Vec<[Point; 3]>,
    /// Their normals, in the same order.
    normals: Vec<Point>,
}

impl NearestSurface {
    /// Prepares a surface.
    #[must_use]
    pub fn new(surface: Surface<'_>) -> Self {
        let corners: Vec<[Point; 3]> = (0..surface.triangles().len())
            .into_par_iter()
            .map(|triangle| surface.corners(triangle))
            .collect();
        let bounds: Vec<Bounds> = corners
            .par_iter()
            .map(|corners| Bounds::around(corners))
            .collect();
        let tree = BoxTree::new(&bounds);
        let corners = tree.arranged(&corners);
        Self {
            normals: corners.par_iter().copied().map(unit_normal).collect(),
            corners,
            tree,
        }
    }

    /// The nearest triangle within the limits. At equal distances, for example at a common edge, the lowest triangle is returned.
    #[must_use]
    pub fn nearest(&self, query: &Query, limits: &Limits) -> Option<Nearest> {
        self.nearest_among(query, limits, |_| true)
    }

    /// The same among the triangles whose index satisfies `counts`.
    #[must_use]
    pub fn nearest_among(
        &self,
        query: &Query,
        limits: &Limits,
        counts: impl Fn(u32) -> bool,
    ) -> Option<Nearest> {
        self.search(query, limits, &mut Start::default(), counts)
    }

    /// The nearest triangle within the limits. The search starts at the triangle that the previous search found.
    pub(crate) fn nearest_from(
        &self,
        query: &Query,
        limits: &Limits,
        start: &mut Start,
    ) -> Option<Nearest> {
        self.search(query, limits, start, |_| true)
    }

    fn search(
        &self,
        query: &Query,
        limits: &Limits,
        start: &mut Start,
        counts: impl Fn(u32) -> bool,
    ) -> Option<Nearest> {
        let min_cosine = limits.min_cosine();
        let squared_distance = |slot: usize, triangle: u32| {
            let is_candidate =
                counts(triangle) && normals_agree(query, self.normals[slot], min_cosine);
            is_candidate
                .then(|| point_triangle::squared_distance(query.position, self.corners[slot]))
        };
        let max_squared = limits.max_distance * limits.max_distance;
        let found = self
            .tree
            .nearest(query.position, max_squared, start.0, squared_distance)?;
        start.0 = Some(found.slot);
        Some(Nearest {
            item: found.item,
            distance: found.squared_distance.sqrt(),
        })
    }
}
