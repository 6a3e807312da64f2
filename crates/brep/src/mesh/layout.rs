//! How a face lies in the plane of its triangulation: unwrapped loops in, a chart and loops that fit it out.

use super::aligned_grid::aligned_steps;
use super::chart::Chart;
use super::edge_points::Tolerance;
use super::error::FaceMeshError;
use super::poles::{closes, poles};
use super::steps::{Bounds, steps};
use super::unwrap::{UvLoop, UvPoint, free_parameter};
use crate::geometry::Surface;
use std::f64::consts::TAU;

/// The longest step of a turn at a pole in a ring, in periods: a chord there would cut the ring.
const POLE_STEP: f64 = 1.0 / 24.0;
/// Natural logarithm of a ring's outer radius over its inner one.
const MOST_MAGNIFIED: f64 = 30.0;

/// Rings between a pole and a rim that is no circle about it, a cone that a plane cuts: straight across the plane of the
/// triangulation a triangle could reach round a good part of the turn, past the dent.
const DENTED_RINGS: usize = 4;

/// Everything that the triangulation of a face needs to know.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// The map to the plane.
    pub(crate) chart: Chart,
    /// Boundaries that the chart maps to simple polygons.
    pub(crate) loops: Vec<UvLoop>,
    /// The rectangle of parameters that they cover.
    pub(crate) bounds: Bounds,
    /// Steps along u and v that the surface needs.
    pub(crate) steps: [usize; 2],
    /// A point inside the face where the boundary's turn closes: an apex, a pole.
    pub(crate) pole: Option<[f64; 2]>,
}

/// Chooses the chart by the windings of the loops; `inner` are parameters that lie inside the face, if known,
/// and `size` is the diagonal of the shape.
pub(crate) fn layout(
    surface: &Surface,
    loops: Vec<UvLoop>,
    inner: Option<[f64; 2]>,
    tolerance: Tolerance,
    size: f64,
) -> Result<Layout, FaceMeshError> {
    let winds = [0, 1].map(|axis| loops.iter().any(|bound| bound.windings[axis] != 0));
    let around = match winds {
        [false, false] => return stretched(surface, loops, inner, tolerance, size),
        [true, true] => return Err(FaceMeshError::WindsBothWays),
        [first, _] => usize::from(!first),
    };
    polar(surface, loops.clone(), around, inner, tolerance, size).or_else(|error| {
        match loops.as_slice() {
            [_] => stretched(
                surface,
                loops.iter().map(|bound| cut_open(surface, bound)).collect(),
                None,
                tolerance,
                size,
            ),
            _ => Err(error),
        }
    })
}

/// A boundary that winds where nothing closes it (the turn of a thread): it ends where it began, some periods
/// further, and is closed straight across the parameter plane.
fn cut_open(surface: &Surface, bound: &UvLoop) -> UvLoop {
    let mut corners = bound.corners.clone();
    let period = surface.period().map(Option::unwrap_or_default);
    corners.extend(bound.corners.first().map(|first| UvPoint {
        uv: [0, 1].map(|axis| first.uv[axis] + f64::from(bound.windings[axis]) * period[axis]),
        segment: None,
        ..*first
    }));
    UvLoop {
        corners,
        windings: [0, 0],
    }
}

/// The chart of a face whose boundary goes round: a ring, or a disc about the pole on the boundary's left.
fn polar(
    surface: &Surface,
    mut loops: Vec<UvLoop>,
    around: usize,
    inner: Option<[f64; 2]>,
    tolerance: Tolerance,
    size: f64,
) -> Result<Layout, FaceMeshError> {
    let along = 1 - around;
    let period = surface.period()[around].ok_or(FaceMeshError::WindsAlongOpenDirection)?;
    let windings: Vec<i32> = loops
        .iter()
        .map(|bound| bound.windings[around])
        .filter(|&windings| windings != 0)
        .collect();
    if windings.iter().any(|windings| windings.abs() > 1) {
        return Err(FaceMeshError::WindsTwice);
    }
    // Two boundaries that go round have the face between them, even where one of them is written the wrong way.
    let sum: i32 = if windings.len() == 2 {
        0
    } else {
        windings.iter().sum()
    };
    let mut pole = None;
    if sum != 0 {
        if windings.len() != 1 {
            return Err(FaceMeshError::UnpairedWindings);
        }
        // A seam that reaches the pole lies on the side that is meant, whatever the boundary's sense.
        let rim = loops
            .iter()
            .find(|bound| bound.windings[around] != 0)
            .map(|bound| mean(bound, along));
        let by_seam = inner.zip(rim).map(|(inner, rim)| inner[along] > rim);
        let end = closing_end(
            surface,
            along,
            by_seam.unwrap_or((sum > 0) == (around == 0)),
            size,
        )?;
        let mut at = [0.0; 2];
        at[along] = end;
        pole = Some(at);
    } else if let (Some(length), 2) = (surface.period()[along], windings.len()) {
        choose_band(&mut loops, around, length, inner.map(|uv| uv[along]));
    }
    if pole.is_none() {
        loops
            .iter_mut()
            .for_each(|bound| divide_steps_around_pole(bound, around, period));
    }
    let mut bounds = bounds_of(&loops);
    bounds[around][1] = bounds[around][0] + period;
    if let Some(pole) = pole {
        bounds[along] = [
            bounds[along][0].min(pole[along]),
            bounds[along][1].max(pole[along]),
        ];
    }
    let mut steps = aligned_steps(surface, &loops, bounds, steps(surface, bounds, tolerance));
    steps[around] = steps[around].max(6);
    if pole.is_some() && loops.iter().any(|bound| rises(bound, along, bounds)) {
        steps[along] = steps[along].max(DENTED_RINGS);
    }
    let cell = TAU / steps[around] as f64;
    let height = (bounds[along][1] - bounds[along][0]).max(f64::MIN_POSITIVE);
    let chart = match pole {
        Some(pole) => {
            let sign = if pole[along] >= bounds[along][1] {
                -1.0
            } else {
                1.0
            };
            let rate = sign * steps[along].max(2) as f64 * cell / height;
            Chart::Polar {
                around,
                period,
                start: pole[along],
                rate,
                hub: 0.0,
            }
        }
        None => {
            let rate = (steps[along] as f64 * cell).min(MOST_MAGNIFIED) / height;
            Chart::Polar {
                around,
                period,
                start: bounds[along][0],
                rate,
                hub: 1.0,
            }
        }
    };
    Ok(Layout {
        chart,
        loops,
        bounds,
        steps,
        pole,
    })
}

/// Whether a rim comes nearer to the pole at some points than at others.
fn rises(rim: &UvLoop, along: usize, bounds: Bounds) -> bool {
    let [low, high] = extent_of(rim, along);
    rim.windings[1 - along] != 0 && high - low > 1e-3 * (bounds[along][1] - bounds[along][0])
}

/// At a pole the point of a boundary stays while its parameter runs. Adds corners between the two parameters.
fn divide_steps_around_pole(bound: &mut UvLoop, around: usize, period: f64) {
    let mut corners = Vec::with_capacity(bound.corners.len());
    for (i, &corner) in bound.corners.iter().enumerate() {
        corners.push(corner);
        let Some(next) = bound
            .corners
            .get(i + 1)
            .filter(|_| corner.segment.is_none())
        else {
            continue;
        };
        let turn = next.uv[around] - corner.uv[around];
        let n = (turn.abs() / (POLE_STEP * period)).ceil();
        corners.extend((1..n as usize).map(|i| {
            let mut between = corner;
            between.uv[around] += turn * i as f64 / n;
            between
        }));
    }
    bound.corners = corners;
}

/// Where the surface closes on the left of the only winding boundary. A cone closes at one end only, whatever its boundary
/// says, and so does a dome.
fn closing_end(
    surface: &Surface,
    along: usize,
    upward: bool,
    size: f64,
) -> Result<f64, FaceMeshError> {
    let in_order = |[low, high]: [Option<f64>; 2]| if upward { high.or(low) } else { low.or(high) };
    // An end that nearly closes is better than none.
    let ends = || {
        surface.range()[along]
            .map(|(low, high)| [low, high].map(|end| Some(end).filter(|end| end.is_finite())))
    };
    let end = in_order(poles(surface, along, size)).or_else(|| in_order(ends()?));
    end.ok_or(FaceMeshError::WindsOnOpenSurface)
}

/// On a torus two boundaries bound two bands: the one that holds `inner` is meant, or else the one on the left
/// of both. (Files exist whose senses tell the wrong band, but a seam lies in the right one.)
fn choose_band(loops: &mut [UvLoop], around: usize, length: f64, inner: Option<f64>) {
    let along = 1 - around;
    let winding: Vec<usize> = (0..loops.len())
        .filter(|&i| loops[i].windings[around] != 0)
        .collect();
    let [first, second] = winding[..] else { return };
    // Where both run the same way, the first, which is the outer one, is believed.
    let (rising, falling) = if loops[first].windings[around] > 0 {
        (first, second)
    } else {
        (second, first)
    };
    let (base, top) = (mean(&loops[rising], along), mean(&loops[falling], along));
    let rise = (top - base).rem_euclid(length);
    let rise = if rise == 0.0 { length } else { rise };
    let is_upward = inner.map_or(around == 0, |inner| {
        (inner - base).rem_euclid(length) < rise
    });
    let gap = if is_upward || rise == length {
        rise
    } else {
        rise - length
    };
    shift(&mut loops[falling], along, base + gap - top);
    let low = base.min(base + gap);
    for bound in loops.iter_mut().filter(|bound| bound.windings[around] == 0) {
        let middle = mean(bound, along);
        shift(
            bound,
            along,
            low + (middle - low).rem_euclid(length) - middle,
        );
    }
}

/// The chart of a face whose boundaries all close in the parameter plane.
fn stretched(
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
        // Where the surface has a border, no face is all of it but for some holes: the boundary's sense is wrong.
        let is_patch = areas.iter().any(|&area| area > 0.0)
            || ![0, 1].iter().all(|&axis| closes(surface, axis, size));
        if is_patch {
            move_holes_inside(&mut loops, &areas, period);
        } else if let Some(frame) = whole_surface(surface, &mut loops) {
            loops.push(frame_loop(
                surface,
                frame,
                steps(surface, frame, tolerance),
                size,
            ));
        }
        // A sphere was rotated so that its poles, where parameters say little, may lie anywhere on a seam.
        let says_much = !matches!(surface, Surface::Sphere { .. });
        if says_much && inner.is_some_and(|inner| !holds(&loops, inner, period)) {
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

/// Holes were unwrapped on their own: each goes by whole periods to where an outer boundary holds it.
///
/// Files write holes with the sense of an outer boundary, and outer boundaries with that of a hole. So the largest loop is an
/// outer one whatever its sense, and any smaller one that fits inside it is a hole.
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

/// The whole periods by which a loop must go so that one of the others holds it; none if none does.
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
fn holds(loops: &[UvLoop], point: [f64; 2], period: [Option<f64>; 2]) -> bool {
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

/// The closed surface cut open between its holes, which go by whole periods to where the cuts leave them; nothing if a
/// direction has no bounds, or if no straight cut misses the holes.
fn whole_surface(surface: &Surface, loops: &mut [UvLoop]) -> Option<Bounds> {
    // A torus that meets itself is never whole: there the boundary's sense is wrong.
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

/// Where a closed direction is cut: in the middle of the widest gap between the loops.
fn free_cut(loops: &[UvLoop], axis: usize, period: f64) -> Option<f64> {
    let base = extent_of(loops.first()?, axis)[0];
    let mut spans: Vec<[f64; 2]> = loops.iter().map(|bound| extent_of(bound, axis)).collect();
    for [low, high] in &mut spans {
        let by = (*low - base).rem_euclid(period) - (*low - base);
        (*low, *high) = (*low + by, *high + by);
    }
    spans.sort_by(|a, b| a[0].total_cmp(&b[0]));
    // A loop that reaches over the base covers the beginning of the turn, too.
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

fn extent_of(bound: &UvLoop, axis: usize) -> [f64; 2] {
    bounds_of(std::slice::from_ref(bound))[axis]
}

/// The outline of a rectangle of parameters; opposite sides get equal points, and so does all of a pole.
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

fn bounds_of(loops: &[UvLoop]) -> Bounds {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
    for corner in loops.iter().flat_map(|bound| &bound.corners) {
        for (ends, x) in bounds.iter_mut().zip(corner.uv) {
            *ends = [ends[0].min(x), ends[1].max(x)];
        }
    }
    bounds
}

fn mean(bound: &UvLoop, axis: usize) -> f64 {
    bound
        .corners
        .iter()
        .map(|corner| corner.uv[axis])
        .sum::<f64>()
        / bound.corners.len() as f64
}

fn shift(bound: &mut UvLoop, axis: usize, by: f64) {
    for corner in &mut bound.corners {
        corner.uv[axis] += by;
    }
}

fn signed_area(corners: &[UvPoint]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    corners
        .iter()
        .zip(next)
        .map(|(a, b)| 0.5 * (a.uv[0] * b.uv[1] - a.uv[1] * b.uv[0]))
        .sum()
}

/// The even–odd rule in the parameter plane.
fn encloses(corners: &[UvPoint], [u, v]: [f64; 2]) -> bool {
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
