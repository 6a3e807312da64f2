//! Searches the nearest point of a surface with the damped Gauss–Newton method on both parameters.
//!
//! Each step solves the normal equations of the tangent plane (compare *The NURBS Book*, section 6.1). A step that increases the
//! distance is shortened. Parameters stay inside the bounds of the surface.

use super::types::Surface;
use partprobe_shape::{Point, cross, distance, dot, subtract};

/// The nearest point of a surface to a given point, and the distance between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Parameters of the nearest point.
    pub uv: [f64; 2],
    /// The distance of the nearest point.
    pub distance: f64,
    /// The nearest point.
    pub point: Point,
    /// ∂u and ∂v at the nearest point.
    pub tangents: [Point; 2],
}

/// The result of a search from a seed is accepted if its distance is below this fraction of the surface's size.
pub(super) const ON_SURFACE: f64 = 1e-6;

/// The search ends after a step that is smaller than this fraction of the parameters' extent.
const LAST_STEP: f64 = 1e-9;

pub(super) fn nearer(a: Projection, b: Projection) -> Projection {
    if b.distance < a.distance { b } else { a }
}

/// The point at given parameters, as a projection of `p`.
pub(super) fn foot(surface: &Surface, p: Point, uv: [f64; 2]) -> Projection {
    let (point, du, dv) = surface.derivatives(uv[0], uv[1]);
    Projection {
        uv,
        distance: distance(p, point),
        point,
        tangents: [du, dv],
    }
}

/// The damped Gauss–Newton method on both parameters, from a point of the surface.
pub(super) fn newton(surface: &Surface, p: Point, start: [f64; 2]) -> Projection {
    newton_from(surface, p, foot(surface, p, start))
}

/// The same from a point that is already evaluated. The parameters stay inside the surface's bounds.
pub(super) fn newton_from(surface: &Surface, p: Point, start: Projection) -> Projection {
    let (period, range, extent) = (surface.period(), surface.range(), surface.extent());
    let held = |x: f64, axis: usize| match (period[axis], range[axis]) {
        (None, Some((low, high))) => x.clamp(low, high),
        _ => x,
    };
    let moved = |uv: [f64; 2], step: [f64; 2], factor: f64| {
        [0, 1].map(|i| held(uv[i] + factor * step[i], i))
    };
    let mut best = start;
    if moved(best.uv, [0.0; 2], 0.0) != best.uv {
        best = foot(surface, p, moved(best.uv, [0.0; 2], 0.0));
    }
    for _ in 0..30 {
        let is_held = |axis: usize, step: f64| held(best.uv[axis] + step, axis) == best.uv[axis];
        let Some(step) = gauss_newton_step(best, p, is_held) else {
            break;
        };
        // Steps shrink quadratically. After such a small step nothing can be gained, so the surface is not evaluated again.
        if (0..2).all(|axis| step[axis].abs() <= LAST_STEP * extent[axis]) {
            best.uv = moved(best.uv, step, 1.0);
            break;
        }
        let shortened = [1.0, 0.25, 0.0625, 0.015_625, 0.003_9, 0.000_97];
        let mut tried = shortened
            .iter()
            .map(|&factor| foot(surface, p, moved(best.uv, step, factor)));
        let Some(better) = tried.find(|tried| tried.distance < best.distance) else {
            break;
        };
        best = better;
    }
    best
}

/// The least-squares step. A parameter that is held at its bound is left out.
fn gauss_newton_step(
    from: Projection,
    p: Point,
    is_held: impl Fn(usize, f64) -> bool,
) -> Option<[f64; 2]> {
    let (arm, [du, dv]) = (subtract(p, from.point), from.tangents);
    let (a, b, c) = (dot(du, du), dot(du, dv), dot(dv, dv));
    let (g, h) = (dot(du, arm), dot(dv, arm));
    let normal = cross(du, dv);
    let determinant = dot(normal, normal);
    let alone = if a >= c { [g / a, 0.0] } else { [0.0, h / c] };
    let step = if determinant > 1e-14 * a * c {
        let step = [(c * g - b * h) / determinant, (a * h - b * g) / determinant];
        if step[0] != 0.0 && is_held(0, step[0]) {
            [0.0, h / c]
        } else if step[1] != 0.0 && is_held(1, step[1]) {
            [g / a, 0.0]
        } else {
            step
        }
    } else {
        alone
    };
    step.iter().all(|x| x.is_finite()).then_some(step)
}
