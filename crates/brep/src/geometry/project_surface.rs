//! Projects a point onto a surface: finds the parameters of the nearest point.
//!
//! Planes, cylinders, cones, spheres and tori have a closed form. Extrusions and revolutions use a search along their curve.
//! B-splines and offsets use the damped Gauss–Newton method on both parameters (compare *The NURBS Book*, section 6.1), from a seed
//! or from a grid.

use super::gauss_newton::{ON_SURFACE, Projection, foot, nearer, newton, newton_from};
use super::project_elementary::{on_cone, on_torus};
use super::project_sweep::{on_extrusion, on_revolution};
use super::projection_grid::Grid;
use super::types::{BsplineSurface, CompositeSurface, Surface};
use partprobe_shape::{Point, distance, norm};
use std::cell::{Cell, OnceCell};

/// The result of a search from a seed is also accepted if its distance is hardly larger than that of earlier full searches, up to
/// this fraction of the surface's size. Such results occur because in some files the edges lie off their surfaces.
const MAX_GAP: f64 = 1e-3;
/// The same fraction after a search from the cells of the grid.
const MAX_CONFIRMED_GAP: f64 = 1e-2;

/// If a distance exceeds this fraction of the surface's size, an imprecise edge does not explain it: the search has stopped too
/// early.
const SLOPPY: f64 = 1e-4;

/// A search from the cells found nothing new if its distance is more than this fraction of the previous distance.
const FRUITLESS: f64 = 0.9;
/// After such a search, distances up to this multiple are accepted.
const HARDLY_FARTHER: f64 = 1.25;

/// A tangent nearly vanishes if it is shorter than this fraction of the other one, over the extent of the parameters.
const VANISHES: f64 = 0.02;
/// Offsets from such a point at which a search starts again, as fractions of the parameter's extent.
const NUDGES: [f64; 6] = [0.01, -0.01, 0.05, -0.05, 0.2, -0.2];

/// A surface that is prepared for many projections. The grid of a B-spline is computed once, when it is first needed.
pub(crate) struct Projector<'a> {
    surface: &'a Surface,
    grid: OnceCell<Grid>,
    /// The largest distance at which a full search ended.
    gap: Cell<f64>,
    /// Up to this distance, a search from the cells is known to find nothing nearer.
    confirmed: Cell<f64>,
}

impl Surface {
    /// Finds the point nearest to `p`. A seed near its parameters makes the search faster and keeps it on the same branch. For
    /// many points of one surface, a `Projector` is cheaper.
    #[must_use]
    pub fn project(&self, p: Point, seed: Option<[f64; 2]>) -> Projection {
        Projector::new(self).project(p, seed)
    }
}

impl<'a> Projector<'a> {
    /// Makes a projector. Nothing is computed yet.
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

    /// Finds the point nearest to `p`, as [`Surface::project`] does.
    pub(crate) fn project(&self, p: Point, seed: Option<[f64; 2]>) -> Projection {
        match (self.surface, seed) {
            (Surface::Bspline(spline), None) => self.on_bspline(spline, p, None),
            (Surface::Bspline(spline), Some(seed)) => {
                self.on_bspline(spline, p, Some(foot(self.surface, p, seed)))
            }
            _ => self.without_start(p, seed),
        }
    }

    /// The same for a point near one that has already been projected. Its known values save one evaluation.
    pub(crate) fn project_near(&self, p: Point, neighbor: Option<Projection>) -> Projection {
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
        // The foot on the offset has nearly the parameters of the foot on the basis. Only rounding and curvature make a
        // difference.
        let start = seed.unwrap_or_else(|| basis.project(p, None).uv);
        let found = newton(self.surface, p, start);
        if seed.is_none() || self.is_plausible(found) {
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
        if let Some(found) = near_seed.filter(|&found| self.is_plausible(found)) {
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
        if let Some(found) = near_start.filter(|&found| self.is_plausible(found)) {
            return found;
        }
        let grid = self.grid.get_or_init(|| Grid::of(spline));
        let mut best = near_start;
        for start in grid.starts(p) {
            let found = newton(self.surface, p, start);
            let nearest = best.map_or(found, |best| nearer(best, found));
            best = Some(nearest);
            if self.is_plausible(nearest) {
                break;
            }
        }
        let best = best.unwrap_or_else(|| foot(self.surface, p, [0.0; 2]));
        let best = if self.is_on_surface(best) {
            best
        } else {
            self.search_around(p, best)
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

    /// Repeats the search from points near one where a tangent nearly vanishes, for example because poles coincide. The search
    /// stops at such a point.
    fn search_around(&self, p: Point, stuck: Projection) -> Projection {
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

    /// Repeats the search from the middles of the cells that may hold the point. A search stops at a kink, because it uses the
    /// tangents of one side only. It also stops where poles coincide and the surface has no extent. It may also have ended at the
    /// nearest point of another sheet.
    ///
    /// If this finds nothing nearer, the edge does lie off the surface. Then points that are not farther away are not searched
    /// again.
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

    /// Whether a point is near enough to be the right one. Full searches have shown how far edges lie off this surface. The
    /// distance `confirmed` comes from the more thorough searches, so it may be larger.
    fn is_plausible(&self, found: Projection) -> bool {
        let size = self.size_at(found);
        let by_gap = (2.0 * self.gap.get()).min(MAX_GAP * size);
        let by_cells = self.confirmed.get().min(MAX_CONFIRMED_GAP * size);
        self.is_on_surface(found) || found.distance <= by_gap.max(by_cells)
    }

    fn is_on_surface(&self, found: Projection) -> bool {
        found.distance <= ON_SURFACE * self.size_at(found)
    }

    /// The size of the surface, estimated from the tangents at a point. Where the parameters are fast, this is more than the true
    /// size, so the true size is used when it is known.
    fn size_at(&self, found: Projection) -> f64 {
        let extent = self.surface.extent();
        let size = (norm(found.tangents[0]) * extent[0]).max(norm(found.tangents[1]) * extent[1]);
        self.grid.get().map_or(size, |grid| size.min(grid.size))
    }
}
