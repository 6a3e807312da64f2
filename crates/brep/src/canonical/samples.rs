//! Samples a surface: a few points with normals to fit a primitive to, and a dense grid of points to check the fit.

use crate::geometry::Surface;
use partprobe_shape::{Point, bounding_diagonal, norm};

/// Number of points along each parameter to which a primitive is fitted.
const COARSE: usize = 5;
/// Largest number of intervals along each parameter on which a fit is checked.
const MAX_DENSE: usize = 48;
/// Step of a difference, as a fraction of a parameter's range.
const DIFFERENCE: f64 = 2e-5;
/// Number of points per interval between two knots.
const PER_SPAN: usize = 4;

/// A point of a surface with its unit normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) point: Point,
    pub(super) normal: Point,
}

/// The derivatives of a surface and of its normal at one point: ∂u and ∂v of the point, ∂u and ∂v of the normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct NormalRates(pub(super) [Point; 4]);

/// The samples to which a primitive is fitted.
pub(super) struct Samples<'a> {
    pub(super) list: Vec<Sample>,
    patch: &'a Patch<'a>,
    /// The parameters in the middle of the grid.
    middle: [f64; 2],
}

impl Samples<'_> {
    /// The diagonal of the box around the points.
    pub(super) fn extent(&self) -> f64 {
        bounding_diagonal(
            &self
                .list
                .iter()
                .map(|sample| sample.point)
                .collect::<Vec<_>>(),
        )
    }

    /// The derivatives in the middle of the surface, by differences. Only the fit of a torus uses them.
    pub(super) fn normal_rates(&self) -> Option<NormalRates> {
        let ([u, v], surface) = (self.middle, self.patch.surface);
        let span = |ends: &[f64]| DIFFERENCE * (ends[ends.len() - 1] - ends[0]);
        let (du, dv) = (span(&self.patch.u), span(&self.patch.v));
        let slope = |plus: Option<Point>, minus: Option<Point>, step: f64| {
            let (plus, minus) = (plus?, minus?);
            Some([0, 1, 2].map(|axis| (plus[axis] - minus[axis]) / (2.0 * step)))
        };
        let (_, along_u, along_v) = surface.derivatives(u, v);
        let turn_u = slope(
            surface.unit_normal(u + du, v),
            surface.unit_normal(u - du, v),
            du,
        )?;
        let turn_v = slope(
            surface.unit_normal(u, v + dv),
            surface.unit_normal(u, v - dv),
            dv,
        )?;
        Some(NormalRates([along_u, along_v, turn_u, turn_v]))
    }
}

/// A surface between finite parameters.
pub(super) struct Patch<'a> {
    surface: &'a Surface,
    u: Vec<f64>,
    v: Vec<f64>,
}

impl<'a> Patch<'a> {
    /// The whole surface. The height of an extrusion is set to the extent of its curve. Returns `None` if a parameter has no end.
    pub(super) fn of(surface: &'a Surface) -> Option<Self> {
        let [u, v] = match surface {
            Surface::Bspline(spline) => spline.breaks(),
            Surface::Extrusion { curve, direction } => {
                let (low, high) = curve.range()?;
                let [start, middle, end] = [low, 0.5 * (low + high), high].map(|t| curve.point(t));
                let height = bounding_diagonal(&[start, middle, end]) / norm(*direction);
                [knots(low, curve.breaks(low, high), high), vec![0.0, height]]
            }
            Surface::Revolution { curve, .. } => {
                let (low, high) = curve.range()?;
                let turn = std::f64::consts::TAU;
                [
                    vec![0.0, 0.25 * turn, 0.5 * turn, 0.75 * turn, turn],
                    knots(low, curve.breaks(low, high), high),
                ]
            }
            _ => return None,
        };
        let is_sound = |ends: &[f64]| ends.len() > 1 && ends.iter().all(|end| end.is_finite());
        (is_sound(&u) && is_sound(&v)).then_some(Self { surface, u, v })
    }

    /// A coarse grid that avoids the sides of the surface, because poles and cusps are there. Points without a normal are left
    /// out.
    pub(super) fn coarse_samples(&'a self) -> Samples<'a> {
        let points = |ends: &[f64]| {
            let (low, high) = (ends[0], ends[ends.len() - 1]);
            // The points are not symmetric, so a symmetry of the surface cannot hide a deviation between them.
            (0..COARSE)
                .map(|i| low + (high - low) * (i as f64 + 0.4) / COARSE as f64)
                .collect::<Vec<f64>>()
        };
        let (u, v) = (points(&self.u), points(&self.v));
        let grid = u.iter().flat_map(|&u| v.iter().map(move |&v| (u, v)));
        let sample = |(u, v)| {
            Some(Sample {
                point: self.surface.point(u, v),
                normal: self.surface.unit_normal(u, v)?,
            })
        };
        Samples {
            list: grid.filter_map(sample).collect(),
            patch: self,
            middle: [u[COARSE / 2], v[COARSE / 2]],
        }
    }

    /// A dense grid of points on the surface, including its sides.
    pub(super) fn dense_points(&self) -> impl Iterator<Item = Point> + '_ {
        let v = dense(&self.v);
        dense(&self.u)
            .into_iter()
            .flat_map(move |u| v.clone().into_iter().map(move |v| self.surface.point(u, v)))
    }
}

fn knots(low: f64, breaks: Vec<f64>, high: f64) -> Vec<f64> {
    std::iter::once(low).chain(breaks).chain([high]).collect()
}

/// The knots and points between them. If there are too many knots, [`MAX_DENSE`] equal intervals are used instead.
fn dense(ends: &[f64]) -> Vec<f64> {
    let (first, last) = (ends[0], ends[ends.len() - 1]);
    let spans = ends.len() - 1;
    if spans * PER_SPAN >= MAX_DENSE {
        return (0..=MAX_DENSE)
            .map(|i| first + (last - first) * i as f64 / MAX_DENSE as f64)
            .collect();
    }
    let between = |pair: &[f64]| {
        let (low, high) = (pair[0], pair[1]);
        (0..PER_SPAN)
            .map(move |i| low + (high - low) * i as f64 / PER_SPAN as f64)
            .collect::<Vec<f64>>()
    };
    ends.windows(2).flat_map(between).chain([last]).collect()
}
