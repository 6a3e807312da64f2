//! Computes a normal at each vertex of a mesh, for shading.

use crate::mesh::Mesh;
use crate::vector::{cross, norm, subtract};

/// A unit normal for each vertex: that of the true surface if the mesh stores it, or else the mean of the vertex's
/// triangles, weighted by their area.
///
/// A vertex belongs to one face, so the mean is smooth inside a face and breaks where faces meet. A vertex without a
/// triangle that has an area gets `[0, 0, 1]`.
#[must_use]
pub fn smooth_normals(mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; mesh.vertices.len()];
    if mesh.vertex_normal.is_empty() {
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(triangle);
            let normal = cross(subtract(b, a), subtract(c, a));
            for &vertex in corners {
                let sum: &mut [f64; 3] = &mut sums[vertex as usize];
                *sum = [0, 1, 2].map(|axis| sum[axis] + normal[axis]);
            }
        }
    } else {
        sums = mesh
            .vertex_normal
            .iter()
            .map(|normal| normal.map(f64::from))
            .collect();
    }
    sums.into_iter().map(unit).collect()
}

fn unit(sum: [f64; 3]) -> [f32; 3] {
    let length = norm(sum);
    if length > 0.0 && length.is_finite() {
        sum.map(|x| (x / length) as f32)
    } else {
        [0.0, 0.0, 1.0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles in the plane z = 0 that share a side, and a vertex without a triangle.
    fn square() -> Mesh {
        Mesh {
            vertices: vec![
                [0.0, 0.0, 0.0],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
                [5.0, 5.0, 5.0],
            ],
            vertex_face: vec![0; 5],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            tri_face: vec![0; 2],
            vertex_normal: Vec::new(),
        }
    }

    #[track_caller]
    fn check(change: impl FnOnce(&mut Mesh), on_triangles: [f32; 3], alone: [f32; 3]) {
        let mut mesh = square();
        change(&mut mesh);
        let [a, b, c, d, e] = smooth_normals(&mesh)[..] else {
            panic!("one normal per vertex")
        };
        assert_eq!([a, b, c, d], [on_triangles; 4]);
        assert_eq!(e, alone);
    }

    #[test]
    fn the_true_normal_wins_and_every_normal_is_a_number() {
        let up = [0.0, 0.0, 1.0];
        check(|_| {}, up, up);
        let reverse = |mesh: &mut Mesh| mesh.triangles.iter_mut().for_each(|t| t.reverse());
        check(reverse, [0.0, 0.0, -1.0], up);
        let along_y = |mesh: &mut Mesh| mesh.vertex_normal = vec![[0.0, 2.0, 0.0]; 5];
        check(along_y, [0.0, 1.0, 0.0], [0.0, 1.0, 0.0]);
        let not_numbers = |mesh: &mut Mesh| mesh.vertex_normal = vec![[f32::NAN; 3]; 5];
        check(not_numbers, up, up);
    }
}
