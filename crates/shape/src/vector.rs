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

/// The distance of two points. The order of the points does not change a bit of it.
#[must_use]
pub fn distance(a: Point, b: Point) -> f64 {
    norm(subtract(a, b))
}

/// The area of a triangle.
#[must_use]
pub fn triangle_area([a, b, c]: [Point; 3]) -> f64 {
    0.5 * norm(cross(subtract(b, a), subtract(c, a)))
}

/// The diagonal of the axis-parallel bounding box; 0 for fewer than two points.
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
