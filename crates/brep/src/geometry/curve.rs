//! Evaluates curves: points, derivatives, range and period.

use super::bspline_basis::jumps_at_a_knot;
use super::linear::{along, scaled, sum, unit};
use super::types::{CompositeSegment, Curve};
use partprobe_shape::{Point, cross, distance, subtract};
use std::f64::consts::TAU;

impl Curve {
    /// The point at parameter `t`. Beyond the ends, a bounded curve stays at its end, and the parameter of a closed curve is
    /// wrapped.
    #[must_use]
    pub fn point(&self, t: f64) -> Point {
        self.derivative(t).0
    }

    /// Point and first derivative at `t`.
    #[must_use]
    pub fn derivative(&self, t: f64) -> (Point, Point) {
        match self {
            Self::Line { origin, direction } => (along(*origin, *direction, t), *direction),
            Self::Ellipse { frame, rx, ry } => {
                let (sin, cos) = libm::sincos(t);
                (
                    frame.point(rx * cos, ry * sin, 0.0),
                    frame.vector(-rx * sin, ry * cos, 0.0),
                )
            }
            Self::Parabola { frame, focal } => {
                let slope = 2.0 * focal;
                (
                    frame.point(focal * t * t, slope * t, 0.0),
                    frame.vector(slope * t, slope, 0.0),
                )
            }
            Self::Hyperbola { frame, a, b } => {
                let (sinh, cosh) = (libm::sinh(t), libm::cosh(t));
                (
                    frame.point(a * cosh, b * sinh, 0.0),
                    frame.vector(a * sinh, b * cosh, 0.0),
                )
            }
            Self::Bspline(spline) => spline.derivative(t),
            Self::Polyline(points) => polyline_derivative(points, self.wrapped(t)),
            Self::Composite(segments) => composite_derivative(segments, self.wrapped(t)),
            Self::Offset {
                basis,
                distance,
                reference,
            } => offset_derivative(basis, *distance, *reference, t),
            Self::OnSurface(on) => on.derivative(t),
        }
    }

    /// Whether the tangent may jump somewhere inside.
    pub(crate) fn has_kinks(&self) -> bool {
        match self {
            Self::Line { .. }
            | Self::Ellipse { .. }
            | Self::Parabola { .. }
            | Self::Hyperbola { .. } => false,
            Self::Bspline(spline) => jumps_at_a_knot(&spline.knots, spline.degree),
            Self::Polyline(points) => points.len() > 2,
            Self::Composite(segments) => {
                segments.len() > 1 || segments.iter().any(|segment| segment.curve.has_kinks())
            }
            Self::Offset { basis, .. } => basis.has_kinks(),
            Self::OnSurface(on) => on.curve.has_kinks() || on.surface.has_kinks(),
        }
    }

    /// The parameters between which the curve runs. Returns `None` if it has no ends.
    #[must_use]
    pub fn range(&self) -> Option<(f64, f64)> {
        match self {
            Self::Line { .. } | Self::Parabola { .. } | Self::Hyperbola { .. } => None,
            Self::Ellipse { .. } => Some((0.0, TAU)),
            Self::Bspline(spline) => Some(spline.range()),
            Self::Polyline(points) => Some((0.0, points.len().saturating_sub(1) as f64)),
            Self::Composite(segments) => Some((0.0, segments.len() as f64)),
            Self::Offset { basis, .. } => basis.range(),
            Self::OnSurface(on) => on.range(),
        }
    }

    /// The parameter's period. Returns `None` if the curve does not close.
    #[must_use]
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Line { .. } | Self::Parabola { .. } | Self::Hyperbola { .. } => None,
            Self::Ellipse { .. } => Some(TAU),
            Self::Bspline(spline) => {
                let (low, high) = spline.range();
                spline.closed.then_some(high - low)
            }
            Self::Polyline(points) => {
                let (first, last) = (points.first()?, points.last()?);
                let size = partprobe_shape::bounding_diagonal(points);
                (points.len() > 2 && distance(*first, *last) <= 1e-7 * size)
                    .then(|| (points.len() - 1) as f64)
            }
            Self::Composite(segments) => {
                let (first, last) = (segments.first()?, segments.last()?);
                let (head, middle) = (
                    first.curve.point(first.start),
                    first.curve.point((first.start + first.end) / 2.0),
                );
                let gap = distance(head, last.curve.point(last.end));
                (gap <= 1e-7 * distance(head, middle)).then_some(segments.len() as f64)
            }
            Self::Offset { basis, .. } => basis.period(),
            Self::OnSurface(on) => on.period(),
        }
    }

    /// The parameters strictly between `low` and `high` where the curve may bend sharply, ascending.
    pub(crate) fn breaks(&self, low: f64, high: f64) -> Vec<f64> {
        let own = match self {
            Self::Bspline(spline) => spline.breaks(),
            Self::Polyline(points) => (0..points.len()).map(|i| i as f64).collect(),
            Self::Composite(segments) => composite_breaks(segments),
            Self::Offset { basis, .. } => return basis.breaks(low, high),
            Self::OnSurface(on) => return on.curve.breaks(low, high),
            _ => return Vec::new(),
        };
        let margin = 1e-9 * (high - low);
        let shifts = self
            .period()
            .map_or(vec![0.0], |period| vec![-period, 0.0, period]);
        let mut inner: Vec<f64> = shifts
            .iter()
            .flat_map(|shift| own.iter().map(move |t| t + shift))
            .collect();
        inner.retain(|&t| t > low + margin && t < high - margin);
        inner.sort_by(f64::total_cmp);
        inner.dedup_by(|a, b| (*a - *b).abs() <= margin);
        inner
    }

    /// The parameter of a polyline or a composite counts its pieces, so a parameter beyond the ends must be moved into the range.
    fn wrapped(&self, t: f64) -> f64 {
        let (low, high) = self.range().unwrap_or((0.0, 0.0));
        if (low..=high).contains(&t) {
            return t;
        }
        super::bspline_basis::into_range(t, (low, high), self.period().is_some())
    }
}

fn polyline_derivative(points: &[Point], t: f64) -> (Point, Point) {
    match points {
        [] => ([f64::NAN; 3], [0.0; 3]),
        [only] => (*only, [0.0; 3]),
        _ => {
            let i = (t.max(0.0) as usize).min(points.len() - 2);
            let side = subtract(points[i + 1], points[i]);
            (along(points[i], side, t - i as f64), side)
        }
    }
}

fn composite_derivative(segments: &[CompositeSegment], t: f64) -> (Point, Point) {
    let Some(last) = segments.len().checked_sub(1) else {
        return ([f64::NAN; 3], [0.0; 3]);
    };
    let i = (t.max(0.0) as usize).min(last);
    let CompositeSegment { curve, start, end } = &segments[i];
    let (point, slope) = curve.derivative(start + (end - start) * (t - i as f64));
    (point, scaled(slope, end - start))
}

fn composite_breaks(segments: &[CompositeSegment]) -> Vec<f64> {
    let mut breaks = Vec::new();
    for (i, CompositeSegment { curve, start, end }) in segments.iter().enumerate() {
        breaks.push(i as f64);
        let inner = curve.breaks(start.min(*end), start.max(*end));
        breaks.extend(inner.iter().map(|t| i as f64 + (t - start) / (end - start)));
    }
    breaks.push(segments.len() as f64);
    breaks
}

fn offset_derivative(basis: &Curve, distance: f64, reference: Point, t: f64) -> (Point, Point) {
    let moved = |t: f64| {
        let (point, slope) = basis.derivative(t);
        unit(cross(reference, slope)).map_or(point, |aside| along(point, aside, distance))
    };
    let step = 1e-6
        * basis
            .range()
            .map_or(1.0 + t.abs(), |(low, high)| high - low);
    let slope = scaled(subtract(moved(t + step), moved(t - step)), 0.5 / step);
    (sum(moved(t), [0.0; 3]), slope)
}
