//! Holds a triangle mesh in which each triangle records its source face.

use crate::vector::{Point, bounding_diagonal, triangle_area};

/// Triangles with their source faces.
///
/// A vertex belongs to one face. Faces that share an edge have bit-equal coordinates there, so that
/// [`crate::weld()`] joins them. Triangles are counter-clockwise seen from outside a solid.
///
/// A *cloud* is a mesh whose triangles are single points: the three corners of each triangle are the same vertex, and each vertex
/// has a normal. [`Mesh::cloud`] makes one. In this way, properties of triangles, for example labels, are properties of points.
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
    /// The outward unit normal of the true surface at each vertex. The list is empty if normals were not requested.
    pub vertex_normal: Vec<[f32; 3]>,
}

impl Mesh {
    /// A cloud of these points, which all belong to face 0. `normals` has one unit normal per point.
    #[must_use]
    pub fn cloud(points: Vec<Point>, normals: Vec<[f32; 3]>) -> Self {
        let n_points = points.len();
        Self {
            vertices: points,
            vertex_face: vec![0; n_points],
            triangles: (0..).take(n_points).map(|point| [point; 3]).collect(),
            tri_face: vec![0; n_points],
            vertex_normal: normals,
        }
    }

    /// Whether every triangle is a single point with a normal.
    #[must_use]
    pub fn is_cloud(&self) -> bool {
        let is_point = |&[a, b, c]: &[u32; 3]| a == b && b == c;
        let has_normals = self.vertex_normal.len() == self.vertices.len();
        has_normals && !self.triangles.is_empty() && self.triangles.iter().all(is_point)
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cloud_is_distinguished_from_a_mesh() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        let cloud = Mesh::cloud(points, vec![[0.0, 0.0, 1.0]; 3]);
        assert!(cloud.is_cloud());
        assert_eq!(cloud.corners(1), [[1.0, 0.0, 0.0]; 3]);

        let one_triangle = Mesh {
            triangles: vec![[0, 0, 0], [0, 1, 2]],
            ..cloud.clone()
        };
        let without_normals = Mesh {
            vertex_normal: Vec::new(),
            ..cloud
        };
        for mesh in [one_triangle, without_normals, Mesh::default()] {
            assert!(!mesh.is_cloud(), "{mesh:?}");
        }
    }
}
