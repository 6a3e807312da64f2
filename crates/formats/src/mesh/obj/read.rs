//! Reads Wavefront OBJ: the lines `v` and `f`.

use crate::mesh::foreign::{MeshFileError, bad_line, mesh_of, numbers, point};
use partprobe_carrier::Mesh;

/// The mesh of an OBJ file; whatever is no vertex and no face is skipped.
///
/// # Errors
/// If a vertex or a face cannot be read, or there is no face.
pub fn mesh_from_obj(bytes: &[u8]) -> Result<Mesh, MeshFileError> {
    let (mut vertices, mut polygons) = (Vec::new(), Vec::new());
    for (idx, text) in String::from_utf8_lossy(bytes).lines().enumerate() {
        let place = (idx + 1, text);
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let values = numbers(words.take(3), place)?;
                vertices.push(point(&values).ok_or_else(|| bad_line(place.0, text))?);
            }
            Some("f") => {
                // `vertex/texture/normal`; negative indices count from the last vertex so far.
                let corners: Vec<i64> = numbers(
                    words.map(|word| word.split('/').next().unwrap_or(word)),
                    place,
                )?;
                let from_start = |corner: i64| match corner {
                    1.. => corner - 1,
                    0 => -1,
                    _ => vertices.len() as i64 + corner,
                };
                polygons.push(corners.into_iter().map(from_start).collect());
            }
            _ => {}
        }
    }
    mesh_of(vertices, &polygons)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::foreign::tests::corners;

    #[test]
    fn polygons_textures_and_negative_indices_are_read() {
        let text = "# a comment\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nvn 0 0 1\nf 1/2/3 2//1 3\nv 0 1 0\nf -4 -2 -1\n";
        let found = corners(&mesh_from_obj(text.as_bytes()).unwrap());
        let [a, b, c, d] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
        ];
        assert_eq!(found, [[a, b, c], [a, c, d]]);
    }

    #[test]
    fn damage_is_located() {
        for (text, expected) in [
            ("v 0 0\n", bad_line(1, "v 0 0")),
            ("v 0 0 0\nf 1 x 1\n", bad_line(2, "f 1 x 1")),
            (
                "v 0 0 0\nf 0 1 1\n",
                MeshFileError::Index {
                    vertex: -1,
                    n_vertices: 1,
                },
            ),
            ("", MeshFileError::NoFace),
        ] {
            assert_eq!(mesh_from_obj(text.as_bytes()), Err(expected));
        }
    }
}
