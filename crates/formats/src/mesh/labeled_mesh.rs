//! Defines the mesh of PLY and OBJ files: positions and, for each triangle, its part, source face and color.

use partprobe_carrier::{Carrier, Point, smooth_normals, weld};
use std::collections::BTreeMap;

/// Triangles with their data in a mesh file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabeledMesh {
    /// Vertex positions, in millimeters.
    pub vertices: Vec<Point>,
    /// Unit normals of the vertices. They are empty if vertices are shared between faces.
    pub normals: Vec<[f32; 3]>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// Source face of each triangle.
    pub face: Vec<u32>,
    /// Part (or another label) of each triangle.
    pub part: Vec<i32>,
    /// Code of the primitive type of each triangle's face.
    pub face_type: Vec<u8>,
    /// Color of each triangle.
    pub color: Vec<[u8; 3]>,
}

impl LabeledMesh {
    /// The carrier with one vertex at each position: faces are connected, and a closed solid is watertight.
    ///
    /// `part_of_face` and `color_of_face` have one entry per face of the carrier. Missing entries are −1 or black.
    #[must_use]
    pub fn welded(carrier: &Carrier, part_of_face: &[i32], color_of_face: &[[u8; 3]]) -> Self {
        let welded = weld(carrier.mesh());
        Self::new(
            carrier,
            part_of_face,
            color_of_face,
            welded.vertices,
            welded.triangles,
            Vec::new(),
        )
    }

    /// The carrier without changes: each vertex belongs to one face and has a normal.
    #[must_use]
    pub fn split_at_faces(
        carrier: &Carrier,
        part_of_face: &[i32],
        color_of_face: &[[u8; 3]],
    ) -> Self {
        let mesh = carrier.mesh();
        let (vertices, triangles) = (mesh.vertices.clone(), mesh.triangles.clone());
        Self::new(
            carrier,
            part_of_face,
            color_of_face,
            vertices,
            triangles,
            smooth_normals(mesh),
        )
    }

    fn new(
        carrier: &Carrier,
        part_of_face: &[i32],
        color_of_face: &[[u8; 3]],
        vertices: Vec<Point>,
        triangles: Vec<[u32; 3]>,
        normals: Vec<[f32; 3]>,
    ) -> Self {
        let (face, faces) = (carrier.mesh().tri_face.clone(), &carrier.graph().faces);
        let at = |&face: &u32| face as usize;
        Self {
            vertices,
            normals,
            triangles,
            part: face
                .iter()
                .map(|face| part_of_face.get(at(face)).copied().unwrap_or(-1))
                .collect(),
            face_type: face
                .iter()
                .map(|face| faces[at(face)].face_type.code())
                .collect(),
            color: face
                .iter()
                .map(|face| color_of_face.get(at(face)).copied().unwrap_or_default())
                .collect(),
            face,
        }
    }

    /// These triangles, in their order, with only the vertices that they use. Indices beyond the mesh are left out.
    #[must_use]
    pub fn subset(&self, triangles: &[usize]) -> Self {
        let mut kept = Self::default();
        let mut new_index = BTreeMap::new();
        for &triangle in triangles
            .iter()
            .filter(|&&triangle| triangle < self.triangles.len())
        {
            let corners = self.triangles[triangle].map(|vertex| {
                *new_index.entry(vertex).or_insert_with(|| {
                    kept.vertices.push(self.vertices[vertex as usize]);
                    kept.normals.extend(self.normals.get(vertex as usize));
                    kept.vertices.len() as u32 - 1
                })
            });
            kept.triangles.push(corners);
            kept.face.push(self.face[triangle]);
            kept.part.push(self.part[triangle]);
            kept.face_type.push(self.face_type[triangle]);
            kept.color.push(self.color[triangle]);
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;

    const COLORS: [[u8; 3]; 3] = [[1, 2, 3], [1, 2, 3], [9, 9, 9]];

    #[test]
    fn welding_joins_faces_and_keeps_triangles() {
        let carrier = three_squares();
        let welded = LabeledMesh::welded(&carrier, carrier.part_of_face(), &COLORS);
        assert_eq!((welded.vertices.len(), welded.normals.len()), (8, 0));
        assert_eq!(welded.triangles[2..4], [[1, 4, 5], [1, 5, 2]]);
        assert_eq!(
            (&welded.part[..], &welded.face[..]),
            (&[0, 0, 0, 0, 1, 1][..], &[0, 0, 1, 1, 2, 2][..])
        );
        assert_eq!((welded.face_type[5], welded.color[5]), (1, [9; 3]));
        let split = LabeledMesh::split_at_faces(&carrier, carrier.part_of_face(), &COLORS);
        assert_eq!((split.vertices.len(), split.normals.len()), (12, 12));
    }

    #[test]
    fn a_part_keeps_only_its_own_vertices() {
        let carrier = three_squares();
        let mesh = LabeledMesh::welded(&carrier, carrier.part_of_face(), &COLORS);
        let part = mesh.subset(&[4, 5, 99]);
        assert_eq!(
            (part.vertices.len(), &part.triangles[..]),
            (4, &[[0, 1, 2], [0, 2, 3]][..])
        );
        assert_eq!((part.vertices[0], part.face[0]), ([2.0, 0.0, 0.0], 2));
        assert_eq!(mesh.subset(&[]), LabeledMesh::default());
    }
}
