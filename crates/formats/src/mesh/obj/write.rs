//! Writes Wavefront OBJ with its label files: one line per triangle, in the order of the `f` lines.

use crate::mesh::labeled_mesh::LabeledMesh;
use std::fmt::Write;

/// The text of an OBJ file: `v` lines (and `vn` if there are normals), then `f` lines in the order of the triangles.
///
/// There are no groups and no materials: programs that split a mesh by them change the order of its triangles, on which the label
/// files depend. Numbers are written such that they can be read back exactly.
#[must_use]
pub fn mesh_to_obj(mesh: &LabeledMesh) -> String {
    let mut text = String::new();
    // Writing to a string does not fail.
    for [x, y, z] in &mesh.vertices {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [x, y, z] in &mesh.normals {
        let _ = writeln!(text, "vn {x} {y} {z}");
    }
    for corners in &mesh.triangles {
        let [a, b, c] = corners.map(|corner| corner + 1);
        let _ = if mesh.normals.is_empty() {
            writeln!(text, "f {a} {b} {c}")
        } else {
            writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")
        };
    }
    text
}

/// One integer per line: the `.seg` and `.fidx` files of a mesh.
#[must_use]
pub fn integer_lines<T: ToString>(values: &[T]) -> String {
    values
        .iter()
        .map(|value| value.to_string() + "\n")
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;

    #[test]
    fn lines_are_those_of_the_mesh() {
        let carrier = three_squares();
        let mesh = LabeledMesh::welded(&carrier, carrier.part_of_face(), &[]);
        let obj = mesh_to_obj(&mesh);
        assert_eq!(
            obj.lines().filter(|line| line.starts_with("v ")).nth(4),
            Some("v 2 0 0")
        );
        assert_eq!(
            obj.lines().rfind(|line| line.starts_with("f ")),
            Some("f 5 8 6")
        );
        assert_eq!(integer_lines(&mesh.part), "0\n0\n0\n0\n1\n1\n");
        let split = mesh_to_obj(&LabeledMesh::split_at_faces(
            &carrier,
            carrier.part_of_face(),
            &[],
        ));
        assert!(split.contains("vn 0 0 1\nf 1//1 2//2 3//3\n"), "{split}");
    }

    #[test]
    fn coordinates_read_back_exactly() {
        let vertices = vec![[0.1 + 0.2, -1e-17, 1.0 / 3.0]];
        let obj = mesh_to_obj(&LabeledMesh {
            vertices: vertices.clone(),
            ..LabeledMesh::default()
        });
        let numbers: Vec<f64> = obj
            .split_whitespace()
            .skip(1)
            .map(|word| word.parse().unwrap())
            .collect();
        assert_eq!(numbers, vertices[0]);
    }
}
