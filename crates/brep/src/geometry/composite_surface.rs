//! Evaluates surfaces that consist of a grid of patches (`RECTANGULAR_COMPOSITE_SURFACE` of ISO 10303-42).

use super::bspline_basis::into_range;
use super::linear::scaled;
use super::types::{CompositeSurface, SurfacePatch};
use partprobe_shape::{Point, bounding_diagonal, distance};

/// Number of points at which two sides of a composite are compared.
const SIDE_SAMPLES: usize = 9;
/// Two sides meet if their distance is below this fraction of the size.
const MEETS: f64 = 1e-6;

impl CompositeSurface {
    /// Makes a composite of patches (v varies fastest), and finds whether it closes.
    ///
    /// Returns `None` if the patches do not fill the grid.
    pub(crate) fn new([n_u, n_v]: [usize; 2], patches: Vec<SurfacePatch>) -> Option<Self> {
        if patches.is_empty() || n_u.checked_mul(n_v) != Some(patches.len()) {
            return None;
        }
        let mut surface = Self {
            n_u,
            n_v,
            patches,
            closed_u: false,
            closed_v: false,
        };
        let ends = [n_u as f64, n_v as f64];
        let fractions = (0..SIDE_SAMPLES).map(|i| i as f64 / (SIDE_SAMPLES - 1) as f64);
        let sides = |axis: usize| -> Vec<[Point; 2]> {
            let point = |across: f64, fraction: f64| {
                let along = fraction * ends[1 - axis];
                let [u, v] = if axis == 0 {
                    [across, along]
                } else {
                    [along, across]
                };
                surface.derivatives(u, v).0
            };
            fractions
                .clone()
                .map(|fraction| [point(0.0, fraction), point(ends[axis], fraction)])
                .collect()
        };
        let (across_u, across_v) = (sides(0), sides(1));
        let size = bounding_diagonal(
            &across_u
                .iter()
                .chain(&across_v)
                .flatten()
                .copied()
                .collect::<Vec<_>>(),
        );
        let meet =
            |sides: &[[Point; 2]]| sides.iter().all(|[a, b]| distance(*a, *b) <= MEETS * size);
        (surface.closed_u, surface.closed_v) = (meet(&across_u), meet(&across_v));
        Some(surface)
    }

    /// The parameters between which the surface runs, for u and v: patch `(i, j)` covers `i..i+1` and `j..j+1`.
    pub(crate) fn range(&self) -> [(f64, f64); 2] {
        [(0.0, self.n_u as f64), (0.0, self.n_v as f64)]
    }

    /// Point, ∂u and ∂v at (u, v). Beyond the ends, the parameters of a closed surface are wrapped. Any other surface continues
    /// with its last patch.
    pub(crate) fn derivatives(&self, u: f64, v: f64) -> (Point, Point, Point) {
        let (patch, [u, v]) = self.at(u, v);
        let [span_u, span_v] = patch.spans();
        let (point, du, dv) = patch.surface.derivatives(u, v);
        (point, scaled(du, span_u), scaled(dv, span_v))
    }

    /// ∂uu, ∂uv and ∂vv at (u, v).
    pub(crate) fn second_derivatives(&self, u: f64, v: f64) -> [Point; 3] {
        let (patch, [u, v]) = self.at(u, v);
        let [span_u, span_v] = patch.spans();
        let [uu, uv, vv] = patch.surface.second_derivatives(u, v);
        [
            scaled(uu, span_u * span_u),
            scaled(uv, span_u * span_v),
            scaled(vv, span_v * span_v),
        ]
    }

    /// For each patch the parameters of the point nearest to `p`, limited to the patch.
    pub(crate) fn starts<'a>(&'a self, p: Point) -> impl Iterator<Item = [f64; 2]> + 'a {
        self.patches.iter().enumerate().map(move |(index, patch)| {
            let [s, t] = patch.fractions(patch.surface.project(p, None).uv);
            [(index / self.n_v) as f64 + s, (index % self.n_v) as f64 + t]
        })
    }

    /// The patch at (u, v), and its surface's parameters there.
    fn at(&self, u: f64, v: f64) -> (&SurfacePatch, [f64; 2]) {
        let [range_u, range_v] = self.range();
        let u = if self.closed_u {
            into_range(u, range_u, true)
        } else {
            u
        };
        let v = if self.closed_v {
            into_range(v, range_v, true)
        } else {
            v
        };
        let (i, j) = (
            (u.max(0.0) as usize).min(self.n_u - 1),
            (v.max(0.0) as usize).min(self.n_v - 1),
        );
        let patch = &self.patches[i * self.n_v + j];
        let [span_u, span_v] = patch.spans();
        (
            patch,
            [
                patch.start[0] + span_u * (u - i as f64),
                patch.start[1] + span_v * (v - j as f64),
            ],
        )
    }
}

impl SurfacePatch {
    /// Whether exactly one of the patch's parameters runs backwards. Then its normal is opposite to that of its surface.
    pub(crate) fn is_reversed(&self) -> bool {
        let [span_u, span_v] = self.spans();
        (span_u < 0.0) != (span_v < 0.0)
    }

    /// Whether all these points lie on the patch.
    pub(crate) fn covers(&self, points: &[Point]) -> bool {
        let size = bounding_diagonal(points);
        points.iter().all(|&point| {
            let [s, t] = self.fractions(self.surface.project(point, None).uv);
            let [span_u, span_v] = self.spans();
            let on_patch = self
                .surface
                .point(self.start[0] + span_u * s, self.start[1] + span_v * t);
            distance(on_patch, point) <= MEETS * size
        })
    }

    fn spans(&self) -> [f64; 2] {
        [self.end[0] - self.start[0], self.end[1] - self.start[1]]
    }

    /// Parameters of the patch's surface as fractions of the patch, from 0 to 1.
    fn fractions(&self, uv: [f64; 2]) -> [f64; 2] {
        let period = self.surface.period();
        [0, 1].map(|axis| {
            let (start, span) = (self.start[axis], self.spans()[axis]);
            let middle = start + 0.5 * span;
            let x = period[axis].map_or(uv[axis], |p| {
                uv[axis] + ((middle - uv[axis]) / p).round() * p
            });
            ((x - start) / span).clamp(0.0, 1.0)
        })
    }
}
