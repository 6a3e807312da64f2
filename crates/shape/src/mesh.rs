//! Holds a triangle mesh in which each triangle records its source face.

use crate::vector::{Point, bounding_diagonal, triangle_area};

/// Triangles with their source faces.
///
/// A vertex belongs to one face. Faces that share an edge have bit-equal coordinates there, so that
/// [`crate::weld()`] joins them. Triangles are counter-clockwise seen from outside a solid.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, in millimeters.
    pub vertices: Vec<Point>,
    /// The face of each vertex.
    pub vertex_face: Vec<u32>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The source face of each triangle.
    pub tri_face: Vec<u32>,
    /// The normal of the true surface at each vertex, unit length and outward; empty if it was not asked for.
    pub vertex_normal: Vec<[f32; 3]>,
}

impl Mesh {
    /// The corners of a triangle.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [Point; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// The area of each triangle, in square millimeters.
    #[must_use]
    pub fn triangle_areas(&self) -> Vec<f64> {
        (0..self.triangles.len())
            .map(|triangle| triangle_area(self.corners(triangle)))
            .collect()
    }

    /// The diagonal of the bounding box, in millimeters.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        bounding_diagonal(&self.vertices)
    }
}
