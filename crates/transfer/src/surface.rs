//! Defines labeled triangles, and the reasons why labels cannot be carried.

use partprobe_carrier::{Mesh, Point, unit_normal};

/// Triangles in space, borrowed from a mesh of any kind.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    vertices: &'a [Point],
    triangles: &'a [[u32; 3]],
}

impl<'a> Surface<'a> {
    /// The triangles with these corners.
    ///
    /// # Errors
    /// If a corner is not a vertex, or a coordinate is not a finite number.
    pub fn new(vertices: &'a [Point], triangles: &'a [[u32; 3]]) -> Result<Self, TransferError> {
        let n_vertices = vertices.len();
        let outside =
            |corners: &[u32; 3]| corners.iter().any(|&corner| corner as usize >= n_vertices);
        if let Some(triangle) = triangles.iter().position(outside) {
            return Err(TransferError::Corner {
                triangle,
                n_vertices,
            });
        }

        let infinite = |vertex: &Point| vertex.iter().any(|x| !x.is_finite());
        match vertices.iter().position(infinite) {
            Some(vertex) => Err(TransferError::Coordinate { vertex }),
            None => Ok(Self {
                vertices,
                triangles,
            }),
        }
    }

    /// The triangles of a mesh that a carrier holds.
    ///
    /// # Errors
    /// As [`Surface::new`].
    pub fn of_mesh(mesh: &'a Mesh) -> Result<Self, TransferError> {
        Self::new(&mesh.vertices, &mesh.triangles)
    }

    /// The positions of the vertices.
    #[must_use]
    pub fn vertices(&self) -> &'a [Point] {
        self.vertices
    }

    /// The corners of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &'a [[u32; 3]] {
        self.triangles
    }

    /// The positions of a triangle's corners.
    #[must_use]
    pub fn corners(&self, triangle: usize) -> [Point; 3] {
        self.triangles[triangle].map(|vertex| self.vertices[vertex as usize])
    }

    /// The unit normal of a triangle. It is 0 if the triangle has no area.
    #[must_use]
    pub fn normal(&self, triangle: usize) -> Point {
        unit_normal(self.corners(triangle))
    }
}

/// Triangles with one label each. A negative label means that the triangle has none.
#[derive(Clone, Copy, Debug)]
pub struct LabeledSurface<'a> {
    surface: Surface<'a>,
    labels: &'a [i32],
}

impl<'a> LabeledSurface<'a> {
    /// Gives each triangle its label.
    ///
    /// # Errors
    /// If there are more or fewer labels than triangles.
    pub fn new(surface: Surface<'a>, labels: &'a [i32]) -> Result<Self, TransferError> {
        let n_triangles = surface.triangles().len();
        if labels.len() == n_triangles {
            Ok(Self { surface, labels })
        } else {
            Err(TransferError::LabelCount {
                n_labels: labels.len(),
                n_triangles,
            })
        }
    }

    /// The triangles.
    #[must_use]
    pub fn surface(&self) -> Surface<'a> {
        self.surface
    }

    /// The label of each triangle.
    #[must_use]
    pub fn labels(&self) -> &'a [i32] {
        self.labels
    }
}

/// The reason why labels cannot be carried.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TransferError {
    /// A triangle has a corner that is not a vertex.
    #[error("triangle {triangle} has a corner beyond the {n_vertices} vertices")]
    Corner {
        /// The triangle.
        triangle: usize,
        /// How many vertices there are.
        n_vertices: usize,
    },
    /// A vertex has no valid position.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    Coordinate {
        /// The vertex.
        vertex: usize,
    },
    /// The number of labels differs from the number of triangles.
    #[error("there are {n_labels} labels for {n_triangles} triangles")]
    LabelCount {
        /// How many labels there are.
        n_labels: usize,
        /// How many triangles there are.
        n_triangles: usize,
    },
    /// Labels are to be carried by index, but the two surfaces do not have the same number of triangles.
    #[error(
        "the labeled surface has {n_labeled} triangles and the other {n_triangles}; labels can be carried by index only if \
         both are the same"
    )]
    OtherCount {
        /// How many triangles the labeled surface has.
        n_labeled: usize,
        /// How many triangles the other surface has.
        n_triangles: usize,
    },
    /// The list of points and the list of their triangles or normals have different lengths.
    #[error("there are {n_points} points, and {found} entries in `{list}`")]
    PointCount {
        /// The list with the other length.
        list: &'static str,
        /// How many points there are.
        n_points: usize,
        /// How many entries the list has.
        found: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_surfaces_are_refused_by_number() {
        let plane = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let beyond = Surface::new(&plane, &[[0, 1, 2], [0, 1, 3]]).unwrap_err();
        assert_eq!(
            beyond,
            TransferError::Corner {
                triangle: 1,
                n_vertices: 3
            }
        );

        let nowhere = [[0.0; 3], [f64::NAN, 0.0, 0.0]];
        assert_eq!(
            Surface::new(&nowhere, &[]).unwrap_err(),
            TransferError::Coordinate { vertex: 1 }
        );

        let surface = Surface::new(&plane, &[[0, 1, 2]]).unwrap();
        assert_eq!(
            LabeledSurface::new(surface, &[1, 2]).unwrap_err(),
            TransferError::LabelCount {
                n_labels: 2,
                n_triangles: 1
            }
        );
        assert_eq!(surface.normal(0), [0.0, 0.0, 1.0]);
        let needle = Surface::new(&plane, &[[0, 1, 1]]).unwrap();
        assert_eq!(needle.normal(0), [0.0; 3]);
    }
}
