//! Divides the inside of a revolved face in the same steps as its boundary.
//!
//! The circles that bound a thin ring, for example a fillet around a shaft, are divided according to their own radii. One more
//! column inside than on the circles would tilt the triangles between them by the sag of the chords, which may be the whole
//! width of the ring.

use super::steps::Bounds;
use super::unwrap::UvLoop;
use crate::geometry::Surface;

/// The fraction of its extent by which a parameter may vary and still count as constant.
const MAX_VARIATION: f64 = 1e-6;
/// A boundary sets the steps inside only if it runs along at least this fraction of the face's extent.
const LONG: f64 = 0.5;
/// The boundary sets the steps if it is no more than this much finer or coarser.
const MAX_STEP_RATIO: f64 = 1.5;

/// The steps along u and v. Where the boundary runs along a parameter line of a revolved surface, the steps are those of the
/// boundary.
pub(super) fn aligned_steps(
    surface: &Surface,
    loops: &[UvLoop],
    bounds: Bounds,
    steps: [usize; 2],
) -> [usize; 2] {
    if !matches!(surface, Surface::Torus { .. } | Surface::Revolution { .. }) {
        return steps;
    }
    [0, 1].map(|axis| {
        let wanted = steps[axis] as f64;
        let is_near = |n: &f64| *n <= MAX_STEP_RATIO * wanted && wanted <= MAX_STEP_RATIO * n;
        let counts = loops
            .iter()
            .filter_map(|bound| steps_of(bound, axis, bounds));
        counts
            .filter(is_near)
            .reduce(f64::max)
            .map_or(steps[axis], |n| n as usize)
    })
}

/// The number of steps into which a boundary would divide the whole extent, computed from its longest run along the axis.
fn steps_of(bound: &UvLoop, axis: usize, bounds: Bounds) -> Option<f64> {
    let [span, across] = [axis, 1 - axis].map(|axis| bounds[axis][1] - bounds[axis][0]);
    let stays = |pair: [[f64; 2]; 2]| {
        (pair[1][1 - axis] - pair[0][1 - axis]).abs() <= MAX_VARIATION * across
    };
    let points: Vec<[f64; 2]> = bound.corners.iter().map(|corner| corner.uv).collect();
    let runs = points
        .chunk_by(|a, b| stays([*a, *b]))
        .filter(|run| run.len() > 1);
    let longest = runs.max_by_key(|run| run.len())?;
    let length = (longest[longest.len() - 1][axis] - longest[0][axis]).abs();
    (length >= LONG * span).then(|| ((longest.len() - 1) as f64 * span / length).round())
}
