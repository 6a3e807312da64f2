//! Makes closed planar profiles from dimensions: loops of lines, arcs and splines.
//!
//! The material is on the left of a profile, so a boundary runs anticlockwise and a hole clockwise.

use crate::frame::{Planar, from_to, length, moved, planar_unit, polar, right_of};
use crate::side::{PlacedSide, Side};
use std::f64::consts::TAU;

/// The form in which a full circle is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Circle {
    /// One closed edge. Walls have a seam.
    Seamed,
    /// One closed edge. Walls have two separate bounds and no seam.
    Seamless,
    /// Two half circles. Walls are two half cylinders.
    Halved,
}

/// A closed loop of sides.
///
/// Invariant: side `i` runs from point `i` to the next point, and the last side runs back to the first point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Profile {
    pub(crate) points: Vec<Planar>,
    pub(crate) sides: Vec<Side>,
    /// Whether the walls of a profile with a single side are written without a seam.
    pub(crate) seamless: bool,
}

impl Profile {
    fn new(points: Vec<Planar>, sides: Vec<Side>) -> Self {
        Self {
            points,
            sides,
            seamless: false,
        }
    }

    /// A circle.
    pub(crate) fn circle(center: Planar, radius: f64, style: Circle) -> Self {
        Self::rotated_circle(center, radius, style, 0.0)
    }

    /// A circle whose first vertex is at this angle.
    pub(crate) fn rotated_circle(center: Planar, radius: f64, style: Circle, angle: f64) -> Self {
        let arc = Side::Arc { center, ccw: true };
        let start = polar(center, radius, angle);
        match style {
            Circle::Seamed => Self::new(vec![start], vec![arc]),
            Circle::Seamless => Self {
                seamless: true,
                ..Self::new(vec![start], vec![arc])
            },
            Circle::Halved => {
                let opposite = [2.0 * center[0] - start[0], 2.0 * center[1] - start[1]];
                Self::new(vec![start, opposite], vec![arc.clone(), arc])
            }
        }
    }

    /// Straight sides between these points.
    pub(crate) fn polygon(points: Vec<Planar>) -> Self {
        let sides = vec![Side::Line; points.len()];
        Self::new(points, sides)
    }

    /// A regular polygon whose sides are at the distance `apothem` from the center.
    pub(crate) fn regular(center: Planar, apothem: f64, n_sides: u32, turn: f64) -> Self {
        let step = TAU / f64::from(n_sides);
        let radius = apothem / libm::cos(step / 2.0);
        Self::polygon(
            (0..n_sides)
                .map(|i| polar(center, radius, turn + step * f64::from(i)))
                .collect(),
        )
    }

    /// A rectangle between two opposite corners.
    pub(crate) fn rectangle(low: Planar, high: Planar) -> Self {
        Self::polygon(vec![low, [high[0], low[1]], high, [low[0], high[1]]])
    }

    /// A polygon with each corner rounded by its radius. Radius 0 leaves the corner sharp.
    pub(crate) fn rounded(corners: &[Planar], radii: &[f64]) -> Self {
        let n = corners.len();
        let (mut points, mut sides) = (Vec::new(), Vec::new());
        for i in 0..n {
            let (before, corner, after) =
                (corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n]);
            if radii[i] <= 0.0 {
                points.push(corner);
                sides.push(Side::Line);
                continue;
            }
            let (inward, onward) = (
                planar_unit(from_to(before, corner)),
                planar_unit(from_to(corner, after)),
            );
            let turn = libm::atan2(
                inward[0] * onward[1] - inward[1] * onward[0],
                inward[0] * onward[0] + inward[1] * onward[1],
            );
            let setback = radii[i] * libm::tan(turn.abs() / 2.0);
            let start = moved(corner, inward, -setback);
            let center = moved(
                start,
                right_of(inward),
                if turn > 0.0 { -radii[i] } else { radii[i] },
            );
            points.extend([start, moved(corner, onward, setback)]);
            sides.extend([
                Side::Arc {
                    center,
                    ccw: turn > 0.0,
                },
                Side::Line,
            ]);
        }
        Self::new(points, sides)
    }

    /// A rectangle with four rounded corners.
    pub(crate) fn rounded_rectangle(low: Planar, high: Planar, radius: f64) -> Self {
        Self::rounded(
            &[low, [high[0], low[1]], high, [low[0], high[1]]],
            &[radius; 4],
        )
    }

    /// The hull of two circles: a slot if the radii are equal, otherwise a link.
    pub(crate) fn hull(a: Planar, radius_a: f64, b: Planar, radius_b: f64) -> Self {
        let axis = from_to(a, b);
        let toward = libm::atan2(axis[1], axis[0]);
        let lean = libm::acos((radius_a - radius_b) / length(axis));
        let points = vec![
            polar(a, radius_a, toward - lean),
            polar(b, radius_b, toward - lean),
            polar(b, radius_b, toward + lean),
            polar(a, radius_a, toward + lean),
        ];
        let arc = |center| Side::Arc { center, ccw: true };
        Self::new(points, vec![Side::Line, arc(b), Side::Line, arc(a)])
    }

    /// A slot that is bent around a center, with round ends of radius `half_width`.
    pub(crate) fn bent_slot(
        center: Planar,
        radius: f64,
        half_width: f64,
        from: f64,
        sweep: f64,
    ) -> Self {
        let (inner, outer) = (radius - half_width, radius + half_width);
        let points = vec![
            polar(center, outer, from),
            polar(center, outer, from + sweep),
            polar(center, inner, from + sweep),
            polar(center, inner, from),
        ];
        let end = |angle| Side::Arc {
            center: polar(center, radius, angle),
            ccw: true,
        };
        let sides = vec![
            Side::Arc { center, ccw: true },
            end(from + sweep),
            Side::Arc { center, ccw: false },
            end(from),
        ];
        Self::new(points, sides)
    }

    /// A profile of the given points and the sides between them.
    pub(crate) fn of_sides(points: Vec<Planar>, sides: Vec<Side>) -> Self {
        Self::new(points, sides)
    }

    /// The number of sides.
    pub(crate) fn n_sides(&self) -> usize {
        self.sides.len()
    }

    /// Side `i` with its ends.
    pub(crate) fn side(&self, i: usize) -> PlacedSide<'_> {
        PlacedSide {
            start: self.points[i],
            end: self.points[(i + 1) % self.points.len()],
            side: &self.sides[i],
        }
    }

    /// The area inside, negative for a hole.
    pub(crate) fn area(&self) -> f64 {
        (0..self.n_sides()).map(|i| self.side(i).area_share()).sum()
    }

    /// The direction in which vertex `i` moves when the profile is offset to its right by one.
    pub(crate) fn miter(&self, i: usize) -> Planar {
        let before = self
            .side((i + self.n_sides() - 1) % self.n_sides())
            .direction_at_end();
        let (a, b) = (
            right_of(before),
            right_of(self.side(i).direction_at_start()),
        );
        let shrink = 1.0 + a[0] * b[0] + a[1] * b[1];
        [(a[0] + b[0]) / shrink, (a[1] + b[1]) / shrink]
    }

    /// The profile offset to its right. A positive distance enlarges a boundary and shrinks a hole.
    pub(crate) fn offset(&self, distance: f64) -> Self {
        if distance == 0.0 {
            return self.clone();
        }
        let points = (0..self.n_sides())
            .map(|i| moved(self.points[i], self.miter(i), distance))
            .collect();
        Self {
            points,
            ..self.clone()
        }
    }

    /// The same loop in the opposite direction. It bounds a hole.
    pub(crate) fn reversed(&self) -> Self {
        let n = self.n_sides();
        let points = (0..n).map(|i| self.points[(n - i) % n]).collect();
        let reversed = |side: &Side| match side {
            Side::Line => Side::Line,
            Side::Arc { center, ccw } => Side::Arc {
                center: *center,
                ccw: !ccw,
            },
            Side::Spline(controls) => Side::Spline(controls.iter().rev().copied().collect()),
        };
        Self {
            points,
            sides: self.sides.iter().rev().map(reversed).collect(),
            seamless: self.seamless,
        }
    }

    /// The profile with a vertex inserted into side `i`, at this fraction of it. A spline is not split.
    pub(crate) fn split(&self, i: usize, fraction: f64) -> Self {
        let placed = self.side(i);
        if matches!(self.sides[i], Side::Spline(_)) {
            return self.clone();
        }
        let between = placed.point(fraction);
        let mut profile = self.clone();
        profile.points.insert(i + 1, between);
        profile.sides.insert(i + 1, self.sides[i].clone());
        profile.seamless = false;
        profile
    }

    /// The profile rotated about a point, by an angle in radians.
    pub(crate) fn rotated(&self, center: Planar, angle: f64) -> Self {
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let turn = |point: Planar| {
            let [x, y] = from_to(center, point);
            [center[0] + cos * x - sin * y, center[1] + sin * x + cos * y]
        };
        let sides = self.sides.iter().map(|side| match side {
            Side::Line => Side::Line,
            Side::Arc { center, ccw } => Side::Arc {
                center: turn(*center),
                ccw: *ccw,
            },
            Side::Spline(controls) => Side::Spline(controls.iter().copied().map(turn).collect()),
        });
        Self {
            points: self.points.iter().copied().map(turn).collect(),
            sides: sides.collect(),
            seamless: self.seamless,
        }
    }
}

/// A profile with `n` equal teeth: arcs on two radii, joined by straight flanks.
pub(crate) fn toothed(root: f64, tip: f64, n: u32, tooth_share: f64) -> Profile {
    let pitch = TAU / f64::from(n);
    let (half_tooth, half_gap) = (
        0.5 * pitch * tooth_share * 0.8,
        0.5 * pitch * (1.0 - tooth_share) * 0.8,
    );
    let (mut points, mut sides) = (Vec::new(), Vec::new());
    for i in 0..n {
        let middle = pitch * f64::from(i);
        points.extend([
            polar([0.0; 2], tip, middle - half_tooth),
            polar([0.0; 2], tip, middle + half_tooth),
            polar([0.0; 2], root, middle + pitch / 2.0 - half_gap),
            polar([0.0; 2], root, middle + pitch / 2.0 + half_gap),
        ]);
        let arc = Side::Arc {
            center: [0.0; 2],
            ccw: true,
        };
        sides.extend([arc.clone(), Side::Line, arc, Side::Line]);
    }
    Profile::of_sides(points, sides)
}

/// A circle with `n` round scallops of this radius cut into its rim.
pub(crate) fn scalloped(radius: f64, scallop: f64, n: u32) -> Profile {
    // A scallop is centered on the rim; its two ends lie where the circles cross.
    let half = 2.0 * libm::asin(scallop / (2.0 * radius));
    let pitch = TAU / f64::from(n);
    let (mut points, mut sides) = (Vec::new(), Vec::new());
    for i in 0..n {
        let middle = pitch * f64::from(i);
        points.extend([
            polar([0.0; 2], radius, middle - half),
            polar([0.0; 2], radius, middle + half),
        ]);
        sides.extend([
            Side::Arc {
                center: polar([0.0; 2], radius, middle),
                ccw: false,
            },
            Side::Arc {
                center: [0.0; 2],
                ccw: true,
            },
        ]);
    }
    Profile::of_sides(points, sides)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[track_caller]
    fn check(profile: &Profile, area: f64) {
        assert!(
            (profile.area() - area).abs() < 1e-9,
            "{} is not {area}",
            profile.area()
        );
        assert!((profile.reversed().area() + area).abs() < 1e-9);
        assert!((profile.rotated([3.0, 1.0], 0.7).area() - area).abs() < 1e-9);
        assert!((profile.split(0, 0.3).area() - area).abs() < 1e-9);
    }

    #[test]
    fn areas_are_those_of_the_textbook() {
        for style in [Circle::Seamed, Circle::Seamless, Circle::Halved] {
            check(&Profile::circle([1.0, 2.0], 3.0, style), 9.0 * PI);
            check(
                &Profile::circle([1.0, 2.0], 3.0, style).offset(1.0),
                16.0 * PI,
            );
        }
        check(&Profile::rectangle([0.0; 2], [4.0, 3.0]), 12.0);
        check(&Profile::rectangle([0.0; 2], [4.0, 3.0]).offset(-0.5), 6.0);
        check(
            &Profile::rounded_rectangle([0.0; 2], [4.0, 3.0], 1.0),
            8.0 + PI,
        );
        check(&Profile::hull([0.0; 2], 1.0, [5.0, 0.0], 1.0), 10.0 + PI);
        check(&Profile::bent_slot([0.0; 2], 5.0, 1.0, 0.2, 1.0), 10.0 + PI);
        check(
            &Profile::regular([0.0; 2], 1.0, 6, 0.1),
            2.0 * 3.0_f64.sqrt(),
        );
    }

    #[test]
    fn an_l_with_a_round_inner_corner_has_the_fillet_more() {
        let corners = [
            [0.0, 0.0],
            [4.0, 0.0],
            [4.0, 1.0],
            [1.0, 1.0],
            [1.0, 4.0],
            [0.0, 4.0],
        ];
        check(
            &Profile::rounded(&corners, &[0.0, 0.0, 0.0, 0.5, 0.0, 0.0]),
            7.0 + 0.25 * (1.0 - PI / 4.0),
        );
    }
}
