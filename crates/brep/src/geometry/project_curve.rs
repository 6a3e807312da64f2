//! Projects a point onto a curve: finds the parameter of the nearest point.

use super::nearest::nearest_parameter;
use super::types::Curve;
use partprobe_shape::{Point, distance, dot, norm, subtract};
use std::f64::consts::TAU;

impl Curve {
    /// The parameter of the point of the curve that is nearest to `p`.
    #[must_use]
    pub fn project(&self, p: Point) -> f64 {
        match self {
            Self::Line { origin, direction } => {
                dot(subtract(p, *origin), *direction) / dot(*direction, *direction)
            }
            Self::Ellipse { frame, rx, ry } if rx == ry => {
                let [x, y, _] = frame.local(p);
                libm::atan2(y, x)
            }
            _ => nearest_parameter(&self.samples(p), |t| {
                let (point, slope) = self.derivative(t);
                (subtract(point, p), slope)
            }),
        }
    }

    /// Parameters that are dense enough for the search of the nearest point to any point near `p`.
    pub(crate) fn samples(&self, p: Point) -> Vec<f64> {
        if let Some((low, high)) = self.range() {
            let mut knots = vec![low];
            knots.extend(self.breaks(low, high));
            knots.push(high);
            let per_piece = if knots.len() < 6 {
                24 / (knots.len() - 1)
            } else {
                4
            };
            return between(&knots, per_piece.max(4));
        }
        let (middle, reach) = self.window(p);
        between(&[middle - reach, middle, middle + reach], 32)
    }

    /// The interval of an unbounded curve that contains the nearest point to `p`: its middle and half of its length.
    pub(super) fn window(&self, p: Point) -> (f64, f64) {
        match self {
            Self::Line { origin, direction } => {
                (0.0, 2.0 * distance(*origin, p) / norm(*direction) + 1.0)
            }
            Self::Parabola { frame, focal } => {
                let t = frame.local(p)[1] / (2.0 * focal);
                (t, (distance(frame.origin, p) / focal).sqrt() + 1.0)
            }
            Self::Hyperbola { frame, b, .. } => (libm::asinh(frame.local(p)[1] / b), 2.0),
            Self::Offset { basis, .. } => basis.window(p),
            Self::OnSurface(on) => on.window(p),
            _ => (0.0, TAU),
        }
    }
}

/// Divides each interval between two knots into equal steps.
fn between(knots: &[f64], per_piece: usize) -> Vec<f64> {
    let mut samples = Vec::with_capacity(knots.len() * per_piece);
    for ends in knots.windows(2) {
        samples.extend(
            (0..per_piece).map(|i| ends[0] + (ends[1] - ends[0]) * i as f64 / per_piece as f64),
        );
    }
    samples.extend(knots.last());
    samples
}
