//! Reads STL, binary and text. Normals are not read, because the order of the corners determines them.

use crate::mesh::foreign::{MeshFileError, bad_line, mesh_of, numbers, point};
use partprobe_carrier::{Mesh, Point};

const HEADER_BYTES: usize = 80;
const TRIANGLE_BYTES: usize = 50;

/// The mesh of an STL file. Each triangle has its own corners.
///
/// # Errors
/// If the file ends too early, a line cannot be read, or there is no triangle.
pub fn mesh_from_stl(bytes: &[u8]) -> Result<Mesh, MeshFileError> {
    let vertices = match binary_body(bytes) {
        Some(body) => binary_vertices(body),
        None => text_vertices(bytes)?,
    };
    if !vertices.len().is_multiple_of(3) {
        return Err(MeshFileError::Truncated);
    }
    let polygons: Vec<Vec<i64>> = (0..vertices.len() as i64 / 3)
        .map(|k| vec![3 * k, 3 * k + 1, 3 * k + 2])
        .collect();
    mesh_of(vertices, &polygons)
}

/// The triangles of a binary file. Its length must fit its count, which is very unlikely for a text.
fn binary_body(bytes: &[u8]) -> Option<&[u8]> {
    let count = bytes.get(HEADER_BYTES..)?.first_chunk::<4>()?;
    let body = &bytes[HEADER_BYTES + 4..];
    let n_bytes = (u32::from_le_bytes(*count) as usize).checked_mul(TRIANGLE_BYTES)?;
    body.get(..n_bytes)
        .filter(|_| body.len() < n_bytes + TRIANGLE_BYTES)
}

fn binary_vertices(body: &[u8]) -> Vec<Point> {
    let (triangles, _) = body.as_chunks::<TRIANGLE_BYTES>();
    let corners = triangles
        .iter()
        .flat_map(|triangle| triangle[12..48].as_chunks::<12>().0);
    corners
        .map(|corner| {
            let (words, _) = corner.as_chunks::<4>();
            [0, 1, 2].map(|axis| f64::from(f32::from_le_bytes(words[axis])))
        })
        .collect()
}

fn text_vertices(bytes: &[u8]) -> Result<Vec<Point>, MeshFileError> {
    let text = String::from_utf8_lossy(bytes);
    if !text.trim_start().starts_with("solid") {
        return Err(MeshFileError::Kind("an STL file, or one that is cut off"));
    }
    let mut vertices = Vec::new();
    for place in (1..).zip(text.lines()) {
        if let Some(rest) = place.1.trim_start().strip_prefix("vertex") {
            let values = numbers(rest.split_ascii_whitespace(), place)?;
            vertices.push(point(&values).ok_or_else(|| bad_line(place.0, place.1))?);
        }
    }
    Ok(vertices)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::foreign::tests::corners;

    const CORNERS: [Point; 3] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.5, 0.0]];

    fn binary(n_claimed: u32) -> Vec<u8> {
        let mut bytes = vec![b' '; HEADER_BYTES];
        bytes.extend(n_claimed.to_le_bytes());
        bytes.extend([0; 12]);
        bytes.extend(
            CORNERS
                .as_flattened()
                .iter()
                .flat_map(|&x| (x as f32).to_le_bytes()),
        );
        bytes.extend([0; 2]);
        bytes
    }

    #[test]
    fn text_and_bytes_give_the_same() {
        let vertex = |[x, y, z]: Point| format!("      vertex {x} {y} {z:e}\n");
        let text = format!(
            "solid a\n facet normal 0 0 1\n  outer loop\n{}  endloop",
            CORNERS.map(vertex).concat()
        );
        assert_eq!(corners(&mesh_from_stl(text.as_bytes()).unwrap()), [CORNERS]);
        assert_eq!(corners(&mesh_from_stl(&binary(1)).unwrap()), [CORNERS]);
    }

    #[test]
    fn damage_is_named() {
        let cut_off = MeshFileError::Kind("an STL file, or one that is cut off");
        assert_eq!(mesh_from_stl(&binary(u32::MAX)), Err(cut_off));
        assert_eq!(
            mesh_from_stl(b"solid a\nvertex 0 0 0\n"),
            Err(MeshFileError::Truncated)
        );
        assert_eq!(
            mesh_from_stl(b"solid a\nvertex 0 x 0\n"),
            Err(bad_line(2, "vertex 0 x 0"))
        );
        assert_eq!(mesh_from_stl(b"solid a\n"), Err(MeshFileError::NoFace));
    }
}
