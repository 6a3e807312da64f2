//! Defines the mesh of one face, with the data that later steps need.

use super::attributes::reverse_attributes;
use super::contacts::Division;
use super::unwrap::Off;
use crate::model::EdgeUse;
use partprobe_shape::{Point, SurfaceAttributes, cross, norm, subtract};

/// The mesh of a face.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceMesh {
    /// Vertices.
    pub(crate) points: Vec<Point>,
    /// Outward normals of the surface at the vertices, if they were asked for.
    pub(crate) normals: Vec<[f32; 3]>,
    /// The other attributes that were asked for, at the vertices.
    pub(crate) attributes: SurfaceAttributes,
    /// Triangles, counter-clockwise seen from outside.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Area of the trimmed surface.
    pub(crate) area: f64,
    /// The result of the quadrature if it cannot be an area. `area` is then the area of the triangles.
    pub(crate) impossible_area: Option<f64>,
    /// Volume of the cone over the face, with its apex at its solid's origin. It is 0 if volumes are not wanted.
    pub(crate) volume: f64,
    /// Volume between the triangles and the surface, in cubic millimeters. It is positive where the triangles cut it off the
    /// solid.
    pub(crate) cut_off: f64,
    /// Edges of the boundary in the direction in which the triangles walk them.
    pub(crate) walks: Vec<EdgeUse>,
    /// Vertices that lie on the boundary.
    pub(crate) on_boundary: Vec<bool>,
    /// Whether the triangles follow the surface badly, or its boundaries cross. A finer mesh may then be better.
    pub(crate) is_rough: bool,
    /// Divisions of edges that keep its boundaries apart where their curves are apart.
    pub(crate) divisions: Vec<Division>,
    /// How the triangles treat edges that lie too far off the surface, if there are any.
    pub(crate) off_surface: Option<Off>,
    /// Whether its triangles lie in the plane of its boundary, not on its surface.
    pub(crate) is_flattened: bool,
}

impl FaceMesh {
    /// The total area of the triangles, in square millimeters.
    pub(crate) fn area_of_triangles(&self) -> f64 {
        let areas = self.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
            0.5 * norm(cross(subtract(b, a), subtract(c, a)))
        });
        areas.sum()
    }

    /// Reverses the mesh, so that its other side faces outward.
    pub(crate) fn reverse(&mut self) {
        self.triangles
            .iter_mut()
            .for_each(|corners| corners.swap(1, 2));
        self.normals
            .iter_mut()
            .for_each(|normal| *normal = normal.map(|x| -x));
        reverse_attributes(&mut self.attributes);
        self.walks
            .iter_mut()
            .for_each(|walk| walk.forward = !walk.forward);
        self.volume = -self.volume;
        self.cut_off = -self.cut_off;
    }
}
