//! Computes with points and vectors in space.

/// A point in space, in millimeters, or a vector.
pub type Point = [f64; 3];

/// The vector from `b` to `a`.
#[must_use]
pub fn subtract(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The scalar product.
#[must_use]
pub fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[must_use]
pub fn cross(a: Point, b: Point) -> Point {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// The length of a vector.
#[must_use]
pub fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

/// The distance of two points. The order of the points does not change the result, bit by bit.
#[must_use]
pub fn distance(a: Point, b: Point) -> f64 {
    norm(subtract(a, b))
}

/// The area of a triangle.
#[must_use]
pub fn triangle_area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * norm(cross(subtract(b, a), subtract(c, a)))
}

/// The mean of the corners of a triangle.
#[must_use]
pub fn centroid([a, b, c]: [Point; 3]) -> Point {
    [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0)
}

/// The unit normal of a triangle whose corners are counterclockwise, seen from outside. It is 0 if the triangle has no area
/// or its area is not finite.
#[must_use]
pub fn unit_normal([a, b, c]: [Point; 3]) -> Point {
    let normal = cross(subtract(b, a), subtract(c, a));
    let length = norm(normal);
    if length > 0.0 && length.is_finite() {
        normal.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}

/// The matrix of the rotation by a unit quaternion, whose real part is last.
#[must_use]
pub fn rotation_of_quaternion([x, y, z, w]: [f64; 4]) -> [Point; 3] {
    [
        [
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
        ],
        [
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
        ],
        [
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        ],
    ]
}

/// The diagonal of the axis-parallel bounding box. It is 0 for fewer than two points.
#[must_use]
pub fn bounding_diagonal(points: &[Point]) -> f64 {
    bounding_box(points).map_or(0.0, |[low, high]| distance(low, high))
}

/// The lower and the upper corner of the axis-aligned box around points. Returns `None` if there are no points.
#[must_use]
pub fn bounding_box(points: &[Point]) -> Option<[Point; 2]> {
    let &first = points.first()?;
    let (mut low, mut high) = (first, first);
    for point in points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    Some([low, high])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_a_centroid_and_a_normal_unless_it_has_no_area() {
        let flat = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 6.0, 0.0]];
        assert_eq!(centroid(flat), [1.0, 2.0, 0.0]);
        assert_eq!(unit_normal(flat), [0.0, 0.0, 1.0]);
        assert_eq!(unit_normal([[1.0; 3]; 3]), [0.0; 3]);
        assert_eq!(
            unit_normal([[0.0; 3], [1e200, 0.0, 0.0], [0.0, 1e200, 0.0]]),
            [0.0; 3]
        );
    }

    #[test]
    fn a_quaternion_about_z_turns_x_to_y() {
        let half = 0.5f64.sqrt();
        let [x, y, z] = rotation_of_quaternion([0.0, 0.0, half, half]).map(|row| row[0]);
        assert!(x.abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && z == 0.0);
    }
}
