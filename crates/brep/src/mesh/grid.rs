//! Proposes vertices inside a face: a grid that is as dense as its surface needs.

use super::layout::Layout;
use super::triangulated::Node;
use crate::geometry::Surface;

/// A point of the grid. It may become a vertex inside the face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    /// Parameters.
    pub(super) uv: [f64; 2],
    /// Point in the chart.
    pub(super) x: [f64; 2],
    /// The size of the grid's cells at this point, in the chart.
    cell: f64,
}

impl Candidate {
    /// The node at this point.
    pub(super) fn node(&self, surface: &Surface) -> Node {
        Node::on_surface(surface, self.uv, self.x)
    }

    /// Whether a boundary is so near that a vertex here would only make slivers. `corners` is the triangle that holds the point.
    /// `is_bounding` says for each side that begins at a corner whether it is a boundary.
    pub(super) fn is_crowded(&self, corners: [[f64; 2]; 3], is_bounding: [bool; 3]) -> bool {
        let x = self.x;
        let is_within =
            |arm: [f64; 2], fraction: f64| squared(arm) < squared([fraction * self.cell, 0.0]);
        corners
            .iter()
            .any(|p| is_within([p[0] - x[0], p[1] - x[1]], 0.25))
            || (0..3)
                .filter(|&side| is_bounding[side])
                .any(|side| is_within(to_side(x, corners[side], corners[(side + 1) % 3]), 0.3))
    }
}

/// The grid of points, as dense as the surface needs. Not all of its points lie inside the face.
pub(super) fn candidates(layout: &Layout) -> Vec<Candidate> {
    let Layout {
        chart,
        bounds,
        steps,
        ..
    } = layout;
    let around = match *chart {
        super::chart::Chart::Polar { around, .. } => Some(around),
        super::chart::Chart::Stretched { .. } => None,
    };
    let cell = around.map_or(1.0, |around| std::f64::consts::TAU / steps[around] as f64);
    let lines = |axis: usize| usize::from(around != Some(axis))..steps[axis];
    let at = |axis: usize, i: usize| {
        bounds[axis][0] + (bounds[axis][1] - bounds[axis][0]) * i as f64 / steps[axis] as f64
    };
    let points = lines(0).flat_map(|i| lines(1).map(move |j| [i, j]));
    let candidate = |[i, j]: [usize; 2]| {
        let uv = [at(0, i), at(1, j)];
        let x = chart.to_plane(uv);
        Candidate {
            uv,
            x,
            cell: cell * chart.magnification(x),
        }
    };
    points.map(candidate).collect()
}

/// The node at the pole. Returns `None` if the face has no pole.
pub(super) fn pole_node(surface: &Surface, layout: &Layout) -> Option<Node> {
    layout
        .pole
        .map(|uv| Node::on_surface(surface, uv, [0.0, 0.0]))
}

fn squared([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}

/// The vector from the nearest point of a side to `p`.
fn to_side(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    let (side, arm) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let length = squared(side);
    let t = if length > 0.0 {
        ((arm[0] * side[0] + arm[1] * side[1]) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    [arm[0] - t * side[0], arm[1] - t * side[1]]
}
