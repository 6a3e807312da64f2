//! Defines the triangulation of a face in its chart: nodes, triangles, and the sides of the boundary.

use super::boundary::Segment;
use super::layout::Layout;
use crate::geometry::Surface;
use partprobe_shape::Point;

/// A point of the chart that is a vertex of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Node {
    /// Point in the chart.
    pub(crate) x: [f64; 2],
    /// Parameters.
    pub(crate) uv: [f64; 2],
    /// Point in space.
    pub(crate) point: Point,
    /// ∂u and ∂v at this point.
    pub(crate) tangents: [Point; 2],
}

impl Node {
    /// A node of the surface itself.
    pub(super) fn on_surface(surface: &Surface, uv: [f64; 2], x: [f64; 2]) -> Self {
        let (point, du, dv) = surface.derivatives(uv[0], uv[1]);
        Self {
            x,
            uv,
            point,
            tangents: [du, dv],
        }
    }
}

/// A side of the boundary that replaces a piece of curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Side {
    /// Node where it begins.
    pub(crate) from: usize,
    /// Node where it ends.
    pub(crate) to: usize,
    /// The piece of curve.
    pub(crate) segment: Segment,
    /// 1 if the face lies on its left in the chart, −1 if it lies on its right.
    pub(crate) side: f64,
}

/// A triangulated chart.
#[derive(Clone, Debug, Default)]
pub(crate) struct ChartTriangulation {
    /// Vertices, those of the boundary first.
    pub(crate) nodes: Vec<Node>,
    /// The number of vertices on the boundary.
    pub(crate) n_bounding: usize,
    /// Triangles, counter-clockwise in the chart.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The sides of the boundary that have the face on exactly one side.
    pub(crate) sides: Vec<Side>,
    /// Whether some boundaries cross.
    pub(crate) has_crossings: bool,
    /// Whether the border of the triangles may differ from the boundary although each side of the boundary is an edge of a
    /// triangle.
    pub(crate) is_ragged: bool,
}

/// The sides of all loops. `lies` returns on which side of each of them the face lies.
pub(super) fn boundary_sides(layout: &Layout, lies: impl Fn(usize, usize) -> f64) -> Vec<Side> {
    let mut sides = Vec::new();
    let mut first = 0;
    for bound in &layout.loops {
        let n = bound.corners.len();
        for (i, corner) in bound.corners.iter().enumerate() {
            let (from, to) = (first + i, first + (i + 1) % n);
            let Some(segment) = corner.segment else {
                continue;
            };
            let side = lies(from, to);
            if side != 0.0 {
                sides.push(Side {
                    from,
                    to,
                    segment,
                    side,
                });
            }
        }
        first += n;
    }
    sides
}

/// A point whose tiny coordinates are set to zero. The triangulation refuses numbers whose squares vanish.
pub(super) fn without_tiny_coordinates(point: [f64; 2]) -> [f64; 2] {
    point.map(|x| if x.abs() < 1e-40 { 0.0 } else { x })
}
