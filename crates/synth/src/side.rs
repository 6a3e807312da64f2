//! Describes one side of a profile or one step of a path: a straight line, a circular arc, or a spline.

use crate::frame::{Planar, from_to, length, moved, planar_unit, polar, right_of};
use crate::spline;
use std::f64::consts::TAU;

/// The curve between two neighboring points of a planar line.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Side {
    /// A straight line.
    Line,
    /// A circular arc. It is a full circle if the two points are equal.
    Arc {
        /// The center of the circle.
        center: Planar,
        /// Whether the arc is anticlockwise, so that the center is on its left.
        ccw: bool,
    },
    /// A clamped uniform cubic spline with these control points, which include both ends.
    Spline(Vec<Planar>),
}

/// A side with its two ends.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedSide<'a> {
    pub(crate) start: Planar,
    pub(crate) end: Planar,
    pub(crate) side: &'a Side,
}

impl PlacedSide<'_> {
    /// The direction in which the side leaves its start.
    pub(crate) fn direction_at_start(&self) -> Planar {
        match self.side {
            Side::Line => planar_unit(from_to(self.start, self.end)),
            Side::Arc { center, ccw } => along_circle(*center, self.start, *ccw),
            Side::Spline(controls) => planar_unit(from_to(controls[0], controls[1])),
        }
    }

    /// The direction in which the side reaches its end.
    pub(crate) fn direction_at_end(&self) -> Planar {
        match self.side {
            Side::Line => planar_unit(from_to(self.start, self.end)),
            Side::Arc { center, ccw } => along_circle(*center, self.end, *ccw),
            Side::Spline(controls) => planar_unit(from_to(
                controls[controls.len() - 2],
                controls[controls.len() - 1],
            )),
        }
    }

    /// The angle of an arc, positive if it is anticlockwise. Returns 0 for other curves.
    pub(crate) fn turn(&self) -> f64 {
        let Side::Arc { center, ccw } = *self.side else {
            return 0.0;
        };
        let (from, to) = (angle_of(center, self.start), angle_of(center, self.end));
        let ccw_turn = if ccw { to - from } else { from - to };
        let positive = if ccw_turn <= 1e-9 {
            ccw_turn + TAU
        } else {
            ccw_turn
        };
        if ccw { positive } else { -positive }
    }

    /// The length of the side.
    pub(crate) fn length(&self) -> f64 {
        match self.side {
            Side::Line => length(from_to(self.start, self.end)),
            Side::Arc { center, .. } => length(from_to(*center, self.start)) * self.turn().abs(),
            Side::Spline(controls) => {
                spline::integral(16 * controls.len(), |t| length(spline::slope(controls, t)))
            }
        }
    }

    /// The point at the parameter `t`, which is 0 at the start and 1 at the end.
    pub(crate) fn point(&self, t: f64) -> Planar {
        match self.side {
            Side::Line => moved(self.start, from_to(self.start, self.end), t),
            Side::Arc { center, .. } => {
                let radius = length(from_to(*center, self.start));
                polar(
                    *center,
                    radius,
                    angle_of(*center, self.start) + t * self.turn(),
                )
            }
            Side::Spline(controls) => spline::point(controls, t),
        }
    }

    /// The derivative of [`PlacedSide::point`].
    pub(crate) fn slope(&self, t: f64) -> Planar {
        match self.side {
            Side::Line => from_to(self.start, self.end),
            Side::Arc { center, .. } => {
                let [x, y] = from_to(*center, self.point(t));
                [-y * self.turn(), x * self.turn()]
            }
            Side::Spline(controls) => spline::slope(controls, t),
        }
    }

    /// The number of pieces into which an integral along the side is split, so that it is exact up to rounding.
    pub(crate) fn n_pieces(&self) -> usize {
        match self.side {
            Side::Line => 1,
            Side::Arc { .. } => 4,
            Side::Spline(controls) => 4 * (controls.len() - spline::DEGREE),
        }
    }

    /// The contribution of the side to the area of a loop: half the integral of x dy − y dx.
    pub(crate) fn area_share(&self) -> f64 {
        let wedge = |a: Planar, b: Planar| 0.5 * (a[0] * b[1] - a[1] * b[0]);
        match self.side {
            Side::Line => wedge(self.start, self.end),
            Side::Arc { center, .. } => {
                let radius = length(from_to(*center, self.start));
                let turn = self.turn();
                wedge(self.start, self.end) + 0.5 * radius * radius * (turn - libm::sin(turn))
            }
            Side::Spline(controls) => {
                let n_spans = controls.len() - spline::DEGREE;
                spline::integral(n_spans, |t| {
                    wedge(spline::point(controls, t), spline::slope(controls, t))
                })
            }
        }
    }
}

/// The direction of motion at `at` on a circle around `center`.
fn along_circle(center: Planar, at: Planar, ccw: bool) -> Planar {
    let outward = planar_unit(from_to(center, at));
    let [x, y] = right_of(outward);
    if ccw { [-x, -y] } else { [x, y] }
}

/// The angle at which `point` is seen from `center`.
pub(crate) fn angle_of(center: Planar, point: Planar) -> f64 {
    libm::atan2(point[1] - center[1], point[0] - center[0])
}
