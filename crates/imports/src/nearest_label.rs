//! Gives a point the label of the nearest labeled triangle or point, if their normals agree.
//!
//! Takes a search for the nearest item, the labels of its items, and the normals of the carrier's triangles. Nothing here
//! reads a file.

use partprobe_carrier::{IGNORE, Point};
use partprobe_sources::PointRule;
use partprobe_transfer::{Limits, Nearest, NearestPoint, NearestSurface, Query};
use std::fmt;

/// A search for the nearest labeled item.
pub(crate) trait NearestItem {
    /// The name of the items, in the plural.
    const ITEMS: &'static str;

    /// The nearest item within the limits.
    fn nearest(&self, query: &Query, limits: &Limits) -> Option<Nearest>;
}

impl NearestItem for NearestSurface {
    const ITEMS: &'static str = "triangles";

    fn nearest(&self, query: &Query, limits: &Limits) -> Option<Nearest> {
        Self::nearest(self, query, limits)
    }
}

impl NearestItem for NearestPoint {
    const ITEMS: &'static str = "points";

    fn nearest(&self, query: &Query, limits: &Limits) -> Option<Nearest> {
        Self::nearest(self, query, limits)
    }
}

/// The label of the nearest item whose normal agrees with that of the point's triangle.
pub(crate) struct NearestLabel<N> {
    pub(crate) nearest: N,
    /// The label of each item.
    pub(crate) labels: Vec<i32>,
    /// The normal of each triangle of the carrier.
    pub(crate) normals: Vec<Point>,
    pub(crate) limits: Limits,
}

impl<N: NearestItem> fmt::Debug for NearestLabel<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the nearest of {} labeled {}",
            self.labels.len(),
            N::ITEMS
        )
    }
}

impl<N: NearestItem + Send + Sync> PointRule for NearestLabel<N> {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let query = Query {
            position: point,
            normal: self.normals.get(triangle as usize).copied(),
        };
        let found = self.nearest.nearest(&query, &self.limits);
        found.map_or(IGNORE, |found| self.labels[found.item as usize])
    }
}
