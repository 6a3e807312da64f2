//! Divides triangles until no edge is too long. The result is the refined carrier, on which τ_min counts triangles.
//!
//! A mesh goes in, and the same surface in smaller triangles comes out (longest-edge bisection, Rivara 1984).

use partprobe_shape::{Mesh, Point, distance};
use std::collections::HashMap;

/// The longest edge of a refined carrier, as a fraction of the bounding-box diagonal.
pub const REFINE_FRACTION: f64 = 1.0 / 32.0;

/// A refined mesh, and the original triangle of each of its triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct RefinedMesh {
    /// The finer mesh. Its first vertices are those of the plain mesh.
    pub mesh: Mesh,
    /// The triangle of the plain mesh in which each triangle lies.
    pub parent: Vec<u32>,
}

/// Halves every triangle at the midpoint of its longest edge until no edge is longer than `max_edge` millimeters.
///
/// An edge is cut if and only if it is too long, and always at its midpoint, so neighbors stay conforming and equal coordinates
/// stay equal. Vertex normals are dropped, because they are not known at midpoints.
#[must_use]
pub fn refine(mesh: &Mesh, max_edge: f64) -> RefinedMesh {
    let mut fine = Mesh {
        vertex_normal: Vec::new(),
        triangles: Vec::new(),
        tri_face: Vec::new(),
        ..mesh.clone()
    };
    let mut parent = Vec::new();
    let mut midpoints: HashMap<(u32, u32), u32> = HashMap::new();
    for (triangle, (&corners, &face)) in (0u32..).zip(mesh.triangles.iter().zip(&mesh.tri_face)) {
        let mut open = vec![corners];
        while let Some(corners) = open.pop() {
            let points = corners.map(|vertex| fine.vertices[vertex as usize]);
            let Some(side) = longest_side_above(points, max_edge) else {
                fine.triangles.push(corners);
                fine.tri_face.push(face);
                parent.push(triangle);
                continue;
            };
            let [a, b, c] = rotated(corners, side);
            let middle = *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
                fine.vertices.push(midpoint(
                    fine.vertices[a as usize],
                    fine.vertices[b as usize],
                ));
                fine.vertex_face.push(face);
                (fine.vertices.len() - 1) as u32
            });
            open.extend([[middle, b, c], [a, middle, c]]);
        }
    }
    RefinedMesh { mesh: fine, parent }
}

/// The number of triangles of each part on the refined carrier, computed without making it. Counting stops at `enough`.
///
/// `face_part` is the part of each face. Triangles of other faces are not counted. Cost: at most `enough` triangles per part, and
/// one test per plain triangle.
#[must_use]
pub fn refined_triangle_counts(
    mesh: &Mesh,
    face_part: &[u32],
    max_edge: f64,
    enough: u32,
) -> Vec<u32> {
    let n_parts = face_part.iter().max().map_or(0, |&last| last as usize + 1);
    let mut counts = vec![0u32; n_parts];
    let mut open = Vec::new();
    for (triangle, &face) in mesh.tri_face.iter().enumerate() {
        let Some(&part) = face_part.get(face as usize) else {
            continue;
        };
        let count = &mut counts[part as usize];
        open.push(mesh.corners(triangle));
        while let Some(corners) = open.pop().filter(|_| *count < enough) {
            match longest_side_above(corners, max_edge) {
                None => *count += 1,
                Some(side) => {
                    let [a, b, c] = rotated(corners, side);
                    let middle = midpoint(a, b);
                    open.extend([[middle, b, c], [a, middle, c]]);
                }
            }
        }
        open.clear();
    }
    counts
}

/// The longest side (0: first to second corner, and so on) if it is longer than `max_edge`.
fn longest_side_above([a, b, c]: [Point; 3], max_edge: f64) -> Option<usize> {
    let sides = [distance(a, b), distance(b, c), distance(c, a)];
    let longest = (0..3).fold(0, |best, side| {
        if sides[best] < sides[side] {
            side
        } else {
            best
        }
    });
    // Without these conditions, a midpoint that rounds to an end point would be divided forever.
    (max_edge < sides[longest] && 0.0 < max_edge && sides[longest].is_finite()).then_some(longest)
}

fn rotated<T: Copy>(corners: [T; 3], first: usize) -> [T; 3] {
    [
        corners[first],
        corners[(first + 1) % 3],
        corners[(first + 2) % 3],
    ]
}

fn midpoint(a: Point, b: Point) -> Point {
    [0, 1, 2].map(|axis| 0.5 * (a[axis] + b[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::weld;
    use proptest::prelude::*;

    fn square(side: f64) -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [side, 0.0, 0.0],
                [side, side, 0.0],
                [0.0, side, 0.0],
            ],
            vertex_face: vec![0; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            tri_face: vec![0, 0],
            vertex_normal: Vec::new(),
        }
    }

    proptest! {
        #[test]
        fn refinement_keeps_area_bounds_edges_and_stays_conforming(side in 0.5f64..9.0, limit in 0.2f64..4.0) {
            let plain = square(side);
            let fine = refine(&plain, limit);
            let total: f64 = fine.mesh.triangle_areas().iter().sum();
            prop_assert!((total - side * side).abs() < 1e-9 * side * side);
            for triangle in 0..fine.mesh.triangles.len() {
                let [a, b, c] = fine.mesh.corners(triangle);
                prop_assert!(distance(a, b).max(distance(b, c)).max(distance(c, a)) <= limit);
            }
            let n_fine = fine.mesh.triangles.len() as u32;
            prop_assert_eq!(refined_triangle_counts(&plain, &[0], limit, u32::MAX), vec![n_fine]);
            prop_assert_eq!(refined_triangle_counts(&plain, &[1], limit, 5), vec![0, n_fine.min(5)]);
            // A hanging vertex would open the boundary. For a disc, V - E + F = 1.
            let welded = weld(&fine.mesh);
            let mut sides: Vec<[u32; 2]> = welded.triangles.iter()
                .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|[a, b]| [a.min(b), a.max(b)]).collect();
            sides.sort_unstable();
            sides.dedup();
            prop_assert_eq!(welded.vertices.len() + welded.triangles.len(), sides.len() + 1);
        }
    }
}
