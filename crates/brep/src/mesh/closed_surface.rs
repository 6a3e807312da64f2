//! Meshes a whole closed surface: a face without boundaries.

use super::chart::Chart;
use super::edge_points::Tolerance;
use super::steps::steps;
use super::triangulated::{Node, Triangulated};
use super::unwrap::free_parameter;
use crate::geometry::Surface;

/// A grid over the natural range of both parameters; what meets itself gets equal points.
///
/// `apices` are the parameters of the vertices that bound the face: where a surface comes to its axis between
/// its ends, it ends there. Nothing where the surface has no natural bounds. `size` is the diagonal of the shape.
pub(crate) fn closed_surface(
    surface: &Surface,
    apices: &[[f64; 2]],
    tolerance: Tolerance,
    size: f64,
) -> Option<(Chart, Triangulated)> {
    let [Some(u), Some(v)] = surface.range() else {
        return None;
    };
    let v = if matches!(surface, Surface::Revolution { .. }) {
        between(v, apices)
    } else {
        v
    };
    if ![u.0, u.1, v.0, v.1].iter().all(|end| end.is_finite()) {
        return None;
    }
    let needed = steps(surface, [[u.0, u.1], [v.0, v.1]], tolerance);
    let (n, m) = (needed[0].max(8), needed[1].max(4));
    let period = surface.period();
    let home = |i: usize, n: usize, axis: usize| if period[axis].is_some() { i % n } else { i };
    let at = |(low, high): (f64, f64), i: usize, n: usize| low + (high - low) * i as f64 / n as f64;
    let chart = Chart::Stretched {
        origin: [0.0; 2],
        scale: [1.0; 2],
    };
    let node = |i: usize, j: usize| {
        let uv = [at(u, i, n), at(v, j, m)];
        let mut from = [at(u, home(i, n, 0), n), at(v, home(j, m, 1), m)];
        let (mut point, du, dv) = surface.derivatives(from[0], from[1]);
        if let Some(axis) = free_parameter(surface, from, [du, dv], size) {
            from[axis] = [u.0, v.0][axis];
            point = surface.point(from[0], from[1]);
        }
        Node {
            x: chart.to_plane(uv),
            uv,
            point,
            tangents: [du, dv],
        }
    };
    let nodes = (0..=n)
        .flat_map(|i| (0..=m).map(move |j| (i, j)))
        .map(|(i, j)| node(i, j))
        .collect();
    let index = |i: usize, j: usize| (i * (m + 1) + j) as u32;
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let triangles = cells
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                index(i, j),
                index(i + 1, j),
                index(i + 1, j + 1),
                index(i, j + 1),
            ];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    Some((
        chart,
        Triangulated {
            nodes,
            triangles,
            ..Triangulated::default()
        },
    ))
}

/// The fraction of a range between two vertices; all of it where there are not two.
fn between((low, high): (f64, f64), apices: &[[f64; 2]]) -> (f64, f64) {
    let ends = apices.iter().map(|uv| uv[1].clamp(low, high));
    let (first, last) = (ends.clone().fold(high, f64::min), ends.fold(low, f64::max));
    if last - first > 1e-6 * (high - low) {
        (first, last)
    } else {
        (low, high)
    }
}
