//! Finds the plane of a face whose surface the file omits or does not read, from its loops.

use super::error::{EntityError, Problem};
use super::surface_table::SharedSurface;
use super::topology::TopologyBuilder;
use crate::geometry::{Frame, Surface};
use crate::model::Loop;
use partprobe_shape::{FaceType, Point, bounding_diagonal, cross, subtract};
use std::sync::Arc;

/// Number of pieces of each edge whose ends must lie in the plane of a face without a surface.
const PIECES_IN_PLANE: usize = 8;

/// The largest distance of these ends from the plane, as a fraction of the face's size.
const FLAT: f64 = 1e-6;

impl TopologyBuilder<'_, '_> {
    /// The plane through the polygons of a face without a surface. Its normal is that of the first polygon that has one.
    pub(super) fn plane_of_loops(&self, loops: &[Loop]) -> Result<SharedSurface, EntityError> {
        let corners = loops.iter().map(|boundary| self.edges.corners(boundary));
        let plane = corners.filter_map(|corners| {
            let normal = newell_normal(&corners);
            (partprobe_shape::norm(normal) > 0.0)
                .then(|| Frame::new(corners[0], Some(normal), None))
        });
        let plane = plane
            .into_iter()
            .next()
            .ok_or(Problem::Geometry("its polygons span no plane"))?;
        let surface = Arc::new(Surface::Plane(plane));
        Ok(SharedSurface {
            surface,
            face_type: FaceType::Plane,
            same_sense: true,
        })
    }

    /// The same for a face whose surface is left out. All its edges must lie in the plane.
    pub(super) fn plane_of_flat_loops(&self, loops: &[Loop]) -> Result<SharedSurface, EntityError> {
        let problem = || {
            EntityError::from(Problem::Geometry(
                "it names no surface, and its boundary lies in no plane",
            ))
        };
        let walks: Vec<Vec<Point>> = loops
            .iter()
            .map(|boundary| self.edges.points_along(boundary, PIECES_IN_PLANE))
            .collect();
        let normals = walks.iter().map(|walk| newell_normal(walk));
        let outer = normals
            .max_by(|a, b| partprobe_shape::norm(*a).total_cmp(&partprobe_shape::norm(*b)))
            .ok_or_else(problem)?;
        let frame = Frame::new(
            walks[0].first().copied().unwrap_or_default(),
            Some(outer),
            None,
        );
        let size = bounding_diagonal(&walks.concat());
        let is_flat = walks
            .iter()
            .flatten()
            .all(|&point| frame.local(point)[2].abs() <= FLAT * size);
        if partprobe_shape::norm(outer) > 0.0 && is_flat {
            let surface = Arc::new(Surface::Plane(frame));
            Ok(SharedSurface {
                surface,
                face_type: FaceType::Plane,
                same_sense: true,
            })
        } else {
            Err(problem())
        }
    }
}

/// Twice the area vector of a closed polygon.
fn newell_normal(corners: &[Point]) -> Point {
    let Some(&origin) = corners.first() else {
        return [0.0; 3];
    };
    let mut normal = [0.0; 3];
    for pair in corners.windows(2) {
        let area = cross(subtract(pair[0], origin), subtract(pair[1], origin));
        normal = [0, 1, 2].map(|axis| normal[axis] + area[axis]);
    }
    normal
}
