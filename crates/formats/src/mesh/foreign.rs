//! Makes a [`Mesh`] of one face from the vertices and polygons of a foreign file (OBJ, OFF, STL or PLY).
//!
//! Polygons are divided into fans. Colors, textures and groups are skipped. Units are assumed to be millimeters.

use partprobe_carrier::{Mesh, Point};

/// The reason why bytes are not a mesh that partprobe reads.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The file does not begin like a file of its kind.
    #[error("not {0}; check the extension of the file")]
    Kind(&'static str),
    /// A line cannot be read.
    #[error("line {line}: `{text}` can't be understood")]
    Line {
        /// The number of the line, counted from 1.
        line: usize,
        /// The line, or its beginning.
        text: String,
    },
    /// A header line of a PLY file cannot be read.
    #[error("header line `{0}` can't be understood")]
    Header(String),
    /// The file ends before all the data that its header declares.
    #[error("the file ends too early; it may be cut off")]
    Truncated,
    /// A polygon names a vertex that does not exist.
    #[error("a face names vertex {vertex}, but there are only {n_vertices}")]
    Index {
        /// The index, counted from 0.
        vertex: i64,
        /// The number of vertices.
        n_vertices: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {0} has a coordinate that is not a finite number")]
    NotFinite(usize),
    /// There is no surface.
    #[error("the file has no face")]
    NoFace,
}

/// A mesh of these vertices and polygons, if they fit together.
pub(crate) fn mesh_of(vertices: Vec<Point>, polygons: &[Vec<i64>]) -> Result<Mesh, MeshFileError> {
    let n_vertices = vertices.len();
    if let Some(vertex) = vertices
        .iter()
        .position(|vertex| vertex.iter().any(|x| !x.is_finite()))
    {
        return Err(MeshFileError::NotFinite(vertex));
    }
    let index = |&vertex: &i64| {
        let known = usize::try_from(vertex)
            .ok()
            .filter(|&vertex| vertex < n_vertices);
        known
            .and_then(|vertex| u32::try_from(vertex).ok())
            .ok_or(MeshFileError::Index { vertex, n_vertices })
    };
    let mut triangles = Vec::new();
    for polygon in polygons {
        let corners = polygon.iter().map(index).collect::<Result<Vec<u32>, _>>()?;
        triangles.extend(
            corners
                .windows(2)
                .skip(1)
                .map(|pair| [corners[0], pair[0], pair[1]]),
        );
    }
    if triangles.is_empty() {
        return Err(MeshFileError::NoFace);
    }
    let (vertex_face, tri_face) = (vec![0; n_vertices], vec![0; triangles.len()]);
    Ok(Mesh {
        vertices,
        vertex_face,
        triangles,
        tri_face,
        vertex_normal: Vec::new(),
    })
}

/// The numbers of a line, or an error that names the line.
pub(crate) fn numbers<'a, T: std::str::FromStr>(
    words: impl Iterator<Item = &'a str>,
    (line, text): (usize, &str),
) -> Result<Vec<T>, MeshFileError> {
    words
        .map(|word| word.parse().map_err(|_| bad_line(line, text)))
        .collect()
}

pub(crate) fn bad_line(line: usize, text: &str) -> MeshFileError {
    MeshFileError::Line {
        line,
        text: text.chars().take(40).collect(),
    }
}

pub(crate) fn point(values: &[f64]) -> Option<Point> {
    values.first_chunk::<3>().copied()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The corners of each triangle, which every reader must keep.
    pub(crate) fn corners(mesh: &Mesh) -> Vec<[Point; 3]> {
        (0..mesh.triangles.len())
            .map(|triangle| mesh.corners(triangle))
            .collect()
    }

    #[test]
    fn what_does_not_fit_together_is_named() {
        let square = || vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        assert_eq!(
            mesh_of(square(), &[vec![0, 1, 2, 3]]).unwrap().triangles,
            [[0, 1, 2], [0, 2, 3]]
        );
        assert_eq!(
            mesh_of(square(), &[vec![0, 1, 4]]),
            Err(MeshFileError::Index {
                vertex: 4,
                n_vertices: 4
            })
        );
        assert_eq!(
            mesh_of(square(), &[vec![0, 1, -1]]),
            Err(MeshFileError::Index {
                vertex: -1,
                n_vertices: 4
            })
        );
        assert_eq!(
            mesh_of(square(), &[vec![0, 1], vec![]]),
            Err(MeshFileError::NoFace)
        );
        assert_eq!(
            mesh_of(vec![[f64::NAN; 3]], &[vec![0, 0, 0]]),
            Err(MeshFileError::NotFinite(0))
        );
    }
}
