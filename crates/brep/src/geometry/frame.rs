//! Makes orthonormal coordinate systems from the axes in a file, and converts points into and out of them.

use super::linear::{along, scaled, sum, unit};
use super::types::Frame;
use partprobe_shape::{Point, cross, dot, subtract};

impl Frame {
    /// The frame with the third axis `z`, and with the first axis at a right angle to `z` and as near to `x` as possible.
    ///
    /// If `z` is missing or zero, it is the third axis of space. If `x` is missing or parallel to `z`, another direction is
    /// chosen for it.
    #[must_use]
    pub fn new(origin: Point, z: Option<Point>, x: Option<Point>) -> Self {
        let z = z.and_then(unit).unwrap_or([0.0, 0.0, 1.0]);
        let across = |x: Point| {
            let x = unit(x)?;
            let x = along(x, z, -dot(x, z));
            // Nearly parallel axes leave only rounding errors.
            if dot(x, x) > 1e-18 { unit(x) } else { None }
        };
        let spare = if z[0].abs() < 0.9 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let x = x
            .and_then(across)
            .or_else(|| across([1.0, 0.0, 0.0]))
            .or_else(|| across(spare))
            .unwrap_or(spare);
        Self {
            origin,
            x,
            y: cross(z, x),
            z,
        }
    }

    /// Coordinates of a point of space in this frame.
    #[must_use]
    pub fn local(&self, point: Point) -> Point {
        let arm = subtract(point, self.origin);
        [dot(arm, self.x), dot(arm, self.y), dot(arm, self.z)]
    }

    /// The point of space with these coordinates.
    #[must_use]
    pub fn point(&self, a: f64, b: f64, c: f64) -> Point {
        sum(self.origin, self.vector(a, b, c))
    }

    /// The vector of space with these components.
    #[must_use]
    pub fn vector(&self, a: f64, b: f64, c: f64) -> Point {
        along(along(scaled(self.x, a), self.y, b), self.z, c)
    }
}
