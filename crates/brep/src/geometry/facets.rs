//! Represents the triangles that a file gives instead of a surface, with parameters like those of a surface.
//!
//! Triangle `k` covers the parameters `2k ≤ u ≤ 2k + 1`, `0 ≤ v ≤ 1` with `(u − 2k) + v ≤ 1`. Both are smallest at its first corner,
//! `u` grows toward the second corner and `v` toward the third. The gaps between the ranges of triangles keep their corners
//! distinct.

use super::linear::{along, sum};
use partprobe_shape::{Point, cross, dot, norm, subtract};

/// The triangles of one face, counter-clockwise seen against the face's normal.
///
/// Invariant: there is at least one triangle, every index is one of `points`, and there are either no normals or one normal per
/// point.
#[derive(Clone, Debug, PartialEq)]
pub struct Facets {
    /// Points in millimeters.
    pub points: Vec<Point>,
    /// Indices of the corners.
    pub triangles: Vec<[u32; 3]>,
    /// The normals at the points as the file gives them. They are not normalized.
    pub normals: Vec<Point>,
}

impl Facets {
    /// The point at (u, v), and the two sides of its triangle that begin at the first corner.
    pub(crate) fn derivatives(&self, u: f64, v: f64) -> (Point, Point, Point) {
        let last = self.triangles.len() - 1;
        let triangle = ((0.5 * u).floor().max(0.0) as usize).min(last);
        let (a, ab, ac) = self.sides(triangle);
        let s = u - 2.0 * triangle as f64;
        (along(along(a, ab, s), ac, v), ab, ac)
    }

    /// The parameters between which the triangles lie.
    pub(crate) fn range(&self) -> [(f64, f64); 2] {
        [(0.0, 2.0 * self.triangles.len() as f64 - 1.0), (0.0, 1.0)]
    }

    /// The parameters of the nearest point. Every triangle is tested.
    pub(crate) fn nearest(&self, p: Point) -> [f64; 2] {
        let mut best = (f64::INFINITY, [0.0; 2]);
        for triangle in 0..self.triangles.len() {
            let (a, ab, ac) = self.sides(triangle);
            let reach = norm(ab).max(norm(ac));
            if norm(subtract(p, a)) - reach > best.0 {
                continue;
            }
            let [s, t] = nearest_in_triangle(subtract(p, a), ab, ac);
            let distance = norm(subtract(p, along(along(a, ab, s), ac, t)));
            if distance < best.0 {
                best = (distance, [2.0 * triangle as f64 + s, t]);
            }
        }
        best.1
    }

    /// The area of the triangles.
    pub(crate) fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|triangle| {
                let (_, ab, ac) = self.sides(triangle);
                0.5 * norm(cross(ab, ac))
            })
            .sum()
    }

    /// The mean normal of the triangles at each point, weighted by area and not normalized.
    pub(crate) fn mean_normals(&self) -> Vec<Point> {
        let mut normals = vec![[0.0; 3]; self.points.len()];
        for (triangle, corners) in self.triangles.iter().enumerate() {
            let (_, ab, ac) = self.sides(triangle);
            for &corner in corners {
                normals[corner as usize] = sum(normals[corner as usize], cross(ab, ac));
            }
        }
        normals
    }

    /// The largest angle between two triangles that share a side, in degrees. It is 0 for a single triangle.
    pub(crate) fn largest_bend_deg(&self) -> f64 {
        let mut sides: Vec<([u32; 2], usize)> = Vec::with_capacity(3 * self.triangles.len());
        for (triangle, &[a, b, c]) in self.triangles.iter().enumerate() {
            sides.extend(
                [[a, b], [b, c], [c, a]].map(|[from, to]| ([from.min(to), from.max(to)], triangle)),
            );
        }
        sides.sort_unstable();
        let normal = |triangle: usize| {
            let (_, ab, ac) = self.sides(triangle);
            cross(ab, ac)
        };
        let bends = sides
            .windows(2)
            .filter(|pair| pair[0].0 == pair[1].0)
            .map(|pair| {
                let (a, b) = (normal(pair[0].1), normal(pair[1].1));
                libm::atan2(norm(cross(a, b)), dot(a, b)).to_degrees()
            });
        bends.fold(0.0, f64::max)
    }

    fn sides(&self, triangle: usize) -> (Point, Point, Point) {
        let [a, b, c] = self.triangles[triangle].map(|corner| self.points[corner as usize]);
        (a, subtract(b, a), subtract(c, a))
    }
}

/// The point of the triangle `0, ab, ac` nearest to `p`, as fractions of its two sides.
fn nearest_in_triangle(p: Point, ab: Point, ac: Point) -> [f64; 2] {
    let (bb, bc, cc) = (dot(ab, ab), dot(ab, ac), dot(ac, ac));
    let (pb, pc) = (dot(p, ab), dot(p, ac));
    let determinant = bb * cc - bc * bc;
    if determinant > 0.0 {
        let (s, t) = (
            (pb * cc - pc * bc) / determinant,
            (pc * bb - pb * bc) / determinant,
        );
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            return [s, t];
        }
    }
    let fraction = |along: f64, length: f64| {
        if length > 0.0 {
            (along / length).clamp(0.0, 1.0)
        } else {
            0.0
        }
    };
    let across = fraction(
        dot(subtract(p, ab), subtract(ac, ab)),
        dot(subtract(ac, ab), subtract(ac, ab)),
    );
    let on_sides = [
        [fraction(pb, bb), 0.0],
        [0.0, fraction(pc, cc)],
        [1.0 - across, across],
    ];
    let gap = |[s, t]: [f64; 2]| norm(subtract(p, along(along([0.0; 3], ab, s), ac, t)));
    on_sides
        .into_iter()
        .min_by(|a, b| gap(*a).total_cmp(&gap(*b)))
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use partprobe_shape::distance;
    use proptest::prelude::*;

    fn tent() -> Facets {
        let points = vec![
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [2.0, 2.0, 0.0],
            [0.0, 2.0, 1.0],
        ];
        Facets {
            points,
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            normals: Vec::new(),
        }
    }

    #[test]
    fn every_corner_is_found_again() {
        let tent = tent();
        for &corner in &tent.points {
            let [u, v] = tent.nearest(corner);
            assert!(
                distance(tent.derivatives(u, v).0, corner) < 1e-12,
                "{corner:?}"
            );
        }
        assert!(
            (tent.area() - 2.0 - 6_f64.sqrt()).abs() < 1e-12,
            "{}",
            tent.area()
        );
    }

    proptest! {
        #[test]
        fn no_point_is_nearer_than_the_nearest(p in prop::array::uniform3(-3.0_f64..5.0), s in 0.0_f64..1.0, t in 0.0_f64..1.0) {
            let tent = tent();
            let [u, v] = tent.nearest(p);
            let found = distance(tent.derivatives(u, v).0, p);
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            for triangle in [0.0, 2.0] {
                prop_assert!(found <= distance(tent.derivatives(triangle + s, t).0, p) + 1e-9);
            }
        }
    }
}
