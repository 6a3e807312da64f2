//! Fits an orthographic camera to a shape.

use partprobe_carrier::{Point, cross, dot, norm, subtract};

/// The possible positions of a camera: the corners of a slightly flattened cube. The usual one (upper front right) comes first.
pub(crate) const CORNERS: [Point; 8] = [
    [0.55, -0.75, 0.55],
    [-0.55, -0.75, 0.55],
    [0.55, 0.75, 0.55],
    [-0.55, 0.75, 0.55],
    [0.55, -0.75, -0.55],
    [-0.55, -0.75, -0.55],
    [0.55, 0.75, -0.55],
    [-0.55, 0.75, -0.55],
];

/// The direction from which a shape is seen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    /// The direction from the shape to the camera.
    pub(crate) toward: Point,
    /// The direction that points up in the picture. It is not parallel to `toward`.
    pub(crate) up: Point,
}

impl Look {
    /// A view with z up.
    pub(crate) fn upright(toward: Point) -> Self {
        Self {
            toward,
            up: [0.0, 0.0, 1.0],
        }
    }
}

/// The part of a picture's side that the shape fills.
const FILLED: f64 = 0.92;

/// Maps points of space to samples and depth.
pub(crate) struct Camera {
    right: Point,
    up: Point,
    toward: Point,
    center: Point,
    samples_per_mm: f64,
    side: f64,
}

impl Camera {
    /// A camera that shows all of `points` in a square of `side` samples, with a margin.
    pub(crate) fn fitted(points: &[Point], look: Look, side: usize) -> Self {
        let toward = unit(look.toward);
        let right = unit(cross(look.up, toward));
        let up = cross(toward, right);
        let axes = [right, up, toward];
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for &point in points {
            for axis in 0..3 {
                let value = dot(point, axes[axis]);
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        let extent = (high[0] - low[0])
            .max(high[1] - low[1])
            .max(f64::MIN_POSITIVE);
        let center = [0, 1, 2].map(|axis| 0.5 * (low[axis] + high[axis]));
        Self {
            right,
            up,
            toward,
            center,
            samples_per_mm: FILLED * side as f64 / extent,
            side: side as f64,
        }
    }

    /// Column, row and nearness of a point, all in samples. A point with a larger nearness is nearer.
    pub(crate) fn project(&self, point: Point) -> Point {
        let scaled = |axis: Point, center: f64| (dot(point, axis) - center) * self.samples_per_mm;
        [
            0.5 * self.side + scaled(self.right, self.center[0]),
            0.5 * self.side - scaled(self.up, self.center[1]),
            scaled(self.toward, self.center[2]),
        ]
    }

    /// Brightness of a surface with this unit normal, from 0.6 to 1. There is one light at the camera and one above it.
    ///
    /// Surfaces are lit from both sides, because open shells have no inside.
    pub(crate) fn brightness(&self, normal: Point) -> f64 {
        let facing = dot(normal, self.toward);
        let outward = if facing < 0.0 {
            normal.map(|x| -x)
        } else {
            normal
        };
        0.6 + 0.26 * facing.abs() + 0.14 * dot(outward, self.up).max(0.0)
    }
}

/// The normal of a triangle, or any unit vector if it has none.
pub(crate) fn facet_normal([a, b, c]: [Point; 3]) -> Point {
    unit(cross(subtract(b, a), subtract(c, a)))
}

pub(crate) fn unit(vector: Point) -> Point {
    let length = norm(vector);
    if length > 0.0 && length.is_finite() {
        vector.map(|x| x / length)
    } else {
        [0.0, 0.0, 1.0]
    }
}
