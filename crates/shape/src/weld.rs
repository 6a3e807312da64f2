//! Joins the meshes of faces along bit-equal coordinates, and measures the solid that they enclose.

use crate::mesh::Mesh;
use crate::vector::{Point, cross, dot, subtract};
use std::collections::HashMap;

/// A mesh whose faces share their vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct WeldedMesh {
    /// The distinct positions, in the order of their first use.
    pub vertices: Vec<Point>,
    /// The triangles of the plain mesh, in its order.
    pub triangles: Vec<[u32; 3]>,
}

/// Whether the mesh of a solid is closed, and the volume that it encloses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidMesh {
    /// Signed volume in cubic millimeters. It is positive if the triangles face outward.
    pub volume: f64,
    /// The center of mass for a uniform density, or `None` if the mesh is not watertight, because it then encloses nothing.
    pub centroid: Option<Point>,
    /// Whether the mesh has no border: its triangles walk each edge equally often in both directions.
    pub watertight: bool,
    /// Whether the mesh is watertight and exactly two triangles meet at each edge. Then the solid does not touch itself along an
    /// edge.
    pub manifold: bool,
}

/// Gives the same index to vertices with equal coordinates.
#[must_use]
pub fn weld(mesh: &Mesh) -> WeldedMesh {
    let mut index_of = HashMap::new();
    let mut vertices = Vec::new();
    let new_index: Vec<u32> = mesh
        .vertices
        .iter()
        .map(|&vertex| {
            // Adding 0 changes -0 to 0, because both are the same position.
            *index_of
                .entry(vertex.map(|x| (x + 0.0).to_bits()))
                .or_insert_with(|| {
                    vertices.push(vertex);
                    (vertices.len() - 1) as u32
                })
        })
        .collect();
    let triangles = mesh
        .triangles
        .iter()
        .map(|corners| corners.map(|vertex| new_index[vertex as usize]))
        .collect();
    WeldedMesh {
        vertices,
        triangles,
    }
}

/// Measures the triangles whose face satisfies `belongs`.
#[must_use]
pub fn solid_mesh(mesh: &Mesh, welded: &WeldedMesh, belongs: impl Fn(u32) -> bool) -> SolidMesh {
    let triangles = welded.triangles.iter().zip(&mesh.tri_face);
    let triangles: Vec<[u32; 3]> = triangles
        .filter(|&(_, &face)| belongs(face))
        .map(|(&corners, _)| corners)
        .collect();

    let sides = walked_sides(&triangles);
    let watertight = !sides.is_empty() && sides.iter().all(|&[there, back]| there == back);
    let manifold = watertight && sides.iter().all(|&[there, _]| there == 1);

    let origin = welded.vertices.first().copied().unwrap_or_default();
    let (volume, moment) = volume_and_moment(&welded.vertices, &triangles, origin);
    let centroid = (watertight && volume != 0.0)
        .then(|| std::array::from_fn(|axis| origin[axis] + moment[axis] / volume));
    SolidMesh {
        volume,
        centroid,
        watertight,
        manifold,
    }
}

/// The signed volume inside the triangles, and its first moment with respect to `origin`.
///
/// By the divergence theorem, the integral over the volume is a sum over the triangles: each triangle spans a
/// tetrahedron with the origin, whose centroid is a quarter of the sum of its corners (Mirtich, "Fast and accurate
/// computation of polyhedral mass properties", 1996).
fn volume_and_moment(vertices: &[Point], triangles: &[[u32; 3]], origin: Point) -> (f64, Point) {
    let mut volume = 0.0;
    let mut moment = [0.0; 3];
    for corners in triangles {
        let [p, q, r] = corners.map(|vertex| subtract(vertices[vertex as usize], origin));
        let tetrahedron = dot(p, cross(q, r)) / 6.0;
        volume += tetrahedron;
        for axis in 0..3 {
            moment[axis] += tetrahedron * (p[axis] + q[axis] + r[axis]) / 4.0;
        }
    }
    (volume, moment)
}

/// How often the triangles walk each of their sides from the lower vertex to the higher one, and in the opposite direction.
fn walked_sides(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut walks: HashMap<(u32, u32), [u32; 2]> = HashMap::new();
    for &[a, b, c] in triangles {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let side = (from.min(to), from.max(to));
            walks.entry(side).or_default()[usize::from(to < from)] += 1;
        }
    }
    // The order of the hash map is arbitrary. The caller only tests properties of all sides.
    walks.into_values().collect()
}

/// The sides that only one triangle has, sorted, each with its smaller vertex first. On a mesh that is not welded, these are the
/// borders of the faces: a vertex belongs to one face, so no two faces share a side.
#[must_use]
pub fn border_sides(triangles: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let sides = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    sides
        .chunk_by(|a, b| a == b)
        .filter(|run| run.len() == 1)
        .map(|run| run[0])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron of volume 1/6. Each face has its own vertices.
    fn tetrahedron() -> Mesh {
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
        ];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        Mesh {
            vertices: faces
                .iter()
                .flatten()
                .map(|&corner: &usize| corners[corner])
                .collect(),
            vertex_face: (0..4).flat_map(|face| [face; 3]).collect(),
            triangles: (0..4)
                .map(|face| [3 * face, 3 * face + 1, 3 * face + 2])
                .collect(),
            tri_face: (0..4).collect(),
            vertex_normal: Vec::new(),
        }
    }

    #[test]
    fn a_closed_solid_is_watertight_and_a_missing_face_opens_it() {
        let mesh = tetrahedron();
        let welded = weld(&mesh);
        assert_eq!(welded.vertices.len(), 4);
        let whole = solid_mesh(&mesh, &welded, |_| true);
        assert!(whole.watertight && whole.manifold && (whole.volume - 1.0 / 6.0).abs() < 1e-15);
        assert!(
            whole
                .centroid
                .unwrap()
                .iter()
                .all(|x| (x - 0.25).abs() < 1e-15)
        );
        let open = solid_mesh(&mesh, &welded, |face| face != 2);
        assert!(!open.watertight && open.centroid.is_none());
        assert!(!solid_mesh(&mesh, &welded, |_| false).watertight);
        let mut twice = mesh.clone();
        twice.triangles.extend(mesh.triangles.iter());
        twice.tri_face.extend(&mesh.tri_face);
        let touching = solid_mesh(&twice, &weld(&twice), |_| true);
        assert!(touching.watertight && !touching.manifold);
    }

    #[test]
    fn the_border_of_two_triangles_leaves_out_their_common_side() {
        assert_eq!(
            border_sides(&[[0, 1, 2], [2, 1, 3]]),
            [[0, 1], [0, 2], [1, 3], [2, 3]]
        );
    }
}
