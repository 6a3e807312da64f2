//! Projects boundary polygons into the parameter plane, so that (u, v) is continuous along them, and counts their windings.

use super::boundary::{BoundaryPoint, Segment};
use super::off_surface::{FAR, OFF_SHAPE, off_bound};
use crate::geometry::{Projector, Surface};
use partprobe_shape::{Point, distance, norm};
use std::f64::consts::FRAC_PI_2;

/// Where along a parameter line it is asked whether it is a single point; its ends may meet without that.
const PROBES: [f64; 4] = [0.0, 0.31, 0.64, 1.0];

/// A corner of a boundary polygon in the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UvPoint {
    /// Parameters, unwrapped along the loop.
    pub(crate) uv: [f64; 2],
    /// The point in space.
    pub(crate) point: Point,
    /// ∂u and ∂v there; null at a pole, where one of them vanishes.
    pub(crate) tangents: [Point; 2],
    /// The piece of curve that leads to the next corner; none along a pole.
    pub(crate) segment: Option<Segment>,
}

/// A boundary polygon in the parameter plane.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UvLoop {
    /// Corners in walking order.
    pub(crate) corners: Vec<UvPoint>,
    /// How many periods of u and of v the walk ends away from its beginning.
    pub(crate) windings: [i32; 2],
}

impl UvLoop {
    /// Whether the walk turns while it stays at a pole.
    pub(crate) fn goes_around_pole(&self) -> bool {
        let next = self.corners.iter().cycle().skip(1);
        let mut stays = self
            .corners
            .iter()
            .zip(next)
            .filter(|(corner, _)| corner.segment.is_none());
        stays.any(|(entry, exit)| entry.point == exit.point && entry.uv != exit.uv)
    }
}

/// What became of corners that lie beside their surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Off {
    /// They stay where they are.
    Kept,
    /// Those that are farthest away were moved onto the surface.
    Moved,
}

/// What unwrapping a polygon gives.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnwrappedLoop {
    /// The polygon in the parameter plane.
    pub(crate) bound: UvLoop,
    /// What became of corners that lie too far beside the surface, if there are any.
    pub(crate) off_surface: Option<Off>,
}

/// A projected corner, before unwrapping.
#[derive(Clone, Copy)]
struct Raw {
    uv: [f64; 2],
    tangents: [Point; 2],
    /// The parameter that says nothing here: u at a sphere's pole.
    free: Option<usize>,
    corner: BoundaryPoint,
}

/// A walk's stay at a pole: where it came in, and the piece of curve by which it leaves.
#[derive(Clone, Copy)]
struct PoleVisit {
    entry: UvPoint,
    axis: usize,
    segment: Segment,
}

/// Projects a polygon to the surface and unwraps its parameters.
///
/// Returns `None` if every corner lies at a pole. `size` is the diagonal of the shape. Corners that lie far beside the surface are
/// moved onto it, in the polygon as well.
pub(crate) fn unwrap_loop(
    projector: &Projector<'_>,
    surface: &Surface,
    polygon: &mut [BoundaryPoint],
    size: f64,
) -> Option<UnwrappedLoop> {
    let (mut raw, off_surface) = projected(projector, surface, polygon, size);
    let first = raw.iter().position(|corner| corner.free.is_none())?;
    raw.rotate_left(first);
    let mut walk = Walk {
        surface,
        period: surface.period(),
        size,
        corners: Vec::with_capacity(raw.len() + 2),
        previous: raw[0].uv,
        visit: None,
    };
    for corner in raw.iter().chain(&raw[..1]) {
        walk.go_to(corner);
    }
    Some(UnwrappedLoop {
        bound: walk.closed()?,
        off_surface,
    })
}

/// A walk along a polygon in the parameter plane, up to some corner.
struct Walk<'a> {
    surface: &'a Surface,
    period: [Option<f64>; 2],
    /// The diagonal of the shape.
    size: f64,
    corners: Vec<UvPoint>,
    /// Where the walk was last outside of a pole.
    previous: [f64; 2],
    /// The pole at which it stays.
    visit: Option<PoleVisit>,
}

impl Walk<'_> {
    fn go_to(&mut self, raw: &Raw) {
        let here = [0, 1].map(|axis| near(raw.uv[axis], self.previous[axis], self.period[axis]));
        if let Some(axis) = raw.free {
            self.stay_at_pole(raw.corner, here, axis);
            return;
        }
        let here = match self.visit.take() {
            Some(visit) => self.leave_pole(visit, here),
            None => here,
        };
        self.corners.push(UvPoint {
            uv: here,
            point: raw.corner.point,
            tangents: raw.tangents,
            segment: Some(raw.corner.segment),
        });
        self.previous = here;
    }

    /// Enters a pole on the meridian by which the walk came, or stays there. All values of `axis` are one point.
    fn stay_at_pole(&mut self, corner: BoundaryPoint, mut here: [f64; 2], axis: usize) {
        here[axis] = self.previous[axis];
        here[1 - axis] = nearer_end(self.surface, here, self.previous, axis, self.size);
        let entry = match self.visit {
            Some(visit) => visit.entry,
            None => {
                let pole = UvPoint {
                    uv: here,
                    point: corner.point,
                    tangents: [[0.0; 3]; 2],
                    segment: None,
                };
                self.corners.push(pole);
                pole
            }
        };
        self.visit = Some(PoleVisit {
            entry,
            axis,
            segment: corner.segment,
        });
    }

    /// Leaves a pole on the meridian on which the walk continues; the piece of curve begins there. Returns the next corner.
    fn leave_pole(&mut self, visit: PoleVisit, here: [f64; 2]) -> [f64; 2] {
        let PoleVisit {
            entry,
            axis,
            segment,
        } = visit;
        let here = after_pole(entry.uv, here, axis, self.period[axis]);
        let mut exit = UvPoint {
            segment: Some(segment),
            ..entry
        };
        exit.uv[axis] = here[axis];
        self.corners.push(exit);
        here
    }

    /// The loop of a walk that is back at its first corner.
    fn closed(mut self) -> Option<UvLoop> {
        let end = self.corners.pop()?.uv;
        let start = self.corners.first()?.uv;
        let windings = [0, 1].map(|axis| {
            self.period[axis].map_or(0, |p| ((end[axis] - start[axis]) / p).round() as i32)
        });
        Some(UvLoop {
            corners: self.corners,
            windings,
        })
    }
}

fn projected(
    projector: &Projector<'_>,
    surface: &Surface,
    polygon: &mut [BoundaryPoint],
    size: f64,
) -> (Vec<Raw>, Option<Off>) {
    let mut seed = None;
    let (mut off, mut off_surface) = (None, None);
    let mut raw = Vec::with_capacity(polygon.len());
    for i in 0..polygon.len() {
        let point = polygon[i].point;
        let mut found = projector.project_beside(point, seed);
        if found.distance > OFF_SHAPE * size {
            // The search beside a neighbor may have ended in the wrong position.
            let anywhere = projector.project(point, None);
            found = if anywhere.distance < found.distance {
                anywhere
            } else {
                found
            };
            if found.distance
                > *off.get_or_insert_with(|| {
                    off_bound(polygon.iter().map(|corner| corner.point), size)
                })
            {
                off_surface = off_surface.max(Some(if found.distance > FAR * size {
                    Off::Moved
                } else {
                    Off::Kept
                }));
                if off_surface == Some(Off::Moved) {
                    polygon[i].point = found.point;
                }
            }
        }
        let free = free_parameter(surface, found.uv, found.tangents, size);
        if free.is_none() {
            seed = Some(found);
        }
        raw.push(Raw {
            uv: found.uv,
            tangents: found.tangents,
            free,
            corner: polygon[i],
        });
    }
    (raw, off_surface)
}

/// The parameter that all values of give the same point at `uv`, if there is one; `du` and `dv` are the tangents there.
pub(crate) fn free_parameter(
    surface: &Surface,
    uv: [f64; 2],
    [du, dv]: [Point; 2],
    size: f64,
) -> Option<usize> {
    let v = uv[1];
    let vanishes = |reach: f64| (reach.abs() < 1e-7 * size).then_some(0);
    match surface {
        Surface::Plane(_)
        | Surface::Cylinder { .. }
        | Surface::Extrusion { .. }
        | Surface::Facets(_) => None,
        Surface::Cone { radius, slope, .. } => vanishes(radius + v * slope),
        Surface::Sphere { .. } => (FRAC_PI_2 - v.abs() < 1e-7).then_some(0),
        Surface::Torus { major, minor, .. } => vanishes(major + minor * libm::cos(v)),
        Surface::Bspline(_)
        | Surface::Revolution { .. }
        | Surface::Offset { .. }
        | Surface::Composite(_) => {
            let extent = surface.extent();
            let (reach_u, reach_v) = (norm(du) * extent[0], norm(dv) * extent[1]);
            let vanishing = if reach_u < 1e-6 * size && reach_u < 1e-4 * reach_v {
                0
            } else if reach_v < 1e-6 * size && reach_v < 1e-4 * reach_u {
                1
            } else {
                return None;
            };
            is_one_point(surface, uv, vanishing, size).then_some(vanishing)
        }
    }
}

/// Whether all values of a parameter give one point. Where poles of a spline coincide its tangent vanishes, and the surface
/// goes on all the same.
fn is_one_point(surface: &Surface, uv: [f64; 2], axis: usize, size: f64) -> bool {
    let Some((low, high)) = surface.range()[axis].filter(|(low, high)| (high - low).is_finite())
    else {
        return true;
    };
    let at = |x: f64| {
        if axis == 0 {
            surface.point(x, uv[1])
        } else {
            surface.point(uv[0], x)
        }
    };
    let here = at(uv[axis]);
    PROBES
        .iter()
        .all(|fraction| distance(at(low + fraction * (high - low)), here) <= 1e-6 * size)
}

/// The other parameter of a pole: exactly the end of its range that lies there, so that all visits are one point of the
/// chart. Where both ends are one point, as on a horn torus, it is the end that the walk came along.
fn nearer_end(
    surface: &Surface,
    pole: [f64; 2],
    previous: [f64; 2],
    free: usize,
    size: f64,
) -> f64 {
    let other = 1 - free;
    let Some((low, high)) = surface.range()[other] else {
        return pole[other];
    };
    let point = |end: f64| {
        if free == 0 {
            surface.point(pole[0], end)
        } else {
            surface.point(end, pole[1])
        }
    };
    let meet = |one: f64, another: f64| distance(point(one), point(another)) <= 1e-6 * size;
    if (high - low).is_finite() && meet(low, high) {
        return if previous[other] - low < high - previous[other] {
            low
        } else {
            high
        };
    }
    let ends = [low, high].into_iter().filter(|end| end.is_finite());
    let nearest = ends.min_by(|a, b| (a - pole[other]).abs().total_cmp(&(b - pole[other]).abs()));
    nearest
        .filter(|&end| meet(end, pole[other]))
        .unwrap_or(pole[other])
}

/// `x` moved by whole periods to the neighborhood of `anchor`.
pub(crate) fn near(x: f64, anchor: f64, period: Option<f64>) -> f64 {
    period.map_or(x, |period| x + ((anchor - x) / period).round() * period)
}

/// The direction of the walk tells by which way round it turns at the pole: the face lies on its left.
fn after_pole(entry: [f64; 2], exit: [f64; 2], axis: usize, period: Option<f64>) -> [f64; 2] {
    let Some(period) = period else { return exit };
    let other = 1 - axis;
    let grows = (exit[other] > entry[other]) == (axis == 0);
    let mut left_at = near(exit[axis], entry[axis], Some(period));
    if (left_at - entry[axis]).abs() > 1e-6 * period {
        if grows && left_at < entry[axis] {
            left_at += period;
        } else if !grows && left_at > entry[axis] {
            left_at -= period;
        }
    }
    let mut exit = exit;
    exit[axis] = left_at;
    exit
}
