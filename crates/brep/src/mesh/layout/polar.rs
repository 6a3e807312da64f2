//! Lays out a face with a boundary that winds around a periodic surface: the chart is polar and has no seam.
//!
//! Rings get a log-polar chart, which is conformal; discs around a pole get a plain polar one (see `chart`).

use super::Layout;
use super::loops::{bounds_of, extent_of, mean, shift};
use crate::geometry::Surface;
use crate::mesh::aligned_grid::aligned_steps;
use crate::mesh::chart::Chart;
use crate::mesh::edge_points::Tolerance;
use crate::mesh::error::FaceMeshError;
use crate::mesh::poles::poles;
use crate::mesh::steps::{Bounds, steps};
use crate::mesh::unwrap::UvLoop;
use std::f64::consts::TAU;

/// Longest step around a pole on the boundary of a ring, in periods. A longer chord would cut the ring.
const POLE_STEP: f64 = 1.0 / 24.0;

/// Largest natural logarithm of the ratio of a ring's outer radius to its inner radius.
const MOST_MAGNIFIED: f64 = 30.0;

/// Minimum number of rings between a pole and a rim that is not a circle around it, such as a cone cut by an oblique plane.
/// With fewer, a triangle that is straight in the chart can span much of a revolution and miss the dip in the rim.
const DENTED_RINGS: usize = 4;
/// Fewest steps around a pole or a ring.
const LEAST_AROUND: usize = 6;

/// The chart of a face with a boundary that winds around: a ring, or a disc around the pole on the left of the boundary.
pub(super) fn polar(
    surface: &Surface,
    mut loops: Vec<UvLoop>,
    around: usize,
    inner: Option<[f64; 2]>,
    tolerance: Tolerance,
    size: f64,
) -> Result<Layout, FaceMeshError> {
    let along = 1 - around;
    let period = surface.period()[around].ok_or(FaceMeshError::WindsAlongOpenDirection)?;
    let windings = windings_of(&loops, around)?;
    // Two boundaries that wind around have the face between them, even if one of them has the wrong sense.
    let is_ring = windings.len() == 2 || windings.iter().sum::<i32>() == 0;

    let pole = if is_ring {
        if let (Some(length), 2) = (surface.period()[along], windings.len()) {
            choose_band(&mut loops, around, [period, length], inner);
        }
        for bound in &mut loops {
            divide_steps_around_pole(bound, around, period);
        }
        None
    } else {
        Some(enclosed_pole(
            surface, &loops, &windings, around, inner, size,
        )?)
    };

    let bounds = polar_bounds(&loops, around, period, pole);
    let steps = polar_steps(surface, &loops, bounds, around, pole, tolerance);
    let chart = polar_chart(bounds, steps, around, period, pole);
    Ok(Layout {
        chart,
        loops,
        bounds,
        steps,
        pole,
    })
}

/// The windings of the loops that wind around. Each must wind at most once.
fn windings_of(loops: &[UvLoop], around: usize) -> Result<Vec<i32>, FaceMeshError> {
    let windings: Vec<i32> = loops
        .iter()
        .map(|bound| bound.windings[around])
        .filter(|&windings| windings != 0)
        .collect();
    if windings.iter().any(|windings| windings.abs() > 1) {
        return Err(FaceMeshError::WindsTwice);
    }
    Ok(windings)
}

/// The parameters of the pole that the only winding boundary encloses.
fn enclosed_pole(
    surface: &Surface,
    loops: &[UvLoop],
    windings: &[i32],
    around: usize,
    inner: Option<[f64; 2]>,
    size: f64,
) -> Result<[f64; 2], FaceMeshError> {
    let &[winding] = windings else {
        return Err(FaceMeshError::UnpairedWindings);
    };
    let along = 1 - around;
    // A seam that reaches the pole is on the side of the face, even if the boundary has the wrong sense.
    let rim = loops
        .iter()
        .find(|bound| bound.windings[around] != 0)
        .map(|bound| mean(bound, along));
    let by_seam = inner.zip(rim).map(|(inner, rim)| inner[along] > rim);
    let is_upward = by_seam.unwrap_or((winding > 0) == (around == 0));

    let mut pole = [0.0; 2];
    pole[along] = closing_end(surface, along, is_upward, size)?;
    Ok(pole)
}

/// The bounds of a face with a polar chart: one period around, and the range from the loops to the pole along the surface.
fn polar_bounds(loops: &[UvLoop], around: usize, period: f64, pole: Option<[f64; 2]>) -> Bounds {
    let along = 1 - around;
    let mut bounds = bounds_of(loops);
    bounds[around][1] = bounds[around][0] + period;
    if let Some(pole) = pole {
        let [low, high] = bounds[along];
        bounds[along] = [low.min(pole[along]), high.max(pole[along])];
    }
    bounds
}

fn polar_steps(
    surface: &Surface,
    loops: &[UvLoop],
    bounds: Bounds,
    around: usize,
    pole: Option<[f64; 2]>,
    tolerance: Tolerance,
) -> [usize; 2] {
    let along = 1 - around;
    let mut steps = aligned_steps(surface, loops, bounds, steps(surface, bounds, tolerance));
    steps[around] = steps[around].max(LEAST_AROUND);
    if pole.is_some() && loops.iter().any(|bound| rises(bound, along, bounds)) {
        steps[along] = steps[along].max(DENTED_RINGS);
    }
    steps
}

/// The chart is a disc around the pole, whose radius is proportional to the distance from the pole, or a ring, whose radius is
/// the exponential of the parameter. The rates make the cells of the grid about as long as wide.
fn polar_chart(
    bounds: Bounds,
    steps: [usize; 2],
    around: usize,
    period: f64,
    pole: Option<[f64; 2]>,
) -> Chart {
    let along = 1 - around;
    let [low, high] = bounds[along];
    let cell = TAU / steps[around] as f64;
    let height = (high - low).max(f64::MIN_POSITIVE);
    let Some(pole) = pole else {
        return Chart::Polar {
            around,
            period,
            start: low,
            rate: (steps[along] as f64 * cell).min(MOST_MAGNIFIED) / height,
            hub: 1.0,
        };
    };
    let sign = if pole[along] >= high { -1.0 } else { 1.0 };
    Chart::Polar {
        around,
        period,
        start: pole[along],
        rate: sign * steps[along].max(2) as f64 * cell / height,
        hub: 0.0,
    }
}

/// Whether a rim comes nearer to the pole at some points than at others.
fn rises(rim: &UvLoop, along: usize, bounds: Bounds) -> bool {
    let [low, high] = extent_of(rim, along);
    rim.windings[1 - along] != 0 && high - low > 1e-3 * (bounds[along][1] - bounds[along][0])
}

/// At a pole, the point of a boundary stays the same while its parameter changes. Adds corners between the two parameters.
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

/// The parameter at which the surface closes on the left of the only winding boundary. A cone or a dome closes at one end only,
/// so that end is taken even if the sense of the boundary contradicts it.
fn closing_end(
    surface: &Surface,
    along: usize,
    upward: bool,
    size: f64,
) -> Result<f64, FaceMeshError> {
    let in_order = |[low, high]: [Option<f64>; 2]| if upward { high.or(low) } else { low.or(high) };
    // An end that nearly closes is better than no end.
    let ends = || {
        surface.range()[along]
            .map(|(low, high)| [low, high].map(|end| Some(end).filter(|end| end.is_finite())))
    };
    let end = in_order(poles(surface, along, size)).or_else(|| in_order(ends()?));
    end.ok_or(FaceMeshError::WindsOnOpenSurface)
}

/// Two boundaries divide a torus into two bands. The band that holds `inner` is chosen, or else the band on the left of both. (In
/// some files the senses of the boundaries give the wrong band, but a seam lies in the right one.) `periods` are those around and
/// along the bands.
fn choose_band(
    loops: &mut [UvLoop],
    around: usize,
    [period, length]: [f64; 2],
    inner: Option<[f64; 2]>,
) {
    let along = 1 - around;
    let winding: Vec<usize> = (0..loops.len())
        .filter(|&i| loops[i].windings[around] != 0)
        .collect();
    let [first, second] = winding[..] else { return };
    // If both run in the same direction, the first one decides. It is the outer one.
    let (rising, falling) = if loops[first].windings[around] > 0 {
        (first, second)
    } else {
        (second, first)
    };

    let means = [rising, falling].map(|bound| mean(&loops[bound], along));
    let by = match inner {
        None => shift_of_falling(means, length, around == 0),
        Some(inner) => {
            // A boundary with a dent is on both sides of its mean, so both are compared where `inner` is.
            let [base, top] = [rising, falling].map(|bound| {
                crossing_at(&loops[bound], around, [period, length], inner)
                    .unwrap_or_else(|| mean(&loops[bound], along))
            });
            let is_upward = (inner[along] - base).rem_euclid(length) < rise_of(base, top, length);
            let by = shift_of_falling([base, top], length, is_upward);
            // Both are whole periods. Those from the means are rounded as for a face without a seam.
            let by_means = [true, false].map(|upward| shift_of_falling(means, length, upward));
            let is_same = |by_means: &f64| (by_means - by).abs() < 0.5 * length;
            by_means.into_iter().find(is_same).unwrap_or(by)
        }
    };
    shift(&mut loops[falling], along, by);

    let low = mean(&loops[rising], along).min(mean(&loops[falling], along));
    for bound in loops.iter_mut().filter(|bound| bound.windings[around] == 0) {
        let middle = mean(bound, along);
        shift(
            bound,
            along,
            low + (middle - low).rem_euclid(length) - middle,
        );
    }
}

/// How far a band reaches upward from its rising boundary to the falling one: more than 0, and at most a period.
fn rise_of(base: f64, top: f64, length: f64) -> f64 {
    let rise = (top - base).rem_euclid(length);
    if rise == 0.0 { length } else { rise }
}

/// The shift of the falling boundary of a band, by the positions of both boundaries: to the next place above the rising one, or
/// below it.
fn shift_of_falling([base, top]: [f64; 2], length: f64, is_upward: bool) -> f64 {
    let rise = rise_of(base, top, length);
    let gap = if is_upward || rise == length {
        rise
    } else {
        rise - length
    };
    base + gap - top
}

/// Where a boundary that winds around passes a point: its parameter along the band at the point's parameter around it. Of several
/// such places, it is the one nearest to the point.
fn crossing_at(
    bound: &UvLoop,
    around: usize,
    [period, length]: [f64; 2],
    point: [f64; 2],
) -> Option<f64> {
    let along = 1 - around;
    let turn = f64::from(bound.windings[around]) * period;
    let corners = bound.corners.iter().map(|corner| corner.uv);
    let end = bound.corners.first().map(|first| {
        let mut end = first.uv;
        end[around] += turn;
        end
    });
    let distance = |crossing: f64| {
        let apart = (crossing - point[along]).rem_euclid(length);
        apart.min(length - apart)
    };
    let crossings = corners
        .clone()
        .zip(corners.skip(1).chain(end))
        .filter_map(|(a, b)| {
            let (low, high) = (a[around].min(b[around]), a[around].max(b[around]));
            let at = low + (point[around] - low).rem_euclid(period);
            let fraction = (at - a[around]) / (b[around] - a[around]);
            (at < high).then(|| a[along] + fraction * (b[along] - a[along]))
        });
    crossings.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}
