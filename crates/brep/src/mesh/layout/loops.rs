//! Measures and moves loops of the parameter plane.

use crate::mesh::steps::Bounds;
use crate::mesh::unwrap::{UvLoop, UvPoint};

pub(super) fn extent_of(bound: &UvLoop, axis: usize) -> [f64; 2] {
    bounds_of(std::slice::from_ref(bound))[axis]
}

pub(super) fn bounds_of(loops: &[UvLoop]) -> Bounds {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for corner in loops.iter().flat_map(|bound| &bound.corners) {
        for (ends, x) in bounds.iter_mut().zip(corner.uv) {
            *ends = [ends[0].min(x), ends[1].max(x)];
        }
    }
    bounds
}

pub(super) fn mean(bound: &UvLoop, axis: usize) -> f64 {
    bound
        .corners
        .iter()
        .map(|corner| corner.uv[axis])
        .sum::<f64>()
        / bound.corners.len() as f64
}

pub(super) fn shift(bound: &mut UvLoop, axis: usize, by: f64) {
    for corner in &mut bound.corners {
        corner.uv[axis] += by;
    }
}

pub(super) fn signed_area(corners: &[UvPoint]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(next)
        .map(|(a, b)| 0.5 * (a.uv[0] * b.uv[1] - a.uv[1] * b.uv[0]))
        .sum()
}

/// Whether a polygon of the parameter plane encloses a point, by the even–odd rule.
pub(super) fn encloses(corners: &[UvPoint], [u, v]: [f64; 2]) -> bool {
    let next = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(next)
        .filter(|(a, b)| is_crossed(a.uv, b.uv, [u, v]))
        .count()
        % 2
        == 1
}

/// Whether the ray from `p` along the first axis crosses the side from `a` to `b`.
pub(crate) fn is_crossed(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> bool {
    (a[1] > p[1]) != (b[1] > p[1]) && p[0] < (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) + a[0]
}
