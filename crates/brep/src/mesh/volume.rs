//! Computes the volume of the cone between a face and a point, from the true surface.
//!
//! By the divergence theorem, the volume of a solid is a third of the integral of position · normal over its faces. So the cones
//! of the faces of a closed solid add up to its true volume, even if its triangles cut some volume off.

use super::chart::Chart;
use super::quadrature::{Breaks, Exactness, UvTriangle, integral};
use super::strips::{Bow, Strips};
use super::surface_fit::unwrapped;
use super::triangulated::ChartTriangulation;
use crate::geometry::Surface;
use partprobe_shape::{Point, cross, distance, dot, norm, subtract};

/// The accuracy at which the cone over a piece of a face is accepted: as a fraction of its volume, and as a fraction of the
/// face's area times its reach.
const EXACT: [f64; 2] = [1e-5, 1e-8];

/// The volume of the cone over a face with its apex at `origin`, in cubic millimeters. It is positive where the surface's normal
/// points away from the apex. `breaks` are the surface's knots, and `area` is the approximate area of the face.
pub(super) fn cone_volume(
    surface: &Surface,
    chart: Chart,
    (mesh, strips): (&ChartTriangulation, &Strips),
    (breaks, area): (&Breaks, f64),
    origin: Point,
) -> f64 {
    let side = if chart.is_mirrored() { -1.0 } else { 1.0 };
    // Three times the cone's volume per unit of the parameter plane.
    let density = |[u, v]: [f64; 2]| {
        let (point, du, dv) = surface.derivatives(u, v);
        dot(subtract(point, origin), cross(du, dv))
    };
    let reach = mesh
        .nodes
        .iter()
        .map(|node| distance(node.point, origin))
        .fold(0.0, f64::max);
    let exactness = Exactness {
        relative: EXACT[0],
        absolute: EXACT[1] * area * reach,
        at_a_glance: 0.0,
    };
    let over = |triangle: UvTriangle| integral(triangle, breaks, exactness, &density);
    let mut total = 0.0;
    for triangle in &mesh.triangles {
        let (corners, beyond) = unwrapped(chart, triangle.map(|node| &mesh.nodes[node as usize]));
        for corners in [Some(corners), beyond].into_iter().flatten() {
            total += over(corners.map(|corner| corner.uv));
        }
    }
    total += strips
        .triangles
        .iter()
        .map(|&triangle| over(triangle))
        .sum::<f64>();
    total += strips
        .bows
        .iter()
        .map(|bow| over_bow(bow, origin))
        .sum::<f64>();
    side * total / 3.0
}

/// Three times the volume of the cone over a bow.
fn over_bow(bow: &Bow, origin: Point) -> f64 {
    let height = dot(subtract(bow.point, origin), bow.normal) / norm(bow.normal);
    let volume = bow.area * height;
    if volume.is_finite() { volume } else { 0.0 }
}
