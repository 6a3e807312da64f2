//! Meshes a whole closed surface: a face without boundaries.

use super::chart::Chart;
use super::edge_points::Tolerance;
use super::steps::{Bounds, steps};
use super::triangulated::{ChartTriangulation, Node};
use super::unwrap::free_parameter;
use crate::geometry::Surface;

/// A grid over the natural range of both parameters. Where the surface meets itself, the nodes get equal points.
///
/// `apices` are the parameters of the vertices that bound the face. A surface of revolution ends at such a vertex even if its
/// curve continues. Returns `None` if the surface has no natural bounds. `size` is the diagonal of the shape.
pub(crate) fn closed_surface(
    surface: &Surface,
    apices: &[[f64; 2]],
    tolerance: Tolerance,
    size: f64,
) -> Option<(Chart, ChartTriangulation)> {
    let bounds = bounds(surface, apices)?;
    let needed = steps(surface, bounds, tolerance);
    let grid = Grid {
        surface,
        bounds,
        n: [needed[0].max(8), needed[1].max(4)],
        size,
    };
    let chart = Chart::Stretched {
        origin: [0.0; 2],
        scale: [1.0; 2],
    };
    let triangulated = ChartTriangulation {
        nodes: grid.nodes(&chart),
        triangles: grid.triangles(),
        ..ChartTriangulation::default()
    };
    Some((chart, triangulated))
}

/// The finite range of both parameters. For a surface of revolution, it is limited to the range between the apices.
fn bounds(surface: &Surface, apices: &[[f64; 2]]) -> Option<Bounds> {
    let [Some(u), Some(v)] = surface.range() else {
        return None;
    };
    let v = if matches!(surface, Surface::Revolution { .. }) {
        between(v, apices)
    } else {
        v
    };
    let bounds = [[u.0, u.1], [v.0, v.1]];
    bounds
        .as_flattened()
        .iter()
        .all(|end| end.is_finite())
        .then_some(bounds)
}

/// A grid of cells over a closed surface.
struct Grid<'a> {
    surface: &'a Surface,
    bounds: Bounds,
    /// Cells along u and v.
    n: [usize; 2],
    /// The diagonal of the shape.
    size: f64,
}

impl Grid<'_> {
    /// The nodes, row by row of equal u.
    fn nodes(&self, chart: &Chart) -> Vec<Node> {
        let [n, m] = self.n;
        (0..=n)
            .flat_map(|i| (0..=m).map(move |j| [i, j]))
            .map(|ij| self.node(chart, ij))
            .collect()
    }

    /// A node. Where the surface meets itself, the node has the point of the node at the beginning of the range.
    fn node(&self, chart: &Chart, ij: [usize; 2]) -> Node {
        let uv = self.parameters(ij);
        let mut from = self.parameters(self.home(ij));
        let (mut point, du, dv) = self.surface.derivatives(from[0], from[1]);
        if let Some(axis) = free_parameter(self.surface, from, [du, dv], self.size) {
            from[axis] = self.bounds[axis][0];
            point = self.surface.point(from[0], from[1]);
        }
        Node {
            x: chart.to_plane(uv),
            uv,
            point,
            tangents: [du, dv],
        }
    }

    /// The first grid position with the same point. For example, the end of a period has the same point as its beginning.
    fn home(&self, ij: [usize; 2]) -> [usize; 2] {
        let period = self.surface.period();
        [0, 1].map(|axis| {
            if period[axis].is_some() {
                ij[axis] % self.n[axis]
            } else {
                ij[axis]
            }
        })
    }

    fn parameters(&self, ij: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let [low, high] = self.bounds[axis];
            low + (high - low) * ij[axis] as f64 / self.n[axis] as f64
        })
    }

    /// Two triangles per cell.
    fn triangles(&self) -> Vec<[u32; 3]> {
        let [n, m] = self.n;
        (0..n)
            .flat_map(|i| (0..m).map(move |j| (i, j)))
            .flat_map(|(i, j)| {
                let a = self.index(i, j);
                let b = self.index(i + 1, j);
                let c = self.index(i + 1, j + 1);
                let d = self.index(i, j + 1);
                [[a, b, c], [a, c, d]]
            })
            .collect()
    }

    fn index(&self, i: usize, j: usize) -> u32 {
        (i * (self.n[1] + 1) + j) as u32
    }
}

/// The section of a range between two vertices, or the whole range if there are fewer than two vertices.
fn between((low, high): (f64, f64), apices: &[[f64; 2]]) -> (f64, f64) {
    let ends = apices.iter().map(|uv| uv[1].clamp(low, high));
    let (first, last) = (ends.clone().fold(high, f64::min), ends.fold(low, f64::max));
    if last - first > 1e-6 * (high - low) {
        (first, last)
    } else {
        (low, high)
    }
}
