//! Views the triangles of a mesh as one surface: the normal, the area and the neighbors of each triangle.
//!
//! Vertices with equal coordinates count as one, so that neighbors are found across faces. The neighbors of a point of a
//! cloud are the points nearest to it. Nothing here labels.

use crate::region_merging::{Border, borders_of};
use crate::triangle_normal::normals_and_areas;
use partprobe_carrier::{Mesh, Partition, Point};

/// The data of a mesh that segmentations need. All numbers are finite.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    /// The unit normal of each triangle, 0 for a triangle without area.
    pub(crate) normals: Vec<Point>,
    /// The area of each triangle, in square millimeters.
    pub(crate) areas: Vec<f64>,
    /// The common sides of the triangles.
    pub(crate) borders: Vec<Border>,
    /// The index in `neighbors` of the first neighbor of each triangle, and the length of `neighbors` at the end.
    first: Vec<usize>,
    neighbors: Vec<u32>,
}

impl Surface {
    /// Measures the triangles and finds their neighbors.
    pub(crate) fn of(mesh: &Mesh) -> Self {
        let n_triangles = mesh.triangles.len();
        let borders = borders_of(mesh);
        let (first, neighbors) = neighbors_of(n_triangles, &borders);
        let (normals, areas) = normals_and_areas(mesh).into_iter().unzip();
        Self {
            normals,
            areas,
            borders,
            first,
            neighbors,
        }
    }

    /// How many triangles there are.
    pub(crate) fn n_triangles(&self) -> usize {
        self.areas.len()
    }

    /// The triangles that share a side with this one. A triangle that shares two sides is listed twice.
    pub(crate) fn neighbors(&self, triangle: u32) -> &[u32] {
        let triangle = triangle as usize;
        &self.neighbors[self.first[triangle]..self.first[triangle + 1]]
    }

    /// The connected components of the triangles.
    pub(crate) fn components(&self) -> Partition {
        let pairs = self.borders.iter().map(|border| border.between);
        Partition::from_joined_pairs(self.n_triangles(), pairs)
    }
}

/// The start of each triangle's neighbors, and the neighbors of all triangles in one list.
fn neighbors_of(n_triangles: usize, borders: &[Border]) -> (Vec<usize>, Vec<u32>) {
    let mut first = vec![0; n_triangles + 1];
    for triangle in borders.iter().flat_map(|border| border.between) {
        first[triangle as usize + 1] += 1;
    }
    for triangle in 0..n_triangles {
        first[triangle + 1] += first[triangle];
    }

    let mut next = first.clone();
    let mut neighbors = vec![0; 2 * borders.len()];
    for &Border {
        between: [a, b], ..
    } in borders
    {
        for (triangle, other) in [(a, b), (b, a)] {
            neighbors[next[triangle as usize]] = other;
            next[triangle as usize] += 1;
        }
    }
    (first, neighbors)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use partprobe_carrier::{cross, weld};

    /// A mesh in which each triangle has its own corners.
    pub(crate) fn mesh_of(triangles: &[[Point; 3]]) -> Mesh {
        let n_triangles = triangles.len();
        Mesh {
            vertices: triangles.iter().flatten().copied().collect(),
            vertex_face: vec![0; 3 * n_triangles],
            triangles: (0..)
                .take(n_triangles)
                .map(|idx: u32| [3 * idx, 3 * idx + 1, 3 * idx + 2])
                .collect(),
            tri_face: vec![0; n_triangles],
            vertex_normal: Vec::new(),
        }
    }

    /// A rectangle from a corner along two directions, as two triangles.
    pub(crate) fn rectangle(corner: Point, u: Point, v: Point) -> [[Point; 3]; 2] {
        let at = |s: f64, t: f64| [0, 1, 2].map(|axis| corner[axis] + s * u[axis] + t * v[axis]);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        [[a, b, c], [a, c, d]]
    }

    /// A cuboid with its lowest corner at `corner`, with two outward triangles per side.
    pub(crate) fn cuboid(corner: Point, size: Point) -> Vec<[Point; 3]> {
        let mut triangles = Vec::new();
        for axis in 0..3 {
            let edge = |axis: usize| {
                let mut along = [0.0; 3];
                along[axis % 3] = size[axis % 3];
                along
            };
            let (u, v) = (edge(axis + 1), edge(axis + 2));
            let mut far = corner;
            far[axis] += size[axis];
            triangles.extend(rectangle(corner, v, u));
            triangles.extend(rectangle(far, u, v));
        }
        triangles
    }

    /// A tube around the z axis: outer wall, inner wall and two rings, `n` facets around.
    pub(crate) fn tube(inner: f64, outer: f64, height: f64, n: u32) -> Vec<[Point; 3]> {
        let at = |radius: f64, idx: u32, z: f64| {
            let angle = std::f64::consts::TAU * f64::from(idx % n) / f64::from(n);
            [radius * angle.cos(), radius * angle.sin(), z]
        };
        let quad = |[a, b, c, d]: [Point; 4]| [[a, b, c], [a, c, d]];
        let mut triangles = Vec::new();
        for idx in 0..n {
            let next = idx + 1;
            let wall = |radius: f64| {
                [
                    at(radius, idx, 0.0),
                    at(radius, next, 0.0),
                    at(radius, next, height),
                    at(radius, idx, height),
                ]
            };
            let ring = |z: f64| {
                [
                    at(inner, idx, z),
                    at(outer, idx, z),
                    at(outer, next, z),
                    at(inner, next, z),
                ]
            };
            let reversed = |[a, b, c, d]: [Point; 4]| [d, c, b, a];
            for corners in [
                wall(outer),
                reversed(wall(inner)),
                ring(height),
                reversed(ring(0.0)),
            ] {
                triangles.extend(quad(corners));
            }
        }
        triangles
    }

    #[test]
    fn the_bodies_of_these_tests_are_closed_and_outward() {
        let volume = |triangles: &[[Point; 3]]| {
            let sixth = |[a, b, c]: &[Point; 3]| partprobe_carrier::dot(*a, cross(*b, *c)) / 6.0;
            triangles.iter().map(sixth).sum::<f64>()
        };
        assert!((volume(&cuboid([1.0; 3], [1.0, 2.0, 3.0])) - 6.0).abs() < 1e-12);
        assert!(volume(&tube(1.0, 2.0, 3.0, 12)) > 24.0);
        for triangles in [cuboid([0.0; 3], [1.0; 3]), tube(1.0, 2.0, 3.0, 12)] {
            let mesh = mesh_of(&triangles);
            let solid = partprobe_carrier::solid_mesh(&mesh, &weld(&mesh), |_| true);
            assert!(solid.watertight);
        }
    }

    #[test]
    fn neighbors_share_a_side() {
        let surface = Surface::of(&mesh_of(&cuboid([0.0; 3], [1.0; 3])));
        assert!((0..12).all(|triangle| surface.neighbors(triangle).len() == 3));
        assert!((0..12).all(|triangle| {
            let mut others = surface.neighbors(triangle).iter();
            others.all(|&other| surface.neighbors(other).contains(&triangle))
        }));
        assert_eq!(surface.components().n_parts(), 1);
        assert_eq!(Surface::of(&Mesh::default()).n_triangles(), 0);
    }

    #[test]
    fn many_triangles_at_one_side_are_a_chain() {
        let fan: Vec<[Point; 3]> = (1..=1000)
            .map(|n| [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, f64::from(n)]])
            .collect();
        let surface = Surface::of(&mesh_of(&fan));
        assert_eq!(surface.borders.len(), 999);
        assert_eq!(surface.components().n_parts(), 1);
    }
}
