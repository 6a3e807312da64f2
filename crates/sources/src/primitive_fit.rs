//! Fits planes, spheres, cylinders and cones to a few triangles of a mesh.
//!
//! Two or three triangles go in, and the primitive of which they are facets comes out. The corners of the triangles of a
//! tessellated surface lie on the surface, while their normals are those of chords. Positions and radii therefore come from
//! corners, and only directions come from normals. Nothing here is random, and nothing counts support.

use partprobe_carrier::{Point, cross, dot, norm, subtract};

/// Two facets are parallel if the sine of the angle between their normals is below this value.
const PARALLEL: f64 = 0.02;

/// Three facet normals of a cone span at least this volume. Those of a cylinder span no volume.
const CONE_VOLUME: f64 = 1e-5;

/// The smallest value of twice the area between three unit vectors from the tip of a cone. If they lie on a line, they do not
/// determine an axis.
const CONE_ARC: f64 = 1e-9;

/// The sine of the half angle of a cone. The half angle is at least about two degrees, and at least two degrees less than that of
/// a plane.
const CONE_SINES: std::ops::Range<f64> = 0.035..0.9994;

/// A triangle with its unit normal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facet {
    /// The corners, in millimeters.
    pub(crate) corners: [Point; 3],
    /// The outward unit normal.
    pub(crate) normal: Point,
}

/// A surface of one of the types that are searched for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Primitive {
    /// A plane with its unit normal.
    Plane {
        /// A point of the plane.
        point: Point,
        /// The unit normal.
        normal: Point,
    },
    /// A sphere.
    Sphere {
        /// The center.
        center: Point,
        /// The radius, above 0.
        radius: f64,
    },
    /// A cylinder without ends.
    Cylinder {
        /// A point of the axis.
        point: Point,
        /// The unit direction of the axis.
        axis: Point,
        /// The radius, above 0.
        radius: f64,
    },
    /// One nappe of a cone.
    Cone {
        /// The tip.
        apex: Point,
        /// The unit direction in which the cone opens.
        axis: Point,
        /// Sine of the angle between axis and surface.
        sine: f64,
        /// Cosine of the same angle.
        cosine: f64,
    },
}

impl Primitive {
    /// The plane of a facet.
    pub(crate) fn plane(facet: &Facet) -> Self {
        Self::Plane {
            point: facet.corners[0],
            normal: facet.normal,
        }
    }

    /// The sphere through the corners of one facet and the corner of the other that is farthest from its plane.
    pub(crate) fn sphere(first: &Facet, second: &Facet, max_radius: f64) -> Option<Self> {
        let [a, b, c] = first.corners;
        let height = |point: &Point| dot(first.normal, subtract(*point, a)).abs();
        let d = farthest(&second.corners, height)?;

        // The center has equal distances to a and to each of the other points: (x − a) · 2 (p − a) = |p − a|².
        let rows = [b, c, d].map(|point| subtract(point, a));
        let squares = rows.map(|row| 0.5 * dot(row, row));
        let offset = solution(rows, squares)?;
        let radius = norm(offset);
        (0.0 < radius && radius <= max_radius).then(|| Self::Sphere {
            center: sum(a, offset),
            radius,
        })
    }

    /// The cylinder on which two facets lie. The facets must not be parallel.
    pub(crate) fn cylinder(first: &Facet, second: &Facet, max_radius: f64) -> Option<Self> {
        let axis = unit_above(cross(first.normal, second.normal), PARALLEL)?;
        let flattened = |point: Point| subtract(point, axis.map(|x| x * dot(axis, point)));
        let own = first.corners.map(flattened);
        let p = own[0];
        let q = farthest(&own, |point| norm(subtract(*point, p)))?;
        let off_axis = |point: &Point| norm(cross(subtract(q, p), subtract(*point, p)));
        let r = farthest(&second.corners.map(flattened), off_axis)?;

        // The third row keeps the center in the plane of the three.
        let rows = [subtract(q, p), subtract(r, p), axis];
        let offset = solution(
            rows,
            [
                0.5 * dot(rows[0], rows[0]),
                0.5 * dot(rows[1], rows[1]),
                0.0,
            ],
        )?;
        let radius = norm(offset);
        (0.0 < radius && radius <= max_radius).then(|| Self::Cylinder {
            point: sum(p, offset),
            axis,
            radius,
        })
    }

    /// The cone on which three facets lie. Their planes meet at its tip.
    pub(crate) fn cone(facets: [&Facet; 3]) -> Option<Self> {
        let normals = facets.map(|facet| facet.normal);
        let [n, m, o] = normals;
        if dot(n, cross(m, o)).abs() < CONE_VOLUME {
            return None;
        }
        let levels = facets.map(|facet| dot(facet.normal, facet.corners[0]));
        let apex = solution(normals, levels)?;

        // The axis has the same angle to all lines from the tip to a corner, because the corners are on the cone. Its angles to
        // the normals differ, because a wide facet is steeper than a narrow one.
        let mut directions = [[0.0; 3]; 6];
        for (facet, two) in facets.iter().zip(directions.as_chunks_mut().0) {
            *two = outer_directions(&facet.corners, apex);
        }
        let first = directions[0];
        let second = farthest(&directions, |other| norm(subtract(*other, first)))?;
        let aside = |other: &Point| cross(subtract(second, first), subtract(*other, first));
        let third = farthest(&directions, |other| norm(aside(other)))?;
        let axis = unit_above(aside(&third), CONE_ARC)?;

        let height = dot(first, axis);
        let cosine = height.abs();
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        CONE_SINES.contains(&sine).then(|| Self::Cone {
            apex,
            axis: axis.map(|x| x * height.signum()),
            sine,
            cosine,
        })
    }

    /// The distance of a point from the surface, in millimeters. It is not negative.
    pub(crate) fn distance(&self, at: Point) -> f64 {
        match *self {
            Self::Plane { point, normal } => dot(normal, subtract(at, point)).abs(),
            Self::Sphere { center, radius } => (norm(subtract(at, center)) - radius).abs(),
            Self::Cylinder {
                point,
                axis,
                radius,
            } => (norm(from_axis(at, point, axis).1) - radius).abs(),
            Self::Cone {
                apex,
                axis,
                sine,
                cosine,
            } => {
                let (height, radial) = from_axis(at, apex, axis);
                let across = norm(radial);
                if height * cosine + across * sine < 0.0 {
                    norm(subtract(at, apex))
                } else {
                    (across * cosine - height * sine).abs()
                }
            }
        }
    }

    /// The unit normal of the surface near a point. It is 0 at a center, an axis or a tip.
    pub(crate) fn normal(&self, at: Point) -> Point {
        match *self {
            Self::Plane { normal, .. } => normal,
            Self::Sphere { center, .. } => unit(subtract(at, center)),
            Self::Cylinder { point, axis, .. } => unit(from_axis(at, point, axis).1),
            Self::Cone {
                apex,
                axis,
                sine,
                cosine,
            } => {
                let radial = unit(from_axis(at, apex, axis).1);
                [0, 1, 2].map(|x| radial[x] * cosine - axis[x] * sine)
            }
        }
    }
}

/// The position of a point along the axis, and the vector from the axis to the point.
fn from_axis(at: Point, point: Point, axis: Point) -> (f64, Point) {
    let offset = subtract(at, point);
    let height = dot(offset, axis);
    (height, subtract(offset, axis.map(|x| x * height)))
}

fn sum(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// The vector scaled to length 1, or 0 if it has no direction.
fn unit(vector: Point) -> Point {
    unit_above(vector, 0.0).unwrap_or_default()
}

/// The vector scaled to length 1. Returns `None` if it is not longer than `least`.
fn unit_above(vector: Point, least: f64) -> Option<Point> {
    let length = norm(vector);
    (length > least && length.is_finite()).then(|| vector.map(|x| x / length))
}

/// The unit vectors from a tip to the two corners of a facet that are farthest from it. The third corner may be the tip itself.
fn outer_directions(corners: &[Point; 3], tip: Point) -> [Point; 2] {
    let mut along = corners.map(|corner| subtract(corner, tip));
    along.sort_by(|a, b| norm(*b).total_cmp(&norm(*a)));
    [unit(along[0]), unit(along[1])]
}

/// The point with the largest value. If several are equal, the first one is returned.
fn farthest(points: &[Point], value: impl Fn(&Point) -> f64) -> Option<Point> {
    let larger = |best: Option<(Point, f64)>, point: &Point| {
        let value = value(point);
        match best {
            Some((_, largest)) if value <= largest => best,
            _ => Some((*point, value)),
        }
    };
    points.iter().fold(None, larger).map(|(point, _)| point)
}

/// The vector whose scalar products with three rows are given (Cramer's rule). Returns `None` if the rows do not span the space.
fn solution(rows: [Point; 3], values: [f64; 3]) -> Option<Point> {
    let [a, b, c] = rows;
    let volume = dot(a, cross(b, c));
    let [bc, ca, ab] = [cross(b, c), cross(c, a), cross(a, b)];
    let found = [0, 1, 2]
        .map(|axis| (values[0] * bc[axis] + values[1] * ca[axis] + values[2] * ab[axis]) / volume);
    let is_large = volume.abs() > 1e-12 * norm(a) * norm(b) * norm(c);
    (is_large && found.iter().all(|x| x.is_finite())).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn facet(corners: [Point; 3]) -> Facet {
        let [a, b, c] = corners;
        Facet {
            corners,
            normal: unit(cross(subtract(b, a), subtract(c, a))),
        }
    }

    /// Cylinder coordinates around the z axis.
    fn at(radius: f64, angle: f64, z: f64) -> Point {
        [radius * angle.cos(), radius * angle.sin(), z]
    }

    /// A facet of a cone or cylinder between two angles, with the radii at two heights.
    fn strip(radii: [f64; 2], angle: f64, width: f64) -> Facet {
        facet([
            at(radii[0], angle, 0.0),
            at(radii[0], angle + width, 0.0),
            at(radii[1], angle, 3.0),
        ])
    }

    #[track_caller]
    fn check_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-6, "{found} for {expected}");
    }

    proptest! {
        #[test]
        fn the_cylinder_of_facets_is_recovered(radius in 0.1f64..9.0, width in 0.05f64..0.5, apart in 0.3f64..1.5) {
            let [first, second] = [0.0, apart].map(|angle| strip([radius, radius], angle, width));
            let found = Primitive::cylinder(&first, &second, 100.0).unwrap();
            let Primitive::Cylinder { axis, radius: found_radius, .. } = found else { unreachable!() };
            check_near(found_radius, radius);
            check_near(axis[2].abs(), 1.0);
            check_near(found.distance(at(radius + 2.0, 5.0, 7.0)), 2.0);
            check_near(dot(found.normal(at(radius, 2.0, 1.0)), at(1.0, 2.0, 0.0)), 1.0);
            // Three of its facets are not those of a cone.
            let third = strip([radius, radius], 2.0, width);
            prop_assert_eq!(Primitive::cone([&first, &second, &third]), None);
        }

        #[test]
        fn the_cone_of_facets_is_recovered(top in 0.1f64..0.85, width in 0.05f64..0.5, apart in 0.4f64..1.5) {
            let facets = [0.0, apart, 2.0 * apart].map(|angle| strip([1.0, top], angle, width));
            let found = Primitive::cone([&facets[0], &facets[1], &facets[2]]).unwrap();
            let Primitive::Cone { apex, axis, sine, cosine } = found else { unreachable!() };
            check_near(apex[2], 3.0 / (1.0 - top));
            check_near(axis[2], -1.0);
            check_near(sine / cosine, (1.0 - top) / 3.0);
            check_near(found.distance(at(1.0, 4.0, 0.0)), 0.0);
            check_near(found.distance([0.0, 0.0, apex[2] + 2.0]), 2.0);
            check_near(dot(found.normal(at(1.0, 1.0, 0.0)), at(cosine, 1.0, sine)), 1.0);
        }

        #[test]
        fn the_sphere_of_facets_is_recovered(radius in 0.1f64..9.0, size in 0.05f64..0.3, apart in 0.2f64..2.0) {
            let on = |latitude: f64, angle: f64| at(radius * latitude.cos(), angle, radius * latitude.sin());
            let patch = |angle: f64| facet([on(0.1, angle), on(0.1, angle + size), on(0.1 + size, angle)]);
            let found = Primitive::sphere(&patch(0.0), &patch(apart), 100.0).unwrap();
            let Primitive::Sphere { center, radius: found_radius } = found else { unreachable!() };
            check_near(found_radius, radius);
            check_near(norm(center), 0.0);
            check_near(found.distance([0.0; 3]), radius);
            prop_assert_eq!(found.normal(center), [0.0; 3]);
        }
    }

    #[test]
    fn facets_of_one_plane_give_a_plane_only() {
        let [first, second] =
            [0.0, 4.0].map(|x| facet([[x, 0.0, 2.0], [x + 1.0, 0.0, 2.0], [x, 1.0, 2.0]]));
        assert_eq!(Primitive::cylinder(&first, &second, 100.0), None);
        assert_eq!(Primitive::sphere(&first, &second, 100.0), None);
        assert_eq!(Primitive::cone([&first, &second, &first]), None);
        let plane = Primitive::plane(&first);
        check_near(plane.distance([7.0, 8.0, 5.0]), 3.0);
        assert_eq!(plane.normal([0.0; 3]), [0.0, 0.0, 1.0]);
    }
}
