//! Computes the normal and the area of a triangle, defined for triangles without area too.

use partprobe_carrier::{Mesh, Point, cross, norm, subtract};

/// The unit normal, 0 for a triangle without area, and the area.
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

/// The diagonal of the bounding box, or 1 where there is none to scale by.
pub(crate) fn size_or_one(mesh: &Mesh) -> f64 {
    let diagonal = mesh.diagonal();
    if diagonal > 0.0 && diagonal.is_finite() {
        diagonal
    } else {
        1.0
    }
}
