//! Makes the mesh of a shape for PartField: welded, with small triangles, as one OBJ without groups or materials.
//!
//! PartField gives each triangle one label, so a large plane face of two triangles could not be divided. PartField also needs
//! more triangles than clusters. An upper limit for edges solves both problems.

use crate::mesh::labeled_mesh::LabeledMesh;
use crate::mesh::obj::write::mesh_to_obj;
use partprobe_carrier::{Mesh, Point, bounding_box, refine, refined_triangle_counts, weld};

/// The smallest number of triangles. With fewer triangles, the clustering script cannot make 20 clusters and stops with an error.
const MIN_TRIANGLES: usize = 21;

/// The width of PartField's cube, which extends from −0.9 to 0.9 along the longest axis.
const CUBE_WIDTH: f64 = 1.8;

/// The limits for the edges and for the size of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PartFieldLimits {
    /// The longest edge, as a fraction of the diagonal of the bounding box. It must be positive.
    pub max_edge: f64,
    /// The largest number of triangles.
    pub max_triangles: u32,
}

/// A mesh for PartField, with its relation to the original mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct PartFieldMesh {
    /// One vertex at each position, in millimeters. Each one is a corner of a triangle.
    pub vertices: Vec<Point>,
    /// Vertex indices of each triangle.
    pub triangles: Vec<[u32; 3]>,
    /// The triangle of the original mesh that contains each triangle.
    pub parent: Vec<u32>,
    /// The center of the bounding box, which PartField moves to 0.
    pub center: Point,
    /// The factor by which PartField multiplies positions after the translation.
    pub scale: f64,
}

/// The reason why PartField cannot use a shape.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PartFieldRefusal {
    /// There are no triangles.
    #[error("it has no triangles")]
    NoTriangles,
    /// All vertices are at the same position, or one has no finite position.
    #[error("it has no extent, so that PartField cannot scale it")]
    NoExtent,
    /// There are fewer triangles than clusters.
    #[error(
        "it has {found} triangles, and PartField needs at least {MIN_TRIANGLES}; use a smaller --max-edge"
    )]
    TooFew {
        /// The number of triangles.
        found: usize,
    },
    /// There are more triangles than allowed.
    #[error(
        "it has more than {most} triangles if no edge is longer than {max_edge_mm:.3} mm; raise --max-edge or --max-triangles"
    )]
    TooMany {
        /// The largest allowed number.
        most: u32,
        /// The longest allowed edge.
        max_edge_mm: f64,
    },
}

impl PartFieldMesh {
    /// The mesh of a carrier in smaller triangles.
    ///
    /// # Errors
    /// If PartField cannot use the shape, or the mesh becomes too large.
    pub fn new(mesh: &Mesh, limits: &PartFieldLimits) -> Result<Self, PartFieldRefusal> {
        if mesh.triangles.is_empty() {
            return Err(PartFieldRefusal::NoTriangles);
        }
        let max_edge_mm = limits.max_edge * mesh.diagonal();
        let is_extended = max_edge_mm.is_finite() && max_edge_mm > 0.0;
        if !is_extended {
            return Err(PartFieldRefusal::NoExtent);
        }
        if n_refined(mesh, max_edge_mm, limits.max_triangles) > limits.max_triangles {
            return Err(PartFieldRefusal::TooMany {
                most: limits.max_triangles,
                max_edge_mm,
            });
        }

        let refined = refine(mesh, max_edge_mm);
        let welded = weld(&refined.mesh);
        let (vertices, triangles) = without_unused(&welded.vertices, &welded.triangles);
        if triangles.len() < MIN_TRIANGLES {
            return Err(PartFieldRefusal::TooFew {
                found: triangles.len(),
            });
        }
        let (center, scale) = pose(&vertices).ok_or(PartFieldRefusal::NoExtent)?;
        Ok(Self {
            vertices,
            triangles,
            parent: refined.parent,
            center,
            scale,
        })
    }

    /// The text of an OBJ file: one object without groups and materials, so that a reader keeps the order of its triangles.
    #[must_use]
    pub fn to_obj(&self) -> String {
        mesh_to_obj(&LabeledMesh {
            vertices: self.vertices.clone(),
            triangles: self.triangles.clone(),
            ..LabeledMesh::default()
        })
    }
}

/// The number of triangles of a refined mesh. Counting stops after `most`.
fn n_refined(mesh: &Mesh, max_edge_mm: f64, most: u32) -> u32 {
    let n_faces = mesh
        .tri_face
        .iter()
        .max()
        .map_or(0, |&last| last as usize + 1);
    let one_part = vec![0; n_faces];
    let counts = refined_triangle_counts(mesh, &one_part, max_edge_mm, most.saturating_add(1));
    counts.first().copied().unwrap_or_default()
}

/// The vertices that triangles use, in the order of their first use.
fn without_unused(vertices: &[Point], triangles: &[[u32; 3]]) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut new_index: Vec<Option<u32>> = vec![None; vertices.len()];
    let mut used = Vec::new();
    let mut index = |old: u32| {
        *new_index[old as usize].get_or_insert_with(|| {
            used.push(vertices[old as usize]);
            (used.len() - 1) as u32
        })
    };
    let triangles = triangles
        .iter()
        .map(|corners| corners.map(&mut index))
        .collect();
    (used, triangles)
}

/// The translation and the scale of PartField's `dataloader.py`.
fn pose(vertices: &[Point]) -> Option<(Point, f64)> {
    let [low, high] = bounding_box(vertices)?;
    let center = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    let widest = (0..3)
        .map(|axis| high[axis] - low[axis])
        .fold(0.0, f64::max);
    let scale = CUBE_WIDTH / widest;
    scale.is_finite().then_some((center, scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::three_squares;
    use crate::mesh::obj::read::mesh_from_obj;
    use partprobe_carrier::distance;

    const LIMITS: PartFieldLimits = PartFieldLimits {
        max_edge: 0.1,
        max_triangles: 10_000,
    };

    #[test]
    fn triangles_are_small_and_lie_in_their_parents() {
        let carrier = three_squares();
        let made = PartFieldMesh::new(carrier.mesh(), &LIMITS).unwrap();
        let read = mesh_from_obj(made.to_obj().as_bytes()).unwrap();
        assert_eq!(read.vertices, made.vertices);
        assert_eq!(read.triangles, made.triangles);
        assert_eq!(made.parent.len(), made.triangles.len());

        let mut area_of_parent = vec![0.0; carrier.mesh().triangles.len()];
        let max_edge = LIMITS.max_edge * carrier.mesh().diagonal();
        for (triangle, area) in read.triangle_areas().into_iter().enumerate() {
            let [a, b, c] = read.corners(triangle);
            assert!(distance(a, b).max(distance(b, c)).max(distance(c, a)) <= max_edge);
            area_of_parent[made.parent[triangle] as usize] += area;
        }
        for (found, expected) in area_of_parent.iter().zip(carrier.mesh().triangle_areas()) {
            assert!(
                (found - expected).abs() < 1e-12 * expected,
                "{found} {expected}"
            );
        }
    }

    #[test]
    fn the_pose_is_that_of_a_cube() {
        let made = PartFieldMesh::new(three_squares().mesh(), &LIMITS).unwrap();
        let normalized: Vec<Point> = made
            .vertices
            .iter()
            .map(|vertex| {
                std::array::from_fn(|axis| (vertex[axis] - made.center[axis]) * made.scale)
            })
            .collect();
        let [low, high] = bounding_box(&normalized).unwrap();
        let widest = (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max);
        assert!((widest - CUBE_WIDTH).abs() < 1e-12);
        assert!((0..3).all(|axis| (low[axis] + high[axis]).abs() < 1e-12));
    }

    #[test]
    fn unused_vertices_are_left_out() {
        let mut mesh = three_squares().mesh().clone();
        let n_vertices = PartFieldMesh::new(&mesh, &LIMITS).unwrap().vertices.len();
        let far = mesh.vertices.iter().map(|vertex| vertex.map(|x| x + 0.5));
        mesh.vertices = mesh.vertices.iter().copied().chain(far).collect();
        mesh.vertex_face.extend(mesh.vertex_face.clone());
        mesh.vertex_normal.clear();
        // The diagonal is longer, so the edges may also be longer.
        let limits = PartFieldLimits {
            max_edge: LIMITS.max_edge * three_squares().mesh().diagonal() / mesh.diagonal(),
            ..LIMITS
        };
        let made = PartFieldMesh::new(&mesh, &limits).unwrap();
        assert_eq!(made.vertices.len(), n_vertices);
    }

    #[track_caller]
    fn check_refused(mesh: &Mesh, limits: PartFieldLimits, expected: &str) {
        let reason = PartFieldMesh::new(mesh, &limits).unwrap_err().to_string();
        assert!(reason.contains(expected), "{reason}");
    }

    #[test]
    fn what_partfield_cannot_take_is_named() {
        let squares = three_squares().mesh().clone();
        check_refused(&Mesh::default(), LIMITS, "no triangles");
        let point = Mesh {
            vertices: vec![[1.0; 3]; squares.vertices.len()],
            ..squares.clone()
        };
        check_refused(&point, LIMITS, "no extent");
        let coarse = PartFieldLimits {
            max_edge: 1.0,
            ..LIMITS
        };
        check_refused(
            &squares,
            coarse,
            "it has 6 triangles, and PartField needs at least 21",
        );
        let few = PartFieldLimits {
            max_triangles: 30,
            ..LIMITS
        };
        check_refused(&squares, few, "more than 30 triangles");
    }
}
