//! Reads Geomview OFF in text form.

use crate::mesh::foreign::{MeshFileError, bad_line, mesh_of, numbers, point};
use partprobe_carrier::{Mesh, Point};

/// The mesh of an OFF file (also COFF and NOFF, of which only positions are used).
///
/// # Errors
/// If the file is not an OFF file, a line cannot be read, lines are missing, or there is no face.
pub fn mesh_from_off(bytes: &[u8]) -> Result<Mesh, MeshFileError> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = (1..)
        .zip(text.lines())
        .map(|(line, text)| (line, text.split('#').next().unwrap_or(text).trim()))
        .filter(|(_, text)| !text.is_empty());
    let [n_vertices, n_faces] = counts(&mut lines)?;
    let mut vertices = Vec::new();
    for _ in 0..n_vertices {
        vertices.push(vertex(lines.next().ok_or(MeshFileError::Truncated)?)?);
    }
    let mut polygons = Vec::new();
    for _ in 0..n_faces {
        polygons.push(polygon(lines.next().ok_or(MeshFileError::Truncated)?)?);
    }
    mesh_of(vertices, &polygons)
}

/// The number of a line, and its text without comments.
type Line<'t> = (usize, &'t str);

/// The numbers of vertices and faces, which follow the keyword.
fn counts<'t>(lines: &mut impl Iterator<Item = Line<'t>>) -> Result<[usize; 2], MeshFileError> {
    let (line, first) = lines.next().ok_or(MeshFileError::Truncated)?;
    let keyword = first
        .find("OFF")
        .ok_or(MeshFileError::Kind("an OFF file"))?;
    let (kind, rest) = first.split_at(keyword + "OFF".len());
    if kind.len() > "STCNOFF".len() {
        return Err(MeshFileError::Kind("an OFF file"));
    }
    // Some programs write the counts on the line of the keyword.
    let counts = if rest.trim().is_empty() {
        lines.next().ok_or(MeshFileError::Truncated)?
    } else {
        (line, rest)
    };
    let found: Vec<usize> = numbers(counts.1.split_ascii_whitespace(), counts)?;
    match found.as_slice() {
        &[n_vertices, n_faces, ..] => Ok([n_vertices, n_faces]),
        _ => Err(bad_line(counts.0, counts.1)),
    }
}

fn vertex(line: Line<'_>) -> Result<Point, MeshFileError> {
    let values = numbers(line.1.split_ascii_whitespace().take(3), line)?;
    point(&values).ok_or_else(|| bad_line(line.0, line.1))
}

/// The corners of a face. Colors may follow them.
fn polygon(line: Line<'_>) -> Result<Vec<i64>, MeshFileError> {
    let mut words = line.1.split_ascii_whitespace();
    let count: Vec<usize> = numbers(words.by_ref().take(1), line)?;
    let corners: Vec<i64> = numbers(words.take(count[0]), line)?;
    if corners.len() < count[0] {
        return Err(bad_line(line.0, line.1));
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_can_be_on_either_line() {
        for text in [
            "OFF\n# four corners\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 255 0 0\n",
            "COFF 4 1 0\n0 0 0 9 9 9 9\n1 0 0\n1 1 0\n0 1 0\n\n4 0 1 2 3\n",
        ] {
            assert_eq!(
                mesh_from_off(text.as_bytes()).unwrap().triangles,
                [[0, 1, 2], [0, 2, 3]]
            );
        }
    }

    #[test]
    fn damage_is_located() {
        for (text, expected) in [
            ("solid\n", MeshFileError::Kind("an OFF file")),
            ("", MeshFileError::Truncated),
            ("OFF\n9 9\n0 0 0\n", MeshFileError::Truncated),
            ("OFF\n1\n", bad_line(2, "1")),
            ("OFF\n1 1 0\n0 0 0\n3 0 0\n", bad_line(4, "3 0 0")),
            (
                "OFF\n1 1 0\n0 0 0\n3 0 0 1\n",
                MeshFileError::Index {
                    vertex: 1,
                    n_vertices: 1,
                },
            ),
        ] {
            assert_eq!(mesh_from_off(text.as_bytes()), Err(expected));
        }
    }
}
