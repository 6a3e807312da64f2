//! Vertex normals for shading.

use partprobe_carrier::{Mesh, cross, norm, subtract};

/// A unit normal for each vertex: the true surface's where the carrier keeps it, else the mean of the vertex's
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
    use crate::fixtures::three_squares;

    #[test]
    fn the_true_normal_wins_and_nothing_is_no_number() {
        let mut mesh = three_squares().mesh().clone();
        assert_eq!(smooth_normals(&mesh), vec![[0.0, 0.0, 1.0]; 12]);
        mesh.triangles
            .iter_mut()
            .for_each(|corners| corners.reverse());
        assert_eq!(smooth_normals(&mesh), vec![[0.0, 0.0, -1.0]; 12]);
        mesh.vertex_normal = vec![[0.0, 2.0, 0.0]; 12];
        assert_eq!(smooth_normals(&mesh), vec![[0.0, 1.0, 0.0]; 12]);
        mesh.vertex_normal = vec![[f32::NAN; 3]; 12];
        assert_eq!(smooth_normals(&mesh), vec![[0.0, 0.0, 1.0]; 12]);
    }
}
