//! The volume between a face and a place: a quadrature of the true surface by the divergence theorem, so that the
//! faces of a closed solid add up to its volume whatever its triangles cut off.

use super::chart::Chart;
use super::sliver::sliver;
use super::surface_fit::{inner_places, signed_area, unwrapped};
use super::triangulation::Triangulated;
use crate::geometry::Surface;
use crate::model::TopoEdge;
use carrier::{Point, cross, dot, norm, subtract};

/// Quarterings of each triangle of a curved face.
const DEPTH: u32 = 2;

/// The volume of the cone over a face with its apex at `origin`, in cubic millimetres; positive where the surface's
/// normal points away from it.
pub(crate) fn cone_volume(
    surface: &Surface,
    chart: Chart,
    mesh: &Triangulated,
    edges: &[TopoEdge],
    origin: Point,
) -> f64 {
    let side = if chart.is_mirrored() { -1.0 } else { 1.0 };
    let depth = if matches!(surface, Surface::Plane(_)) { 0 } else { DEPTH };
    // Three times the cone's volume per unit of the parameter plane.
    let density = |[u, v]: [f64; 2]| {
        let (point, du, dv) = surface.derivatives(u, v);
        dot(subtract(point, origin), cross(du, dv))
    };
    let mut total = 0.0;
    for triangle in &mesh.triangles {
        let (corners, beyond) = unwrapped(chart, triangle.map(|node| &mesh.nodes[node as usize]));
        for corners in [Some(corners), beyond].into_iter().flatten() {
            total += integral(corners.map(|corner| corner.uv), &density, depth);
        }
    }
    let under_sliver = |piece: &super::triangulation::Side| {
        let node = &mesh.nodes[piece.from];
        let normal = cross(node.tangents[0], node.tangents[1]);
        let height = dot(subtract(node.point, origin), normal) / norm(normal);
        let volume = piece.side * sliver(surface, mesh, piece, edges) * height;
        if volume.is_finite() { volume } else { 0.0 }
    };
    side * (total + mesh.sides.iter().map(under_sliver).sum::<f64>()) / 3.0
}

/// A rule that is exact for squares, on quarters of quarters. Its places lie inside the triangle: on a side a spline
/// may have a kink.
fn integral([a, b, c]: [[f64; 2]; 3], density: &impl Fn([f64; 2]) -> f64, depth: u32) -> f64 {
    if depth == 0 {
        return signed_area([a, b, c]) * inner_places([a, b, c]).map(density).iter().sum::<f64>() / 3.0;
    }
    let middle = |p: [f64; 2], q: [f64; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    quarters.into_iter().map(|quarter| integral(quarter, density, depth - 1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kink_along_a_side_is_not_seen() {
        let density = |[u, v]: [f64; 2]| if u == 0.0 { 100.0 } else { 1.0 + u + v * v };
        // ∫ 1 + u + v² over the triangle below the diagonal of the unit square.
        let exact = 0.5 + 1.0 / 6.0 + 1.0 / 12.0;
        for depth in 0..3 {
            let found = integral([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &density, depth);
            assert!((found - exact).abs() < 1e-12, "{found}");
        }
    }
}
