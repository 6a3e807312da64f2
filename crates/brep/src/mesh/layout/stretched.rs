//! Lays out a face whose boundaries all close in the parameter plane: the chart stretches the parameters.

use super::Layout;
use super::loops::{bounds_of, encloses, extent_of, shift, signed_area};
use crate::geometry::Surface;
use crate::mesh::aligned_grid::aligned_steps;
use crate::mesh::chart::Chart;
use crate::mesh::edge_points::Tolerance;
use crate::mesh::error::FaceMeshError;
use crate::mesh::poles::closes;
use crate::mesh::steps::{Bounds, steps};
use crate::mesh::unwrap::{UvLoop, UvPoint, free_parameter};

/// The chart of a face whose boundaries all close in the parameter plane.
pub(super) fn stretched(
    surface: &Surface,
    mut loops: Vec<UvLoop>,
    inner: Option<[f64; 2]>,
    tolerance: Tolerance,
    size: f64,
) -> Result<Layout, FaceMeshError> {
    let period = surface.period();
    if period.iter().any(Option::is_some) {
        let areas: Vec<f64> = loops
            .iter()
            .map(|bound| signed_area(&bound.corners))
            .collect();
        // If the surface has a border, a face cannot be the whole surface except for some holes. Then the sense of the boundary
        // is wrong.
        let is_patch = areas.iter().any(|&area| area > 0.0)
            || ![0, 1].iter().all(|&axis| closes(surface, axis, size));
        if is_patch {
            move_holes_inside(&mut loops, &areas, period);
        } else if let Some(frame) = cut_open_surface(surface, &mut loops) {
            loops.push(frame_loop(
                surface,
                frame,
                steps(surface, frame, tolerance),
                size,
            ));
        }
        // A sphere was rotated, so its poles may lie anywhere on a seam. The parameters at a pole do not say which side is
        // inside.
        let says_much = !matches!(surface, Surface::Sphere { .. });
        if says_much && inner.is_some_and(|inner| !contains_point(&loops, inner, period)) {
            return Err(FaceMeshError::SeamOutside);
        }
    }
    let mut bounds = bounds_of(&loops);
    for [low, high] in &mut bounds {
        // A boundary without width still needs a scale.
        *high = high.max(*low + 1e-12 * (1.0 + low.abs()));
    }
    let steps = aligned_steps(surface, &loops, bounds, steps(surface, bounds, tolerance));
    let spans = bounds.map(|[low, high]| high - low);
    let scale = match surface {
        Surface::Plane(_) => [1.0 / spans[0].max(spans[1]); 2],
        _ => [steps[0] as f64 / spans[0], steps[1] as f64 / spans[1]],
    };
    let chart = Chart::Stretched {
        origin: [bounds[0][0], bounds[1][0]],
        scale,
    };
    Ok(Layout {
        chart,
        loops,
        bounds,
        steps,
        pole: None,
    })
}

/// Moves each hole by whole periods into an outer boundary. The holes were unwrapped independently.
///
/// Some files write holes with the sense of an outer boundary, and outer boundaries with the sense of a hole. So the largest loop
/// counts as an outer one with any sense, and any smaller loop that fits inside it is a hole.
fn move_holes_inside(loops: &mut [UvLoop], areas: &[f64], period: [Option<f64>; 2]) {
    if loops.len() < 2 {
        return;
    }
    let largest = areas
        .iter()
        .fold(0.0, |largest: f64, area| largest.max(area.abs()));
    let is_outer = |area: f64| area > 0.0 || area.abs() == largest;
    let outer: Vec<(UvLoop, f64)> = loops
        .iter()
        .cloned()
        .zip(areas.iter().copied())
        .filter(|(_, a)| is_outer(*a))
        .collect();
    for (bound, area) in loops.iter_mut().zip(areas) {
        let holders = outer.iter().filter(|(_, around)| around.abs() > area.abs());
        let holders: Vec<&UvLoop> = holders.map(|(outer, _)| outer).collect();
        let by = best_offset(bound, &holders, period);
        shift(bound, 0, by[0]);
        shift(bound, 1, by[1]);
    }
}

/// The offset in whole periods that moves a loop into one of the others, or zero if no offset does.
fn best_offset(bound: &UvLoop, holders: &[&UvLoop], period: [Option<f64>; 2]) -> [f64; 2] {
    let reach = |period: Option<f64>| if period.is_some() { -2..=2 } else { 0..=0 };
    let probes = [
        bound.corners[0].uv,
        bound.corners[bound.corners.len() / 2].uv,
    ];
    let mut best = (0, [0.0; 2]);
    for i in reach(period[0]) {
        for j in reach(period[1]) {
            let offset = [
                f64::from(i) * period[0].unwrap_or(0.0),
                f64::from(j) * period[1].unwrap_or(0.0),
            ];
            let held = |outer: &&UvLoop| {
                probes
                    .iter()
                    .filter(|q| encloses(&outer.corners, [q[0] + offset[0], q[1] + offset[1]]))
                    .count()
            };
            let count = holders.iter().map(held).max().unwrap_or(0);
            if count > best.0 {
                best = (count, offset);
            }
        }
    }
    best.1
}

/// Whether a point, moved by whole periods, lies between the boundaries.
fn contains_point(loops: &[UvLoop], point: [f64; 2], period: [Option<f64>; 2]) -> bool {
    let reach = |period: Option<f64>| if period.is_some() { -2..=2 } else { 0..=0 };
    let shifted = |i: i32, axis: usize| point[axis] + f64::from(i) * period[axis].unwrap_or(0.0);
    let is_inside = |at: [f64; 2]| {
        loops
            .iter()
            .filter(|bound| encloses(&bound.corners, at))
            .count()
            % 2
            == 1
    };
    reach(period[0]).any(|i| reach(period[1]).any(|j| is_inside([shifted(i, 0), shifted(j, 1)])))
}

/// Cuts a closed surface open between its holes, and moves the holes by whole periods into the bounds that result. Returns `None`
/// if a direction has no bounds, or if no straight cut misses the holes.
fn cut_open_surface(surface: &Surface, loops: &mut [UvLoop]) -> Option<Bounds> {
    // A face is never a whole torus that meets itself. Then the sense of the boundary is wrong.
    if matches!(surface, Surface::Torus { .. }) && surface.period()[1].is_none() {
        return None;
    }
    let mut frame = [[0.0; 2]; 2];
    for (axis, ends) in frame.iter_mut().enumerate() {
        *ends = match (surface.period()[axis], surface.range()[axis]) {
            (Some(period), _) => {
                let start = free_cut(loops, axis, period)?;
                for bound in loops.iter_mut() {
                    let low = extent_of(bound, axis)[0];
                    shift(
                        bound,
                        axis,
                        (low - start).rem_euclid(period) - (low - start),
                    );
                }
                [start, start + period]
            }
            (None, Some((low, high))) if low.is_finite() && high.is_finite() => [low, high],
            _ => return None,
        };
    }
    Some(frame)
}

/// The parameter at which a closed direction is cut: the middle of the widest gap between the loops.
fn free_cut(loops: &[UvLoop], axis: usize, period: f64) -> Option<f64> {
    let base = extent_of(loops.first()?, axis)[0];
    let mut spans: Vec<[f64; 2]> = loops.iter().map(|bound| extent_of(bound, axis)).collect();
    for [low, high] in &mut spans {
        let by = (*low - base).rem_euclid(period) - (*low - base);
        (*low, *high) = (*low + by, *high + by);
    }
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // A loop that reaches beyond the end of the period also covers its beginning.
    let mut covered = spans
        .iter()
        .map(|span| span[1] - period)
        .fold(f64::NEG_INFINITY, f64::max)
        .max(base - period);
    let mut widest = (0.0, base);
    for [low, high] in spans.into_iter().chain([[base + period; 2]]) {
        if low - covered > widest.0 {
            widest = (low - covered, 0.5 * (covered + low));
        }
        covered = covered.max(high);
    }
    (widest.0 > 0.0).then_some(widest.1)
}

/// The outline of a rectangle of parameters. Opposite sides get equal points if they meet, and all points at a pole are equal.
fn frame_loop(surface: &Surface, [u, v]: Bounds, steps: [usize; 2], size: f64) -> UvLoop {
    let (n, m) = (steps[0].max(4), steps[1].max(4));
    let period = surface.period();
    let corner = |i: usize, j: usize| {
        let at = |range: [f64; 2], i: usize, n: usize| {
            range[0] + (range[1] - range[0]) * i as f64 / n as f64
        };
        let home = |i: usize, n: usize, axis: usize| if period[axis].is_some() { i % n } else { i };
        let mut from = [at(u, home(i, n, 0), n), at(v, home(j, m, 1), m)];
        let (mut point, du, dv) = surface.derivatives(from[0], from[1]);
        if let Some(axis) = free_parameter(surface, from, [du, dv], size) {
            from[axis] = [u[0], v[0]][axis];
            point = surface.point(from[0], from[1]);
        }
        UvPoint {
            uv: [at(u, i, n), at(v, j, m)],
            point,
            tangents: [du, dv],
            segment: None,
        }
    };
    let mut corners: Vec<UvPoint> = (0..n).map(|i| corner(i, 0)).collect();
    corners.extend((0..m).map(|j| corner(n, j)));
    corners.extend((1..=n).rev().map(|i| corner(i, m)));
    corners.extend((1..=m).rev().map(|j| corner(0, j)));
    UvLoop {
        corners,
        windings: [0, 0],
    }
}
