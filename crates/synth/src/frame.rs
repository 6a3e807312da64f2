//! Defines right-handed coordinate systems, which convert a point of a plane and a height to a point in space.

use partprobe_carrier::{Point, cross, dot, norm, subtract};

/// A point or vector of a plane.
pub(crate) type Planar = [f64; 2];

/// Three orthonormal axes at an origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Frame {
    pub(crate) origin: Point,
    pub(crate) x: Point,
    pub(crate) y: Point,
    pub(crate) z: Point,
}

impl Frame {
    /// The world coordinate system.
    pub(crate) const WORLD: Self = Self {
        origin: [0.0; 3],
        x: [1.0, 0.0, 0.0],
        y: [0.0, 1.0, 0.0],
        z: [0.0, 0.0, 1.0],
    };

    /// The frame with this origin and z axis. Its x axis is the part of `x` that is perpendicular to z.
    pub(crate) fn new(origin: Point, z: Point, x: Point) -> Self {
        let z = unit(z);
        let x = unit(subtract(x, scaled(z, dot(x, z))));
        Self {
            origin,
            x,
            y: cross(z, x),
            z,
        }
    }

    /// The point at these coordinates.
    pub(crate) fn point(&self, [x, y]: Planar, z: f64) -> Point {
        let offset = self.vector([x, y, z]);
        added(self.origin, offset)
    }

    /// The vector with these components.
    pub(crate) fn vector(&self, [x, y, z]: [f64; 3]) -> Point {
        [0, 1, 2].map(|axis| x * self.x[axis] + y * self.y[axis] + z * self.z[axis])
    }

    /// The coordinates of a point.
    pub(crate) fn coordinates(&self, point: Point) -> [f64; 3] {
        let offset = subtract(point, self.origin);
        [
            dot(offset, self.x),
            dot(offset, self.y),
            dot(offset, self.z),
        ]
    }

    /// The frame moved along its z axis.
    pub(crate) fn lifted(&self, z: f64) -> Self {
        Self {
            origin: self.point([0.0; 2], z),
            ..*self
        }
    }

    /// The frame moved to another point of its plane.
    pub(crate) fn moved(&self, to: Planar) -> Self {
        Self {
            origin: self.point(to, 0.0),
            ..*self
        }
    }

    /// The frame whose z axis is this frame's -z, with the same x axis.
    pub(crate) fn flipped(&self) -> Self {
        Self {
            y: scaled(self.y, -1.0),
            z: scaled(self.z, -1.0),
            ..*self
        }
    }

    /// The frame at `origin` whose z axis is this frame's z, or its opposite, and whose x axis is the planar direction
    /// `towards`.
    pub(crate) fn axis_at(&self, origin: Point, towards: Planar, along_z: bool) -> Self {
        let z = if along_z {
            self.z
        } else {
            scaled(self.z, -1.0)
        };
        Self::new(origin, z, self.vector([towards[0], towards[1], 0.0]))
    }
}

/// The sum of two vectors.
pub(crate) fn added(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// A vector times a number.
pub(crate) fn scaled(a: Point, factor: f64) -> Point {
    a.map(|x| x * factor)
}

/// The vector of length one in the same direction.
pub(crate) fn unit(a: Point) -> Point {
    scaled(a, 1.0 / norm(a))
}

/// A planar point moved by `factor` times a planar vector.
pub(crate) fn moved(point: Planar, along: Planar, factor: f64) -> Planar {
    [point[0] + factor * along[0], point[1] + factor * along[1]]
}

/// The planar vector from `a` to `b`.
pub(crate) fn from_to(a: Planar, b: Planar) -> Planar {
    [b[0] - a[0], b[1] - a[1]]
}

/// The length of a planar vector.
pub(crate) fn length(a: Planar) -> f64 {
    (a[0] * a[0] + a[1] * a[1]).sqrt()
}

/// The planar vector of length one in the same direction.
pub(crate) fn planar_unit(a: Planar) -> Planar {
    let length = length(a);
    [a[0] / length, a[1] / length]
}

/// The planar vector rotated clockwise by 90°. It points to the right of the given direction.
pub(crate) fn right_of(a: Planar) -> Planar {
    [a[1], -a[0]]
}

/// The point at this distance and angle from a center.
pub(crate) fn polar(center: Planar, radius: f64, angle: f64) -> Planar {
    [
        center[0] + radius * libm::cos(angle),
        center[1] + radius * libm::sin(angle),
    ]
}
