//! Writes PLY meshes, binary little endian: `int part face type` and one color per triangle.

use crate::mesh::labeled_mesh::LabeledMesh;

/// The bytes of a mesh.
///
/// Vertices are doubles, so that equal positions stay equal. If each vertex belongs to one face (there are normals), vertices
/// also have a normal and a color, for programs that show only the colors of vertices.
#[must_use]
pub fn mesh_to_ply(mesh: &LabeledMesh) -> Vec<u8> {
    let vertex_colors = if mesh.normals.is_empty() {
        Vec::new()
    } else {
        colors_of_vertices(mesh)
    };
    let mut bytes = header(mesh).into_bytes();
    for (vertex, position) in mesh.vertices.iter().enumerate() {
        bytes.extend(position.iter().flat_map(|x| x.to_le_bytes()));
        bytes.extend(
            mesh.normals
                .get(vertex)
                .into_iter()
                .flatten()
                .flat_map(|x| x.to_le_bytes()),
        );
        bytes.extend(vertex_colors.get(vertex).into_iter().flatten());
    }
    for (triangle, corners) in mesh.triangles.iter().enumerate() {
        bytes.push(3);
        bytes.extend(corners.iter().flat_map(|corner| corner.to_le_bytes()));
        bytes.extend(mesh.part[triangle].to_le_bytes());
        bytes.extend(mesh.face[triangle].to_le_bytes());
        bytes.extend(i32::from(mesh.face_type[triangle]).to_le_bytes());
        bytes.extend(mesh.color[triangle]);
    }
    bytes
}

fn header(mesh: &LabeledMesh) -> String {
    let mut lines = vec![
        "ply".to_owned(),
        "format binary_little_endian 1.0".to_owned(),
    ];
    lines.push(format!("element vertex {}", mesh.vertices.len()));
    lines.extend(["x", "y", "z"].map(|axis| format!("property double {axis}")));
    if !mesh.normals.is_empty() {
        lines.extend(["nx", "ny", "nz"].map(|axis| format!("property float {axis}")));
        lines.extend(["red", "green", "blue"].map(|channel| format!("property uchar {channel}")));
    }
    lines.push(format!("element face {}", mesh.triangles.len()));
    lines.push("property list uchar int vertex_indices".to_owned());
    lines.extend(["part", "face", "type"].map(|label| format!("property int {label}")));
    lines.extend(["red", "green", "blue"].map(|channel| format!("property uchar {channel}")));
    lines.push("end_header\n".to_owned());
    lines.join("\n")
}

/// The color of the triangles at each vertex. A vertex without a triangle is black.
fn colors_of_vertices(mesh: &LabeledMesh) -> Vec<[u8; 3]> {
    let mut colors = vec![[0; 3]; mesh.vertices.len()];
    for (corners, &color) in mesh.triangles.iter().zip(&mesh.color) {
        corners
            .iter()
            .for_each(|&vertex| colors[vertex as usize] = color);
    }
    colors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;
    use crate::mesh::ply::points::points_from_ply;

    const COLORS: [[u8; 3]; 3] = [[1, 2, 3], [4, 5, 6], [7, 8, 9]];

    #[test]
    fn a_triangle_carries_its_labels() {
        let carrier = three_squares();
        let mesh = LabeledMesh::welded(&carrier, carrier.part_of_face(), &COLORS);
        let bytes = mesh_to_ply(&mesh);
        let stride = 1 + 12 + 12 + 3;
        let last = &bytes[bytes.len() - stride..];
        let int = |at: usize| i32::from_le_bytes(*last[at..].first_chunk().unwrap());
        assert_eq!(
            (last[0], [1, 5, 9].map(int), [13, 17, 21].map(int)),
            (3, [4, 7, 5], [1, 2, 1])
        );
        assert_eq!(last[25..], [7, 8, 9]);
        let vertices = points_from_ply(&bytes).unwrap();
        assert_eq!(
            (vertices.points.len(), vertices.points[4]),
            (8, [2.0, 0.0, 0.0])
        );
        assert_eq!(bytes.len(), header(&mesh).len() + 8 * 24 + 6 * stride);
    }

    #[test]
    fn vertices_of_one_face_carry_normal_and_color() {
        let carrier = three_squares();
        let mesh = LabeledMesh::split_at_faces(&carrier, carrier.part_of_face(), &COLORS);
        let bytes = mesh_to_ply(&mesh);
        let vertices = points_from_ply(&bytes).unwrap();
        assert_eq!(vertices.normals, vec![[0.0, 0.0, 1.0]; 12]);
        let first = header(&mesh).len();
        assert_eq!(bytes[first + 36..first + 39], [1, 2, 3]);
        assert_eq!(bytes[first + 39 * 4 + 36..][..3], [4, 5, 6]);
    }
}
