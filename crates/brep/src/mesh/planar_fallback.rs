//! Meshes a face in the plane of its boundary if it has no layout on its surface and is nearly flat.

use super::attributes::forget_attributes;
use super::boundary::{BoundaryPoint, bounding_loops};
use super::edge_points::Tolerance;
use super::face_context::FaceContext;
use super::face_mesh::FaceMesh;
use super::mesh_face::mesh_face;
use super::off_surface::off_surface;
use crate::geometry::linear::{scaled, sum, unit};
use crate::geometry::{Frame, Surface};
use crate::model::BrepFace;
use partprobe_shape::{Point, bounding_diagonal, cross, dot, subtract};
use std::sync::Arc;

/// Height of the boundary over its plane, as a fraction of its width, up to which a face counts as nearly flat.
const FLAT: f64 = 0.05;
/// If at least this fraction of a boundary lies off the surface, the surface is in the wrong position.
const MOSTLY: f64 = 0.5;

/// Meshes a nearly flat face in the plane of its boundary. Returns `None` if the face is not nearly flat, or if some of its
/// boundary is off the surface but less than [`MOSTLY`].
pub(crate) fn planar_mesh(
    context: FaceContext<'_>,
    face: &BrepFace,
    tolerance: Tolerance,
) -> Option<FaceMesh> {
    let off = off_surface(context.brep, face, context.size);
    if off.is_some_and(|off| off.share < MOSTLY) {
        return None;
    }
    let polygons: Vec<Vec<BoundaryPoint>> = bounding_loops(context.brep, face)
        .loops
        .iter()
        .map(|uses| super::boundary::polygon(uses, context.edges, !face.same_sense))
        .collect::<Option<_>>()?;
    let points: Vec<Point> = polygons
        .iter()
        .flatten()
        .map(|corner| corner.point)
        .collect();
    let origin = *points.first()?;
    let normal = polygons
        .iter()
        .fold([0.0; 3], |total, polygon| sum(total, area_vector(polygon)));
    let normal = unit(normal)?;
    let height = points
        .iter()
        .map(|&point| dot(subtract(point, origin), normal).abs())
        .fold(0.0, f64::max);
    // Even if the surface is in the wrong position, a bent boundary must not count as flat.
    let flat = off.map_or_else(|| FLAT * bounding_diagonal(&points), |off| off.bound);
    if height > flat {
        return None;
    }
    let plane = Arc::new(Surface::Plane(Frame::new(origin, Some(normal), None)));
    let mut mesh = mesh_face(
        context,
        &BrepFace {
            surface: plane,
            ..face.clone()
        },
        tolerance,
    )
    .ok()?;
    forget_attributes(&mut mesh.attributes);
    mesh.is_flattened = true;
    Some(mesh)
}

fn area_vector(polygon: &[BoundaryPoint]) -> Point {
    let Some(first) = polygon.first() else {
        return [0.0; 3];
    };
    polygon.windows(2).fold([0.0; 3], |total, pair| {
        let (a, b) = (
            subtract(pair[0].point, first.point),
            subtract(pair[1].point, first.point),
        );
        sum(total, scaled(cross(a, b), 0.5))
    })
}
