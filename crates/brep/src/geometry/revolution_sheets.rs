//! Surfaces of revolution that meet themselves: an axis and a closed curve that crosses it in, the two sheets out.
//!
//! The turn of a whole circle that crosses the axis is an apple and the lemon inside it, and each has a boundary at the
//! tips, where they meet. As one surface with two periods it has neither.

use super::project_surface::meridian_direction;
use super::types::{CompositeSegment, Curve, Frame, Surface};
use carrier::{Point, dot, subtract};

/// Halvings of the stretch of a curve in which it crosses the axis: more than a float's digits.
const HALVINGS: usize = 60;

/// What each of the two arcs between a closed curve's crossings of the axis turns into, with the curve's own direction; none
/// where it doesn't lie in one plane with the axis, or doesn't cross it twice.
pub(crate) fn revolution_sheets(axis: &Frame, curve: &Curve) -> Option<[Surface; 2]> {
    let period = curve.period()?;
    let toward = meridian_direction(axis, curve, axis.origin)?;
    let [first, second] = crossings(curve, |point| dot(subtract(point, axis.origin), toward))[..] else { return None };
    let sheet = |start: f64, end: f64| {
        let arc = CompositeSegment { curve: curve.clone(), start, end };
        Surface::Revolution { axis: *axis, curve: Box::new(Curve::Composite(vec![arc])) }
    };
    Some([sheet(first, second), sheet(second, first + period)])
}

/// Where `reach` changes its sign along a closed curve.
fn crossings(curve: &Curve, reach: impl Fn(Point) -> f64) -> Vec<f64> {
    let places = curve.samples([0.0; 3]);
    let reach = |t: f64| reach(curve.point(t));
    let is_beyond = |t: f64| reach(t) < 0.0;
    let pairs = places.windows(2).filter(|pair| is_beyond(pair[0]) != is_beyond(pair[1]));
    let halved = |pair: &[f64]| {
        let begins_beyond = is_beyond(pair[0]);
        let (low, high) = (0..HALVINGS).fold((pair[0], pair[1]), |(low, high), _| {
            let middle = 0.5 * (low + high);
            if is_beyond(middle) == begins_beyond { (middle, high) } else { (low, middle) }
        });
        0.5 * (low + high)
    };
    pairs.map(halved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle_at(center: f64) -> Curve {
        let frame = Frame::new([center, 0.0, 0.0], Some([0.0, -1.0, 0.0]), Some([1.0, 0.0, 0.0]));
        Curve::Ellipse { frame, rx: 1.0, ry: 1.0 }
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
                assert!(x.hypot(y) < 1e-12 && (z.abs() - tip).abs() < 1e-12, "{x} {y} {z}");
            }
        }
        let mut reach = sheets.map(|sheet| sheet.point(0.0, 0.5)[0]);
        reach.sort_by(f64::total_cmp);
        assert!((reach[0] + 0.5).abs() < 1e-12 && (reach[1] - 1.5).abs() < 1e-12, "{reach:?}");
    }
}
