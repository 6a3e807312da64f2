//! Estimates the normals of points that have none.
//!
//! Points go in, and one unit normal per point comes out: the direction in which its nearest points spread least. Signs are
//! chosen so that neighbors agree (Hoppe et al., "Surface reconstruction from unorganized points", 1992), and so that the normal
//! of the outermost point of each connected piece points outward.

use crate::eigen::least_direction;
use crate::nearest_points::nearest_points;
use partprobe_shape::{Point, dot, norm, subtract};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The number of nearest points from which a normal is estimated.
pub(crate) const N_NEIGHBORS: usize = 16;

/// One unit normal per point. Coordinates must be finite.
#[must_use]
pub fn estimated_normals(points: &[Point]) -> Vec<[f32; 3]> {
    let neighbors = nearest_points(points, N_NEIGHBORS);
    let mut normals: Vec<Point> = neighbors
        .iter()
        .zip(points)
        .map(|(around, &own)| normal_of(points, own, around))
        .collect();
    orient(points, &mutual(&neighbors), &mut normals);
    normals
        .into_iter()
        .map(|normal| normal.map(|x| x as f32))
        .collect()
}

/// The direction in which a point and its neighbors spread least.
fn normal_of(points: &[Point], own: Point, around: &[u32]) -> Point {
    let all = || {
        around
            .iter()
            .map(|&other| points[other as usize])
            .chain([own])
    };
    let n = (around.len() + 1) as f64;
    let sum = all().fold([0.0; 3], |sum: Point, point| {
        [0, 1, 2].map(|axis| sum[axis] + point[axis])
    });
    let center = sum.map(|x| x / n);
    let mut spread = [[0.0; 3]; 3];
    for point in all() {
        let offset = subtract(point, center);
        for (row, &x) in spread.iter_mut().zip(&offset) {
            *row = [0, 1, 2].map(|axis| row[axis] + x * offset[axis]);
        }
    }
    least_direction(spread)
}

/// The neighbors in both directions, so that each point is a neighbor of its neighbors.
fn mutual(neighbors: &[Vec<u32>]) -> Vec<Vec<u32>> {
    let mut both = neighbors.to_vec();
    for (own, around) in (0u32..).zip(neighbors) {
        for &other in around {
            both[other as usize].push(own);
        }
    }
    both
}

/// Chooses the signs along a tree of neighbors that are most nearly parallel.
fn orient(points: &[Point], neighbors: &[Vec<u32>], normals: &mut [Point]) {
    let n = points.len().max(1) as f64;
    let sum = points.iter().fold([0.0; 3], |sum: Point, point| {
        [0, 1, 2].map(|axis| sum[axis] + point[axis])
    });
    let center = sum.map(|x| x / n);
    let mut outermost: Vec<usize> = (0..points.len()).collect();
    outermost.sort_by(|&a, &b| {
        let [a, b] = [a, b].map(|point| norm(subtract(points[point], center)));
        b.total_cmp(&a)
    });

    let mut is_done = vec![false; points.len()];
    for root in outermost {
        if is_done[root] {
            continue;
        }
        let outward = subtract(points[root], center);
        align(&mut normals[root], outward);
        let mut open = BinaryHeap::from([Reverse((0u64, root as u32, root as u32))]);
        while let Some(Reverse((_, point, from))) = open.pop() {
            if std::mem::replace(&mut is_done[point as usize], true) {
                continue;
            }
            let of_parent = normals[from as usize];
            align(&mut normals[point as usize], of_parent);
            let own = normals[point as usize];
            for &other in neighbors[point as usize]
                .iter()
                .filter(|&&other| !is_done[other as usize])
            {
                // The number is not negative, so its bits have the same order as the number.
                let bend = (1.0 - dot(own, normals[other as usize]).abs()).max(0.0);
                open.push(Reverse((bend.to_bits(), other, point)));
            }
        }
    }
}

/// Reverses a vector that points away from the direction.
fn align(vector: &mut Point, direction: Point) {
    if dot(*vector, direction) < 0.0 {
        *vector = vector.map(|x| -x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a sphere, evenly spread along a spiral.
    fn sphere(n: u32, center: Point) -> Vec<Point> {
        let on_sphere = |idx: u32| {
            let z: f64 = 1.0 - 2.0 * (f64::from(idx) + 0.5) / f64::from(n);
            let (sin, cos) = (f64::from(idx) * 2.399_963).sin_cos();
            let radius = (1.0 - z * z).sqrt();
            [
                center[0] + radius * cos,
                center[1] + radius * sin,
                center[2] + z,
            ]
        };
        (0..n).map(on_sphere).collect()
    }

    #[test]
    fn normals_of_a_sphere_look_outward() {
        let points = sphere(500, [3.0, -2.0, 9.0]);
        for (point, normal) in points.iter().zip(estimated_normals(&points)) {
            let outward = subtract(*point, [3.0, -2.0, 9.0]);
            assert!(
                dot(outward, normal.map(f64::from)) > 0.95,
                "{point:?} {normal:?}"
            );
        }
    }

    #[test]
    fn points_without_a_surface_have_a_unit_normal_too() {
        let line: Vec<Point> = (0..5).map(|x| [f64::from(x), 0.0, 0.0]).collect();
        for points in [vec![], vec![[1.0; 3]], vec![[1.0; 3]; 40], line] {
            for normal in estimated_normals(&points) {
                let length = norm(normal.map(f64::from));
                assert!((length - 1.0).abs() < 1e-6, "{normal:?}");
            }
        }
    }
}
