//! Evaluates curves that are given in the parameter plane of a surface (`PCURVE`), and finds their range.

use super::linear::{along, scaled};
use super::types::{Curve, SurfaceCurve};
use partprobe_shape::{Point, distance, norm};

/// If a line of the parameter plane changes a parameter more slowly than this, the parameter is constant.
const KEEPS: f64 = 1e-9;
/// The turns among which the nearest point of a line around a torus is searched.
const TURNS: [i32; 7] = [0, 1, -1, 2, -2, 3, -3];

impl SurfaceCurve {
    /// Point and first derivative at `t`, by the chain rule.
    pub(crate) fn derivative(&self, t: f64) -> (Point, Point) {
        let (uv, slope) = self.curve.derivative(t);
        let (point, du, dv) = self
            .surface
            .derivatives(self.scale[0] * uv[0], self.scale[1] * uv[1]);
        (
            point,
            along(
                scaled(du, self.scale[0] * slope[0]),
                dv,
                self.scale[1] * slope[1],
            ),
        )
    }

    /// The parameters between which the curve runs: those of the curve in the plane, or one period if it is closed.
    pub(crate) fn range(&self) -> Option<(f64, f64)> {
        self.curve
            .range()
            .or_else(|| self.period().map(|period| (0.0, period)))
    }

    /// The parameter's period. The curve closes in the plane or around a closed surface. Returns `None` if it does not close.
    pub(crate) fn period(&self) -> Option<f64> {
        let Curve::Line { .. } = self.curve else {
            return self.curve.period();
        };
        let speed = self.speed();
        let axis = (0..2).find(|&axis| speed[axis] != 0.0 && speed[1 - axis] == 0.0)?;
        Some(self.surface.period()[axis]? / speed[axis].abs())
    }

    /// The interval of a curve without ends that contains the nearest point to `p`: its middle and half of its length.
    pub(crate) fn window(&self, p: Point) -> (f64, f64) {
        let uv = self.surface.project(p, None).uv;
        let on_curve = [uv[0] / self.scale[0], uv[1] / self.scale[1], 0.0];
        let Curve::Line { origin, .. } = self.curve else {
            return self.curve.window(on_curve);
        };
        let (speed, period) = (self.speed(), self.surface.period());
        // If a parameter is not periodic, it determines how many turns a helix has made.
        let axis = (0..2)
            .filter(|&axis| speed[axis] != 0.0)
            .min_by_key(|&axis| period[axis].is_some());
        let Some(axis) = axis else { return (0.0, 1.0) };
        let at = |axis: usize, turns: i32| {
            let shifted = uv[axis] + f64::from(turns) * period[axis].unwrap_or(0.0);
            (shifted - self.scale[axis] * origin[axis]) / speed[axis]
        };
        let middle = match period[axis] {
            // If both parameters are periodic, the turn with the nearest point is taken.
            Some(_) if speed[1 - axis] != 0.0 => {
                let gap = |turns: i32| distance(self.derivative(at(axis, turns)).0, p);
                at(
                    axis,
                    TURNS
                        .into_iter()
                        .min_by(|&a, &b| gap(a).total_cmp(&gap(b)))
                        .unwrap_or(0),
                )
            }
            _ => at(axis, 0),
        };
        let turn = (0..2)
            .filter_map(|axis| Some(period[axis]? / speed[axis].abs()))
            .fold(f64::INFINITY, f64::min);
        (
            middle,
            if turn.is_finite() {
                0.25 * turn
            } else {
                1e-3 * middle.abs() + 1e-3 / norm([speed[0], speed[1], 0.0])
            },
        )
    }

    /// The amounts that a unit step along a line of the plane adds to u and to v.
    fn speed(&self) -> [f64; 2] {
        let Curve::Line { direction, .. } = self.curve else {
            return [0.0; 2];
        };
        let speed = [self.scale[0] * direction[0], self.scale[1] * direction[1]];
        let extent = self.surface.extent();
        let fraction = |axis: usize| (speed[axis] / extent[axis]).abs();
        [0, 1].map(|axis| {
            if fraction(axis) <= KEEPS * fraction(1 - axis) {
                0.0
            } else {
                speed[axis]
            }
        })
    }
}
