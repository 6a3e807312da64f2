//! Projects boundary polygons into the parameter plane, so that (u, v) is continuous along them, and counts their windings.

use super::boundary::{BoundaryPoint, Segment};
use super::off_surface::{FAR, OFF_SHAPE, off_bound};
use crate::geometry::{Projector, Surface};
use partprobe_shape::{Point, distance, norm};
use std::f64::consts::FRAC_PI_2;

/// The fractions of a parameter line that are compared to find whether the line is a single point. Its ends alone do not suffice,
/// because they may meet on a closed line.
const PROBES: [f64; 4] = [0.0, 0.31, 0.64, 1.0];

/// A corner of a boundary polygon in the parameter plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UvPoint {
    /// Parameters, unwrapped along the loop.
    pub(crate) uv: [f64; 2],
    /// The point in space.
    pub(crate) point: Point,
    /// ∂u and ∂v at this point. At a pole, one of them vanishes.
    pub(crate) tangents: [Point; 2],
    /// The piece of curve that leads to the next corner, or `None` along a pole.
    pub(crate) segment: Option<Segment>,
}

/// A boundary polygon in the parameter plane.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UvLoop {
    /// Corners in walking order.
    pub(crate) corners: Vec<UvPoint>,
    /// The numbers of periods of u and of v between the beginning and the end of the walk.
    pub(crate) windings: [i32; 2],
}

impl UvLoop {
    /// Whether a parameter of the walk changes while its point stays at a pole.
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

/// The treatment of corners that lie off their surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Off {
    /// They are kept where they are.
    Kept,
    /// The farthest of them were moved onto the surface.
    Moved,
}

/// The result of unwrapping a polygon.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnwrappedLoop {
    /// The polygon in the parameter plane.
    pub(crate) bound: UvLoop,
    /// The treatment of corners that lie too far off the surface, if there are any.
    pub(crate) off_surface: Option<Off>,
}

/// A projected corner, before unwrapping.
#[derive(Clone, Copy)]
struct Raw {
    uv: [f64; 2],
    tangents: [Point; 2],
    /// The parameter that is undetermined at this point, for example u at a sphere's pole.
    free: Option<usize>,
    corner: BoundaryPoint,
}

/// A visit of a walk at a pole: the point where it entered, and the piece of curve along which it leaves.
#[derive(Clone, Copy)]
struct PoleVisit {
    entry: UvPoint,
    axis: usize,
    segment: Segment,
}

/// Projects a polygon to the surface and unwraps its parameters.
///
/// Returns `None` if every corner lies at a pole. `size` is the diagonal of the shape. Corners that lie far off the surface are
/// moved onto it, in `polygon` as well.
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
    /// The last parameters of the walk outside of a pole.
    previous: [f64; 2],
    /// The pole at which the walk currently is, if any.
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

    /// Enters a pole on the meridian along which the walk came, or stays at the pole. All values of the parameter `axis` give one
    /// point.
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

    /// Leaves a pole on the meridian on which the walk continues. The piece of curve begins at the pole. Returns the next corner.
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

    /// The loop of a walk that has returned to its first corner.
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
        let mut found = projector.project_near(point, seed);
        if found.distance > OFF_SHAPE * size {
            // The search that started at a neighbor may have ended in the wrong position.
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

/// The parameter whose values all give the same point at `uv`, if there is one. `du` and `dv` are the tangents at `uv`.
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

/// Whether all values of a parameter give one point. A vanishing tangent does not suffice: it vanishes where control points of a
/// spline coincide, but the surface continues there.
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

/// The other parameter of a pole: exactly the end of its range at the pole, so that all visits have the same point in the chart.
/// If both ends are the same point, as on a horn torus, it is the end from which the walk came.
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

/// `x`, moved by whole periods so that it is as near to `anchor` as possible.
pub(crate) fn near(x: f64, anchor: f64, period: Option<f64>) -> f64 {
    period.map_or(x, |period| x + ((anchor - x) / period).round() * period)
}

/// The parameters at which a walk leaves a pole. The face lies on its left, so the direction of the walk decides in which
/// direction it passes around the pole.
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
