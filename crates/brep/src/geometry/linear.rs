//! Adds vector arithmetic to that of `partprobe-shape`: sums, multiples, unit vectors.

use partprobe_shape::{Point, norm};

/// `a + b`.
pub(crate) fn sum(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a · factor`.
pub(crate) fn scaled(a: Point, factor: f64) -> Point {
    [a[0] * factor, a[1] * factor, a[2] * factor]
}

/// `from + t·direction`.
pub(crate) fn along(from: Point, direction: Point, t: f64) -> Point {
    [
        from[0] + t * direction[0],
        from[1] + t * direction[1],
        from[2] + t * direction[2],
    ]
}

/// The vector scaled to length 1. Returns `None` if it has no direction.
pub(crate) fn unit(a: Point) -> Option<Point> {
    let length = norm(a);
    // The direction of a vector with a subnormal length loses digits.
    (length > 1e-290 && length.is_finite()).then(|| scaled(a, 1.0 / length))
}

/// Whether no coordinate is infinite or NaN.
pub(crate) fn is_finite(a: Point) -> bool {
    a.iter().all(|x| x.is_finite())
}
