//! Computes the normal and the area of triangles and of the points of a cloud. Both are also defined for triangles without an
//! area.

use partprobe_carrier::{Mesh, Point, cross, norm, subtract};

/// The area of each triangle. Each point of a cloud counts as one unit of area.
pub(crate) fn areas_of(mesh: &Mesh) -> Vec<f64> {
    if mesh.is_cloud() {
        vec![1.0; mesh.triangles.len()]
    } else {
        mesh.triangle_areas()
    }
}

/// The unit normal and the area of each triangle. The normal is 0 if a triangle has no area. A point of a cloud counts as one
/// unit of area.
pub(crate) fn normals_and_areas(mesh: &Mesh) -> Vec<(Point, f64)> {
    let n_triangles = mesh.triangles.len();
    if mesh.is_cloud() {
        let of_point =
            |&[vertex, ..]: &[u32; 3]| mesh.vertex_normal[vertex as usize].map(f64::from);
        return mesh
            .triangles
            .iter()
            .map(|corners| (of_point(corners), 1.0))
            .collect();
    }
    (0..n_triangles)
        .map(|triangle| normal_and_area(mesh, triangle))
        .collect()
}

/// The unit normal (0 for a triangle without an area) and the area.
pub(crate) fn normal_and_area(mesh: &Mesh, triangle: usize) -> (Point, f64) {
    let [a, b, c] = mesh.corners(triangle);
    let facet = cross(subtract(b, a), subtract(c, a));
    let length = norm(facet);
    let is_defined = length > 0.0 && length.is_finite();
    if is_defined {
        (facet.map(|x| x / length), 0.5 * length)
    } else {
        ([0.0; 3], 0.0)
    }
}

/// The diagonal of the bounding box, or 1 if it is zero or not finite.
pub(crate) fn size_or_one(mesh: &Mesh) -> f64 {
    let diagonal = mesh.diagonal();
    if diagonal > 0.0 && diagonal.is_finite() {
        diagonal
    } else {
        1.0
    }
}
