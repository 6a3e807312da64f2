//! Computes the exact distance from a point to a triangle.

use partprobe_carrier::{Point, dot, subtract};

/// The squared distance from a point to the nearest point of a triangle, including its inside and its border.
///
/// It finds the region of the triangle's plane to which the point projects (Ericson, Real-Time Collision Detection, 2005,
/// §5.1.5). A triangle without an area is treated as a segment or a point.
pub(crate) fn squared_distance(point: Point, corners: [Point; 3]) -> f64 {
    let nearest = nearest_on_triangle(point, corners);
    let apart = subtract(point, nearest);
    dot(apart, apart)
}

/// The distance from a point to the nearest point of a triangle, including its inside and its border.
#[must_use]
pub fn distance_to_triangle(point: Point, corners: [Point; 3]) -> f64 {
    squared_distance(point, corners).sqrt()
}

fn nearest_on_triangle(point: Point, [a, b, c]: [Point; 3]) -> Point {
    let ab = subtract(b, a);
    let ac = subtract(c, a);
    let from_a = subtract(point, a);
    let d1 = dot(ab, from_a);
    let d2 = dot(ac, from_a);
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }

    let from_b = subtract(point, b);
    let d3 = dot(ab, from_b);
    let d4 = dot(ac, from_b);
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }

    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return along(a, ab, d1 / (d1 - d3));
    }

    let from_c = subtract(point, c);
    let d5 = dot(ab, from_c);
    let d6 = dot(ac, from_c);
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }

    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return along(a, ac, d2 / (d2 - d6));
    }

    let va = d3 * d6 - d5 * d4;
    let toward_c = d4 - d3;
    let toward_b = d5 - d6;
    if va <= 0.0 && toward_c >= 0.0 && toward_b >= 0.0 {
        return along(b, subtract(c, b), toward_c / (toward_c + toward_b));
    }

    let total = va + vb + vc;
    let on_ab = along(a, ab, vb / total);
    along(on_ab, ac, vc / total)
}

/// `start + fraction · direction`. A fraction of 0/0 comes from an edge without a length. Then the nearest point is its start.
fn along(start: Point, direction: Point, fraction: f64) -> Point {
    let fraction = if fraction.is_finite() { fraction } else { 0.0 };
    std::array::from_fn(|axis| start[axis] + fraction * direction[axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CORNERS: [Point; 3] = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]];

    #[track_caller]
    fn check(point: Point, corners: [Point; 3], expected: f64) {
        let found = squared_distance(point, corners);
        assert!((found - expected).abs() < 1e-12, "{point:?}: {found}");
    }

    #[test]
    fn each_region_has_its_own_nearest_point() {
        check([1.0, 1.0, 2.0], CORNERS, 4.0);
        check([-3.0, -4.0, 0.0], CORNERS, 25.0);
        check([6.0, -1.0, 0.0], CORNERS, 5.0);
        check([-1.0, 5.0, 0.0], CORNERS, 5.0);
        check([2.0, -2.0, 0.0], CORNERS, 4.0);
        check([-2.0, 1.0, 1.0], CORNERS, 5.0);
        // The hypotenuse is 3x + 4y = 12.
        check([4.0, 3.0, 0.0], CORNERS, 2.4 * 2.4);
    }

    #[test]
    fn triangles_without_area_are_segments_or_points() {
        let segment = [[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]];
        check([1.5, 2.0, 0.0], segment, 4.0);
        check([3.0, 0.0, 0.0], segment, 1.0);
        check([0.0, 3.0, 4.0], [[0.0; 3]; 3], 25.0);
    }

    proptest! {
        #[test]
        fn no_point_of_the_triangle_is_nearer(
            point in proptest::array::uniform3(-3.0..3.0f64),
            corners in proptest::array::uniform3(proptest::array::uniform3(-2.0..2.0f64)),
            (u, v) in (0.0..1.0f64, 0.0..1.0f64),
        ) {
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let inside: Point = std::array::from_fn(|axis| {
                let [a, b, c] = corners.map(|corner| corner[axis]);
                a + u * (b - a) + v * (c - a)
            });
            let apart = subtract(point, inside);
            let least = squared_distance(point, corners);
            prop_assert!(least <= dot(apart, apart) + 1e-9);
            // The nearest point belongs to the triangle, so its distance from the triangle is 0.
            let nearest = nearest_on_triangle(point, corners);
            prop_assert!(squared_distance(nearest, corners) < 1e-9);
        }
    }
}
