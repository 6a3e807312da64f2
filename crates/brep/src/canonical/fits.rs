//! Fits a primitive of each type to a few points and normals, in closed form.
//!
//! The points of a plane spread in two directions only. The normals of a cylinder spread in two directions, and those of a cone
//! do so around their mean; the tangent planes of a cone meet in its apex. Moved back along their normals by the radius, the
//! points of a sphere coincide. Moved back by the minor radius, which is one over a principal curvature, the points of a torus
//! lie on a circle.

use super::eigen::{least_spread, solved};
use super::primitive::Primitive;
use super::samples::{NormalRates, Sample, Samples};
use crate::geometry::linear::{along, scaled, sum, unit};
use partprobe_shape::{Point, cross, dot, norm, subtract};
use std::f64::consts::FRAC_PI_2;

/// Fewer samples do not suffice to recognize a surface.
const MIN_SAMPLES: usize = 9;

/// The primitive on which all samples lie. If several fit, it is the simplest.
pub(super) fn fitted(samples: &Samples, tolerance: f64) -> Option<Primitive> {
    let list = &samples.list;
    if list.len() < MIN_SAMPLES {
        return None;
    }
    let fits = |primitive: &Primitive| {
        list.iter()
            .all(|sample| primitive.distance(sample.point) <= tolerance)
    };
    let simple = [plane, cylinder, cone, sphere]
        .iter()
        .find_map(|fitter| fitter(list).filter(fits));
    simple.or_else(|| torus(list, samples.normal_rates()?).filter(fits))
}

fn mean(vectors: impl Iterator<Item = Point>) -> Point {
    let (total, n) = vectors.fold(([0.0; 3], 0.0), |(total, n), vector| {
        (sum(total, vector), n + 1.0)
    });
    scaled(total, 1.0 / n)
}

fn plane(samples: &[Sample]) -> Option<Primitive> {
    let points = || samples.iter().map(|sample| sample.point);
    let point = mean(points());
    let (normal, _) = least_spread(points(), point);
    Some(Primitive::Plane { point, normal })
}

fn cylinder(samples: &[Sample]) -> Option<Primitive> {
    let (axis, _) = least_spread(samples.iter().map(|sample| sample.normal), [0.0; 3]);
    let flat = |vector: Point| along(vector, axis, -dot(vector, axis));
    let radius = radius(
        samples
            .iter()
            .map(|sample| (flat(sample.point), flat(sample.normal))),
    )?;
    let point = mean(
        samples
            .iter()
            .map(|sample| along(sample.point, sample.normal, -radius)),
    );
    Some(Primitive::Cylinder {
        point,
        axis,
        radius: radius.abs(),
    })
}

fn cone(samples: &[Sample]) -> Option<Primitive> {
    let middle = mean(samples.iter().map(|sample| sample.normal));
    let (axis, _) = least_spread(samples.iter().map(|sample| sample.normal), middle);
    let apex = meeting_point(samples)?;
    let inside = mean(samples.iter().map(|sample| subtract(sample.point, apex)));
    let axis = if dot(inside, axis) < 0.0 {
        scaled(axis, -1.0)
    } else {
        axis
    };
    let lean = mean(
        samples
            .iter()
            .map(|sample| [dot(sample.normal, axis), 0.0, 0.0]),
    )[0];
    let half_angle = libm::asin(lean.abs().min(1.0));
    (half_angle < FRAC_PI_2).then_some(Primitive::Cone {
        apex,
        axis,
        half_angle,
    })
}

/// The point through which all tangent planes pass, by least squares.
fn meeting_point(samples: &[Sample]) -> Option<Point> {
    // Relative to their mean, the coordinates are small, so differences do not lose digits.
    let origin = mean(samples.iter().map(|sample| sample.point));
    let (mut rows, mut products) = ([[0.0; 3]; 3], [0.0; 3]);
    for Sample { point, normal } in samples {
        let height = dot(subtract(*point, origin), *normal);
        for axis in 0..3 {
            rows[axis] = along(rows[axis], *normal, normal[axis]);
            products[axis] += height * normal[axis];
        }
    }
    solved(rows, products).map(|apex| sum(apex, origin))
}

fn sphere(samples: &[Sample]) -> Option<Primitive> {
    let radius = radius(samples.iter().map(|sample| (sample.point, sample.normal)))?;
    let center = mean(
        samples
            .iter()
            .map(|sample| along(sample.point, sample.normal, -radius)),
    );
    Some(Primitive::Sphere {
        center,
        radius: radius.abs(),
    })
}

/// The ratio of the displacement between points to the difference between their normals. It is negative if the normals point to
/// the center.
fn radius(pairs: impl Iterator<Item = (Point, Point)> + Clone) -> Option<f64> {
    let (points, normals) = (
        mean(pairs.clone().map(|pair| pair.0)),
        mean(pairs.clone().map(|pair| pair.1)),
    );
    let (mut moved, mut rotated) = (0.0, 0.0);
    for (point, normal) in pairs {
        let turn = subtract(normal, normals);
        moved += dot(subtract(point, points), turn);
        rotated += dot(turn, turn);
    }
    Some(moved / rotated).filter(|radius| radius.is_finite() && *radius != 0.0)
}

fn torus(samples: &[Sample], normal_rates: NormalRates) -> Option<Primitive> {
    let curvatures = principal_curvatures(normal_rates)?;
    let candidates = curvatures
        .into_iter()
        .filter_map(|curvature| torus_of(samples, 1.0 / curvature));
    let gap = |torus: &Primitive| {
        samples
            .iter()
            .map(|sample| torus.distance(sample.point))
            .fold(0.0, f64::max)
    };
    candidates.min_by(|a, b| gap(a).total_cmp(&gap(b)))
}

/// The torus whose points are at the distance `minor` from its circle, along their normals.
fn torus_of(samples: &[Sample], minor: f64) -> Option<Primitive> {
    let centers: Vec<Point> = samples
        .iter()
        .map(|sample| along(sample.point, sample.normal, -minor))
        .collect();
    let middle = mean(centers.iter().copied());
    let (axis, spreads) = least_spread(centers.iter().copied(), middle);
    if !spreads[2].is_finite() {
        return None;
    }
    let center = circle_center(&centers, middle, axis)?;
    let n = samples.len() as f64;
    let major = centers
        .iter()
        .map(|point| norm(subtract(*point, center)))
        .sum::<f64>()
        / n;
    // A curvature from differences has only half of the digits. The points have all of them, so the minor radius is computed
    // again from the points.
    let to_circle = |sample: &Sample| {
        Primitive::Torus {
            center,
            axis,
            major,
            minor: 0.0,
        }
        .distance(sample.point)
    };
    let minor = samples.iter().map(to_circle).sum::<f64>() / n;
    Some(Primitive::Torus {
        center,
        axis,
        major,
        minor,
    })
}

/// The center of the circle through points of a plane, by least squares on |p|² = 2·p·c + constant.
fn circle_center(points: &[Point], middle: Point, axis: Point) -> Option<Point> {
    let x = unit(cross(
        axis,
        if axis[0].abs() < 0.9 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        },
    ))?;
    let y = cross(axis, x);
    let (mut rows, mut products) = ([[0.0; 3]; 3], [0.0; 3]);
    for &point in points {
        let arm = subtract(point, middle);
        let row = [2.0 * dot(arm, x), 2.0 * dot(arm, y), 1.0];
        let square = dot(arm, arm);
        for axis in 0..3 {
            rows[axis] = along(rows[axis], row, row[axis]);
            products[axis] += square * row[axis];
        }
    }
    let [a, b, _] = solved(rows, products)?;
    Some(along(along(middle, x, a), y, b))
}

/// The eigenvalues of the map from steps on the surface to changes of the normal. Returns `None` if one of them is zero or not
/// finite.
fn principal_curvatures(NormalRates([du, dv, turn_u, turn_v]): NormalRates) -> Option<[f64; 2]> {
    let (e, f, g) = (dot(du, du), dot(du, dv), dot(dv, dv));
    let (l, n) = (dot(du, turn_u), dot(dv, turn_v));
    let m = 0.5 * (dot(du, turn_v) + dot(dv, turn_u));
    let area = e * g - f * f;
    let (gauss, twice_mean) = ((l * n - m * m) / area, (e * n - 2.0 * f * m + g * l) / area);
    let half = (0.25 * twice_mean * twice_mean - gauss).max(0.0).sqrt();
    let curvatures = [0.5 * twice_mean + half, 0.5 * twice_mean - half];
    curvatures
        .iter()
        .all(|curvature| curvature.is_finite() && *curvature != 0.0)
        .then_some(curvatures)
}
