//! The parameters of a surface's point nearest to a point of space.
//!
//! Planes, cylinders, cones, spheres and tori answer in closed form, extrusions and revolutions by a search
//! along their curve, B-splines and offsets by Newton's method from a seed or from a grid.

use super::linear::along;
use super::nearest::{follow_seed, nearest_parameter, squared};
use super::types::{BsplineSurface, CompositeSurface, Curve, Frame, Surface};
use partprobe_shape::{Point, bounding_diagonal, cross, distance, dot, norm, subtract};
use std::cell::{Cell, OnceCell};

/// Grid points from which Newton's method starts.
const STARTS: usize = 5;
/// Cells of the grid from whose middles it starts again if that failed.
const CELLS: usize = 8;
/// Most grid points along one direction.
const MAX_GRID: usize = 160;
/// A seeded search that ends nearer than this fraction of the surface's size is believed.
const BELIEVED: f64 = 1e-6;
/// It is also believed if it ends hardly farther than a search everywhere did before, up to this fraction: some
/// files' edges lie beside their surfaces.
const STILL_BELIEVED: f64 = 1e-3;
/// The same after a search from the cells.
const CONFIRMED_BELIEVED: f64 = 1e-2;

/// A point that is farther from the surface than this fraction of its size is not the end of a sloppy edge: the search stood still.
const SLOPPY: f64 = 1e-4;

/// A search from the cells that leaves more than this fraction of a distance found nothing new.
const FRUITLESS: f64 = 0.9;
/// After it, points up to so many times as far away are believed.
const HARDLY_FARTHER: f64 = 1.25;

/// A tangent nearly vanishes if it reaches less far than this fraction of the other.
const VANISHES: f64 = 0.02;
/// How far beside such a point a search starts again, in fractions of the parameter's extent.
const NUDGES: [f64; 6] = [0.01, -0.01, 0.05, -0.05, 0.2, -0.2];

/// A step by less than this fraction of the parameters' extent is the last one.
const LAST_STEP: f64 = 1e-9;

/// Two points of a revolved curve give one circle if their squared distance is below this fraction of the squared size.
const COVERED_TWICE: f64 = 1e-16;

/// Where a point lies on a surface, and how far from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Parameters of the nearest point.
    pub uv: [f64; 2],
    /// Its distance.
    pub distance: f64,
    /// The nearest point.
    pub point: Point,
    /// ∂u and ∂v there.
    pub tangents: [Point; 2],
}

/// A surface made ready for many projections: the grid of a B-spline is computed once, when it is first needed.
pub(crate) struct Projector<'a> {
    surface: &'a Surface,
    grid: OnceCell<Grid>,
    /// The largest distance at which a search everywhere ended.
    gap: Cell<f64>,
    /// Up to this distance a search from the cells is known to find nothing nearer.
    confirmed: Cell<f64>,
}

struct Grid {
    u: Vec<f64>,
    v: Vec<f64>,
    /// `points[i * v.len() + j]`.
    points: Vec<Point>,
    /// The diagonal of the points' box.
    size: f64,
}

impl Surface {
    /// The parameters of the point nearest to `p`; a seed near them makes the search faster and keeps it on
    /// its branch. For many points of one surface a `Projector` is cheaper.
    #[must_use]
    pub fn project(&self, p: Point, seed: Option<[f64; 2]>) -> Projection {
        Projector::new(self).project(p, seed)
    }
}

impl<'a> Projector<'a> {
    /// Makes a surface ready; costs nothing yet.
    pub(crate) fn new(surface: &'a Surface) -> Self {
        Self {
            surface,
            grid: OnceCell::new(),
            gap: Cell::new(0.0),
            confirmed: Cell::new(0.0),
        }
    }

    /// The surface itself.
    pub(crate) fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// The parameters of the point nearest to `p`; see [`Surface::project`].
    pub(crate) fn project(&self, p: Point, seed: Option<[f64; 2]>) -> Projection {
        match (self.surface, seed) {
            (Surface::Bspline(spline), None) => self.on_bspline(spline, p, None),
            (Surface::Bspline(spline), Some(seed)) => {
                self.on_bspline(spline, p, Some(foot(self.surface, p, seed)))
            }
            _ => self.without_start(p, seed),
        }
    }

    /// The same for a point near one that has been projected: what is known there saves an evaluation.
    pub(crate) fn project_beside(&self, p: Point, neighbor: Option<Projection>) -> Projection {
        match (self.surface, neighbor) {
            (Surface::Bspline(spline), Some(neighbor)) => {
                let start = Projection {
                    distance: distance(p, neighbor.point),
                    ..neighbor
                };
                self.on_bspline(spline, p, Some(start))
            }
            _ => self.project(p, neighbor.map(|neighbor| neighbor.uv)),
        }
    }

    fn without_start(&self, p: Point, seed: Option<[f64; 2]>) -> Projection {
        let uv = match self.surface {
            Surface::Plane(frame) => {
                let [x, y, z] = frame.local(p);
                return Projection {
                    uv: [x, y],
                    distance: z.abs(),
                    point: frame.point(x, y, 0.0),
                    tangents: [frame.x, frame.y],
                };
            }
            Surface::Cylinder { frame, radius } => on_cone(frame.local(p), *radius, 0.0),
            Surface::Cone {
                frame,
                radius,
                slope,
            } => on_cone(frame.local(p), *radius, *slope),
            Surface::Sphere { frame, .. } => {
                let [x, y, z] = frame.local(p);
                [libm::atan2(y, x), libm::atan2(z, libm::hypot(x, y))]
            }
            Surface::Torus {
                frame,
                major,
                minor,
            } => on_torus(frame.local(p), *major, *minor),
            Surface::Extrusion { curve, direction } => on_extrusion(curve, *direction, p, seed),
            Surface::Revolution { axis, curve } => on_revolution(axis, curve, p, seed),
            Surface::Bspline(spline) => return self.on_bspline(spline, p, None),
            Surface::Offset { basis, .. } => return self.on_offset(basis, p, seed),
            Surface::Composite(composite) => return self.on_composite(composite, p, seed),
            Surface::Facets(facets) => facets.nearest(p),
        };
        foot(self.surface, p, uv)
    }

    fn on_offset(&self, basis: &Surface, p: Point, seed: Option<[f64; 2]>) -> Projection {
        // The foot on the basis is the foot on the offset, but for rounding and curvature.
        let start = seed.unwrap_or_else(|| basis.project(p, None).uv);
        let found = newton(self.surface, p, start);
        if seed.is_none() || self.is_believed(found) {
            return found;
        }
        nearer(found, newton(self.surface, p, basis.project(p, None).uv))
    }

    fn on_composite(
        &self,
        composite: &CompositeSurface,
        p: Point,
        seed: Option<[f64; 2]>,
    ) -> Projection {
        let near_seed = seed.map(|seed| newton(self.surface, p, seed));
        if let Some(found) = near_seed.filter(|&found| self.is_believed(found)) {
            return found;
        }
        let everywhere = composite
            .starts(p)
            .map(|start| newton(self.surface, p, start));
        let best = near_seed.into_iter().chain(everywhere).reduce(nearer);
        let best = best.unwrap_or_else(|| foot(self.surface, p, [0.0; 2]));
        self.gap.set(self.gap.get().max(best.distance));
        best
    }

    fn on_bspline(
        &self,
        spline: &BsplineSurface,
        p: Point,
        start: Option<Projection>,
    ) -> Projection {
        let near_start = start.map(|start| newton_from(self.surface, p, start));
        if let Some(found) = near_start.filter(|&found| self.is_believed(found)) {
            return found;
        }
        let grid = self.grid.get_or_init(|| Grid::of(spline));
        let mut best = near_start;
        for start in grid.starts(p) {
            let found = newton(self.surface, p, start);
            let nearest = best.map_or(found, |best| nearer(best, found));
            best = Some(nearest);
            if self.is_believed(nearest) {
                break;
            }
        }
        let best = best.unwrap_or_else(|| foot(self.surface, p, [0.0; 2]));
        let best = if self.is_on_surface(best) {
            best
        } else {
            self.nudged(p, best)
        };
        let is_near = best.distance <= self.confirmed.get().max(SLOPPY * self.size_at(best));
        let best = if is_near {
            best
        } else {
            self.search_cells(grid, p, best)
        };
        self.gap.set(self.gap.get().max(best.distance));
        best
    }

    /// The same search from beside a point where a tangent nearly vanishes, as where poles coincide: there it stands still.
    fn nudged(&self, p: Point, stuck: Projection) -> Projection {
        let extent = self.surface.extent();
        let reach = [0, 1].map(|axis| norm(stuck.tangents[axis]) * extent[axis]);
        let axis = usize::from(reach[1] < reach[0]);
        if reach[axis] > VANISHES * reach[1 - axis] {
            return stuck;
        }
        let start = |by: &f64| {
            let mut uv = stuck.uv;
            uv[axis] += by * extent[axis];
            newton(self.surface, p, uv)
        };
        NUDGES.iter().map(start).fold(stuck, nearer)
    }

    /// The same search from the middles of the cells that may hold the point. At a kink a search stands still, since it sees the
    /// tangents of one side only, and so it does where poles coincide and the surface has no extent. It may also have ended at
    /// the nearest point of another sheet.
    ///
    /// If this finds nothing nearer, then the edge truly lies beside the surface: points no farther away are not searched again.
    fn search_cells(&self, grid: &Grid, p: Point, stuck: Projection) -> Projection {
        let mut best = stuck;
        for start in grid.cells_near(p) {
            best = nearer(best, newton(self.surface, p, start));
            if self.is_on_surface(best) {
                break;
            }
        }
        if best.distance > FRUITLESS * stuck.distance {
            self.confirmed
                .set(self.confirmed.get().max(HARDLY_FARTHER * best.distance));
        }
        best
    }

    /// Whether a point is near enough to be the right one. How far an edge lies beside its surface is known from searches
    /// everywhere; `confirmed` comes from the more thorough ones, so that it may reach farther.
    fn is_believed(&self, found: Projection) -> bool {
        let size = self.size_at(found);
        let by_gap = (2.0 * self.gap.get()).min(STILL_BELIEVED * size);
        let by_cells = self.confirmed.get().min(CONFIRMED_BELIEVED * size);
        self.is_on_surface(found) || found.distance <= by_gap.max(by_cells)
    }

    fn is_on_surface(&self, found: Projection) -> bool {
        found.distance <= BELIEVED * self.size_at(found)
    }

    /// The size that the tangents at a point give the surface. Where it runs fast, that is more than its true size, which
    /// counts once it is known.
    fn size_at(&self, found: Projection) -> f64 {
        let extent = self.surface.extent();
        let size = (norm(found.tangents[0]) * extent[0]).max(norm(found.tangents[1]) * extent[1]);
        self.grid.get().map_or(size, |grid| size.min(grid.size))
    }
}

impl Grid {
    fn of(spline: &BsplineSurface) -> Self {
        let [u, v] = spline.breaks().map(|breaks| grid_lines(&breaks));
        let points: Vec<Point> = u
            .iter()
            .flat_map(|&u| v.iter().map(move |&v| spline.derivatives(u, v).0))
            .collect();
        let size = bounding_diagonal(&points);
        Self { u, v, points, size }
    }

    /// The middles of the cells whose boxes are nearest to `p`, nearest first; cells without extent are left out.
    fn cells_near(&self, p: Point) -> Vec<[f64; 2]> {
        let n_v = self.v.len();
        let mut cells = Vec::new();
        for i in 1..self.u.len() {
            for j in 1..n_v {
                let corners = [(i - 1, j - 1), (i, j - 1), (i, j), (i - 1, j)]
                    .map(|(i, j)| self.points[i * n_v + j]);
                let [a, b, c, d] = corners;
                if cross(subtract(c, a), subtract(d, b)) == [0.0; 3] {
                    continue;
                }
                let outside = [0, 1, 2].map(|axis| {
                    let low = corners
                        .iter()
                        .map(|corner| corner[axis])
                        .fold(f64::INFINITY, f64::min);
                    let high = corners
                        .iter()
                        .map(|corner| corner[axis])
                        .fold(f64::NEG_INFINITY, f64::max);
                    (low - p[axis]).max(p[axis] - high).max(0.0)
                });
                let middle = [0, 1, 2].map(|axis| 0.25 * (a[axis] + b[axis] + c[axis] + d[axis]));
                let order = (squared(outside), squared(subtract(middle, p)));
                cells.push((
                    order,
                    [(i - 1, &self.u), (j - 1, &self.v)]
                        .map(|(k, lines)| 0.5 * (lines[k] + lines[k + 1])),
                ));
            }
        }
        cells.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        cells.into_iter().take(CELLS).map(|(_, uv)| uv).collect()
    }

    /// The grid points that are nearer to `p` than their neighbors, nearest first.
    fn starts(&self, p: Point) -> Vec<[f64; 2]> {
        let (n_u, n_v) = (self.u.len(), self.v.len());
        let gaps: Vec<f64> = self
            .points
            .iter()
            .map(|&point| squared(subtract(point, p)))
            .collect();
        let gap = |i: usize, j: usize| gaps[i * n_v + j];
        let mut minima = Vec::new();
        for i in 0..n_u {
            for j in 0..n_v {
                let here = gap(i, j);
                let beside_u =
                    (i == 0 || here <= gap(i - 1, j)) && (i + 1 == n_u || here <= gap(i + 1, j));
                let beside_v =
                    (j == 0 || here <= gap(i, j - 1)) && (j + 1 == n_v || here <= gap(i, j + 1));
                if beside_u && beside_v {
                    minima.push((here, [self.u[i], self.v[j]]));
                }
            }
        }
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
        minima.into_iter().take(STARTS).map(|(_, uv)| uv).collect()
    }
}

/// Parameters between the knots: many in a spline of few spans, at most [`MAX_GRID`] in any.
fn grid_lines(breaks: &[f64]) -> Vec<f64> {
    let spans = breaks.len() - 1;
    let per_span = if spans <= 3 {
        6
    } else if spans <= 16 {
        3
    } else {
        2
    };
    let steps = (spans * per_span).min(MAX_GRID);
    let at = |i: usize| {
        let position = (i * spans) as f64 / steps as f64;
        let span = (position as usize).min(spans - 1);
        breaks[span] + (breaks[span + 1] - breaks[span]) * (position - span as f64)
    };
    (0..=steps).map(at).collect()
}

fn nearer(a: Projection, b: Projection) -> Projection {
    if b.distance < a.distance { b } else { a }
}

/// The foot on a cone (slope 0: a cylinder), along its normal.
///
/// A cone goes on behind its apex, where its radius is negative, and some files use that nappe.
fn on_cone([x, y, z]: Point, radius: f64, slope: f64) -> [f64; 2] {
    let out = libm::hypot(x, y);
    let gap = |reach: f64| (reach - radius - z * slope).abs();
    let is_behind = slope != 0.0 && gap(-out) < 0.5 * gap(out);
    let (reach, turn) = if is_behind {
        (-out, std::f64::consts::PI)
    } else {
        (out, 0.0)
    };
    // Along the meridian (slope, 1) from (radius, 0).
    let v = ((reach - radius) * slope + z) / (1.0 + slope * slope);
    [libm::atan2(y, x) + turn, v]
}

fn on_torus([x, y, z]: Point, major: f64, minor: f64) -> [f64; 2] {
    let out = libm::hypot(x, y);
    let v = libm::atan2(z, out - major);
    // A lemon's inner sheet ends at its tips.
    let end = if major.abs() < minor {
        libm::acos(-major / minor)
    } else {
        std::f64::consts::PI
    };
    [libm::atan2(y, x), v.clamp(-end, end)]
}

fn on_extrusion(curve: &Curve, direction: Point, p: Point, seed: Option<[f64; 2]>) -> [f64; 2] {
    let across = |arm: Point| {
        along(
            arm,
            direction,
            -dot(arm, direction) / dot(direction, direction),
        )
    };
    let residual = |t: f64| {
        let (point, slope) = curve.derivative(t);
        (across(subtract(point, p)), across(slope))
    };
    let u = match curve {
        Curve::Line { .. } => follow_seed(0.0, residual).1,
        _ => along_curve(curve, p, seed.map(|uv| uv[0]), residual),
    };
    [
        u,
        dot(subtract(p, curve.point(u)), direction) / dot(direction, direction),
    ]
}

fn on_revolution(axis: &Frame, curve: &Curve, p: Point, seed: Option<[f64; 2]>) -> [f64; 2] {
    let [x, y, z] = axis.local(p);
    let out = libm::hypot(x, y);
    let residual = |t: f64| {
        let (point, slope) = curve.derivative(t);
        let [cx, cy, cz] = axis.local(point);
        let (dx, dy, dz) = (dot(slope, axis.x), dot(slope, axis.y), dot(slope, axis.z));
        let reach = libm::hypot(cx, cy);
        let widening = if reach > 0.0 {
            (cx * dx + cy * dy) / reach
        } else {
            libm::hypot(dx, dy)
        };
        ([reach - out, cz - z, 0.0], [widening, dz, 0.0])
    };
    let v = match (
        near_seed(curve, seed.map(|uv| uv[1]), residual),
        meridian_direction(axis, curve, p),
    ) {
        (Some(v), _) => v,
        (None, None) => nearest_parameter(&curve.samples(p), residual),
        (None, Some(toward)) => {
            // A meridian in one plane with the axis may cross it, and each side has a nearest point of its own.
            let samples = curve.samples(p);
            let sides = [out, -out].map(|out| {
                let residual = |t: f64| {
                    let (point, slope) = curve.derivative(t);
                    let reach = dot(subtract(point, axis.origin), toward);
                    (
                        [reach - out, axis.local(point)[2] - z, 0.0],
                        [dot(slope, toward), dot(slope, axis.z), 0.0],
                    )
                };
                let v = nearest_parameter(&samples, residual);
                (residual(v).0, v)
            });
            let [(gap, v), (gap_beyond, v_beyond)] = sides;
            // A closed curve that the axis cuts into equal halves covers its surface twice, with opposite normals. The
            // meridian is then the half in which the curve's parameter begins; exporters begin it at the equator. That
            // does not depend on how far from the surface the point lies: it may be nearer to either half by an ulp.
            let size = squared(subtract(p, axis.origin)).max(out * out);
            let apart = [gap[0] + gap_beyond[0], gap[1] - gap_beyond[1], 0.0];
            if squared(apart) <= COVERED_TWICE * size {
                let start = curve.range().map_or(0.0, |(low, _)| low);
                let begins_beyond = dot(subtract(curve.point(start), axis.origin), toward) < 0.0;
                if begins_beyond { v_beyond } else { v }
            } else if squared(gap_beyond) < squared(gap) {
                v_beyond
            } else {
                v
            }
        }
    };
    let [cx, cy, _] = axis.local(curve.point(v));
    let is_on_axis = cx.hypot(cy) <= 1e-12 * norm(subtract(p, axis.origin)).max(out);
    [
        if is_on_axis {
            0.0
        } else {
            libm::atan2(y, x) - libm::atan2(cy, cx)
        },
        v,
    ]
}

/// The best parameter of a profile curve: near the seed if that fits, else anywhere on the curve.
fn along_curve(
    curve: &Curve,
    p: Point,
    seed: Option<f64>,
    residual: impl Fn(f64) -> (Point, Point),
) -> f64 {
    near_seed(curve, seed, &residual)
        .unwrap_or_else(|| nearest_parameter(&curve.samples(p), residual))
}

/// The parameter to which a seed leads, if the point is believed.
fn near_seed(
    curve: &Curve,
    seed: Option<f64>,
    residual: impl Fn(f64) -> (Point, Point),
) -> Option<f64> {
    let (squared_distance, t) = follow_seed(seed?, &residual);
    let extent = curve.range().map_or(1.0, |(low, high)| high - low);
    let size = norm(curve.derivative(t).1) * extent;
    let inside = curve.period().is_some()
        || curve
            .range()
            .is_none_or(|(low, high)| t >= low && t <= high);
    (inside && squared_distance.sqrt() <= BELIEVED * size).then_some(t)
}

/// The direction in which a meridian leaves the axis, where it lies in one plane with it.
pub(super) fn meridian_direction(axis: &Frame, curve: &Curve, p: Point) -> Option<Point> {
    let arms: Vec<[f64; 2]> = curve
        .samples(p)
        .iter()
        .map(|&t| axis.local(curve.point(t)))
        .map(|[x, y, _]| [x, y])
        .collect();
    let farthest = arms
        .iter()
        .copied()
        .max_by(|a, b| libm::hypot(a[0], a[1]).total_cmp(&libm::hypot(b[0], b[1])))?;
    let reach = libm::hypot(farthest[0], farthest[1]);
    let is_planar = arms
        .iter()
        .all(|arm| (arm[0] * farthest[1] - arm[1] * farthest[0]).abs() <= 1e-7 * reach * reach);
    (is_planar && reach > 0.0).then(|| axis.vector(farthest[0] / reach, farthest[1] / reach, 0.0))
}

/// The point at parameters, as if `p` had been projected there.
fn foot(surface: &Surface, p: Point, uv: [f64; 2]) -> Projection {
    let (point, du, dv) = surface.derivatives(uv[0], uv[1]);
    Projection {
        uv,
        distance: distance(p, point),
        point,
        tangents: [du, dv],
    }
}

/// Damped Gauss–Newton on both parameters from a point of the surface.
fn newton(surface: &Surface, p: Point, start: [f64; 2]) -> Projection {
    newton_from(surface, p, foot(surface, p, start))
}

/// The same from a point that is evaluated already; held inside the surface's bounds.
fn newton_from(surface: &Surface, p: Point, start: Projection) -> Projection {
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
        // Steps shrink quadratically: behind one this small nothing is left to gain, not even by looking there.
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

/// The step of least squares; a parameter that its bound holds back is left out.
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
