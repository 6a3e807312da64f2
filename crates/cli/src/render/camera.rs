//! An orthographic view from the upper front right, fitted to the picture.

use carrier::{Point, cross, dot, norm, subtract};

/// Maps points of space to pixels and depth.
pub(super) struct Camera {
    right: Point,
    up: Point,
    toward: Point,
    center: [f64; 2],
    pixels_per_mm: f64,
    size: f64,
}

impl Camera {
    /// A camera that shows all of `points` in a square of `size` pixels with a small margin.
    pub(super) fn fitted(points: &[Point], size: usize) -> Self {
        let toward = unit([0.55, -0.75, 0.55]);
        let right = unit(cross([0.0, 0.0, 1.0], toward));
        let up = cross(toward, right);
        let (mut low, mut high) = ([f64::MAX; 2], [f64::MIN; 2]);
        for &point in points {
            for (axis, value) in [dot(point, right), dot(point, up)].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let extent = (high[0] - low[0]).max(high[1] - low[1]).max(1e-12);
        let center = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
        Self { right, up, toward, center, pixels_per_mm: 0.92 * size as f64 / extent, size: size as f64 }
    }

    /// Pixel column, pixel row and nearness (larger is nearer) of a point.
    pub(super) fn project(&self, point: Point) -> [f64; 3] {
        let x = (dot(point, self.right) - self.center[0]) * self.pixels_per_mm + 0.5 * self.size;
        let y = 0.5 * self.size - (dot(point, self.up) - self.center[1]) * self.pixels_per_mm;
        [x, y, dot(point, self.toward)]
    }

    /// Brightness of a facet, from 0.55 to 1: a head light with a second one from above.
    pub(super) fn brightness(&self, [a, b, c]: [Point; 3]) -> f64 {
        let normal = unit(cross(subtract(b, a), subtract(c, a)));
        let above = unit([0.1, -0.2, 1.0]);
        0.55 + 0.25 * dot(normal, self.toward).abs() + 0.2 * dot(normal, above).max(0.0)
    }
}

fn unit(vector: Point) -> Point {
    let length = norm(vector).max(f64::MIN_POSITIVE);
    vector.map(|x| x / length)
}
