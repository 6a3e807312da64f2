//! Splits a surface of revolution that meets itself into its two sheets.
//!
//! A circle that crosses the axis of revolution gives an apple and a lemon inside it. They meet at the tips, where each of them
//! has a boundary. As one surface with two periods, they would have no boundary.

use super::project_sweep::meridian_direction;
use super::types::{CompositeSegment, Curve, Frame, Surface};
use partprobe_shape::{Point, distance, dot, subtract};

/// A point of a curve is beyond the axis if it lies farther behind it than this fraction of the farthest point: a curve may begin
/// on the axis except for rounding.
const BEYOND: f64 = 1e-12;
/// Number of intervals on one sheet whose ends must lie on the other sheet, and the tolerance as a fraction of the sheet's size.
const COMPARED: usize = 7;
const SAME: f64 = 1e-7;
/// The half in which a curve begins is determined this far after its beginning, in periods, because the curve may begin on the
/// axis.
const AFTER_START: f64 = 0.05;

/// Number of times that the interval in which a curve crosses the axis is halved. This is more than a float has binary digits.
const HALVINGS: usize = 60;

/// The surfaces of revolution of the two arcs of a closed curve between its crossings of the axis. The arcs keep the direction of
/// the curve. Returns `None` if the curve does not lie in one plane with the axis, or does not cross it twice.
pub(crate) fn revolution_sheets(axis: &Frame, curve: &Curve) -> Option<[Surface; 2]> {
    let period = curve.period()?;
    let toward = meridian_direction(axis, curve, axis.origin)?;
    let [first, second] = crossings(curve, |point| dot(subtract(point, axis.origin), toward))[..]
    else {
        return None;
    };
    let sheet = |start: f64, end: f64| {
        let arc = CompositeSegment {
            curve: curve.clone(),
            start,
            end,
        };
        Surface::Revolution {
            axis: *axis,
            curve: Box::new(Curve::Composite(vec![arc])),
        }
    };
    Some([sheet(first, second), sheet(second, first + period)])
}

/// The surface of revolution of one half of a closed curve, if both halves give the same surface, as for an ellipse around its
/// own axis. Returns `None` if the two surfaces differ.
///
/// `inside` is a parameter of the half that is used. Without it, the half in which the curve begins is used.
pub(crate) fn half_of_covered_twice(
    axis: &Frame,
    curve: &Curve,
    inside: Option<f64>,
) -> Option<Surface> {
    let period = curve.period()?;
    let [one, other] = revolution_sheets(axis, curve)?;
    let point = |i: usize| one.point(0.0, i as f64 / COMPARED as f64);
    let size = (0..=COMPARED)
        .map(|i| distance(point(0), point(i)))
        .fold(0.0, f64::max);
    if (1..COMPARED).any(|i| other.project(point(i), None).distance > SAME * size) {
        return None;
    }

    let begin = curve.range().map_or(0.0, |(low, _)| low);
    let inside = inside.unwrap_or(begin + AFTER_START * period);
    let holds_inside = |sheet: &Surface| {
        let Surface::Revolution { curve, .. } = sheet else {
            return false;
        };
        let Curve::Composite(segments) = &**curve else {
            return false;
        };
        segments
            .first()
            .is_some_and(|arc| (inside - arc.start).rem_euclid(period) < arc.end - arc.start)
    };
    Some(if holds_inside(&one) { one } else { other })
}

/// The parameters at which `reach` changes its sign along a closed curve.
fn crossings(curve: &Curve, reach: impl Fn(Point) -> f64) -> Vec<f64> {
    let parameters = curve.samples([0.0; 3]);
    let reach = |t: f64| reach(curve.point(t));
    let farthest = parameters
        .iter()
        .map(|&t| reach(t).abs())
        .fold(0.0, f64::max);
    let is_beyond = |t: f64| reach(t) < -BEYOND * farthest;
    let pairs = parameters
        .windows(2)
        .filter(|pair| is_beyond(pair[0]) != is_beyond(pair[1]));
    let halved = |pair: &[f64]| {
        let begins_beyond = is_beyond(pair[0]);
        let (low, high) = (0..HALVINGS).fold((pair[0], pair[1]), |(low, high), _| {
            let middle = 0.5 * (low + high);
            if (reach(middle) < 0.0) == begins_beyond {
                (middle, high)
            } else {
                (low, middle)
            }
        });
        0.5 * (low + high)
    };
    pairs.map(halved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle_at(center: f64) -> Curve {
        let frame = Frame::new(
            [center, 0.0, 0.0],
            Some([0.0, -1.0, 0.0]),
            Some([1.0, 0.0, 0.0]),
        );
        Curve::Ellipse {
            frame,
            rx: 1.0,
            ry: 1.0,
        }
    }

    #[test]
    fn an_apple_and_its_lemon_end_at_the_tips() {
        let axis = Frame::new([0.0; 3], Some([0.0, 0.0, 1.0]), Some([1.0, 0.0, 0.0]));
        assert_eq!(revolution_sheets(&axis, &circle_at(1.5)), None);
        let sheets = revolution_sheets(&axis, &circle_at(0.5)).unwrap();
        let tip = 0.75_f64.sqrt();
        for sheet in &sheets {
            assert_eq!(sheet.period()[1], None);
            let (low, high) = sheet.range()[1].unwrap();
            for v in [low, high] {
                let [x, y, z] = sheet.point(0.3, v);
                assert!(
                    x.hypot(y) < 1e-12 && (z.abs() - tip).abs() < 1e-12,
                    "{x} {y} {z}"
                );
            }
        }
        let mut reach = sheets.map(|sheet| sheet.point(0.0, 0.5)[0]);
        reach.sort_by(f64::total_cmp);
        assert!(
            (reach[0] + 0.5).abs() < 1e-12 && (reach[1] - 1.5).abs() < 1e-12,
            "{reach:?}"
        );
    }

    #[test]
    fn an_ellipse_about_its_own_axis_is_covered_once() {
        let axis = Frame::new([0.0; 3], Some([0.0, 0.0, 1.0]), Some([1.0, 0.0, 0.0]));
        // The curve begins at the equator and rises, or begins at the lower pole. The half that is used lies on the side of
        // positive x.
        for (begins_at, rx, ry) in [([1.0, 0.0, 0.0], 2.0, 3.0), ([0.0, 0.0, -1.0], 3.0, 2.0)] {
            let frame = Frame::new([0.0; 3], Some([0.0, -1.0, 0.0]), Some(begins_at));
            let curve = Curve::Ellipse { frame, rx, ry };
            let half = half_of_covered_twice(&axis, &curve, None).unwrap();
            let (low, high) = half.range()[1].unwrap();
            assert!(
                (half.point(0.0, 0.5 * (low + high))[0] - 2.0).abs() < 1e-6,
                "{half:?}"
            );
        }
        assert_eq!(half_of_covered_twice(&axis, &circle_at(0.5), None), None);
    }
}
