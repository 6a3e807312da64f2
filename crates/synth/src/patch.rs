//! Defines a B-spline surface that is a height field over a rectangle, so that its points and normals have closed forms.

use crate::frame::{Frame, Planar, unit};
use crate::spline;
use partprobe_carrier::{Point, cross};

/// A cubic tensor-product surface over the rectangle from `low` to `high` of the frame's plane.
///
/// Invariant: at least four rows of at least four heights, all rows of one length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patch {
    pub(crate) frame: Frame,
    pub(crate) low: Planar,
    pub(crate) high: Planar,
    /// Heights of the control points, one row per step along x.
    pub(crate) heights: Vec<Vec<f64>>,
}

impl Patch {
    /// The control points, in the rows of `heights`.
    pub(crate) fn controls(&self) -> Vec<Vec<Point>> {
        let xs = self.abscissae(0, self.heights.len());
        let ys = self.abscissae(1, self.heights[0].len());
        let row = |x: f64, heights: &[f64]| {
            ys.iter()
                .zip(heights)
                .map(|(&y, &height)| self.frame.point([x, y], height))
                .collect()
        };
        xs.into_iter()
            .zip(&self.heights)
            .map(|(x, heights)| row(x, heights))
            .collect()
    }

    fn abscissae(&self, axis: usize, n: usize) -> Vec<f64> {
        spline::greville(n)
            .into_iter()
            .map(|t| self.low[axis] + t * (self.high[axis] - self.low[axis]))
            .collect()
    }

    /// The exact mean height over the rectangle.
    pub(crate) fn mean_height(&self) -> f64 {
        let along_x = spline::basis_integrals(self.heights.len());
        let along_y = spline::basis_integrals(self.heights[0].len());
        let row = |heights: &[f64]| {
            heights
                .iter()
                .zip(&along_y)
                .map(|(height, weight)| height * weight)
                .sum::<f64>()
        };
        self.heights
            .iter()
            .zip(&along_x)
            .map(|(heights, weight)| weight * row(heights))
            .sum()
    }

    /// The unit normal at the x and y of `point`, on the side of the frame's z axis.
    pub(crate) fn normal(&self, point: Point) -> Point {
        let [x, y, _] = self.frame.coordinates(point);
        let (width, depth) = (self.high[0] - self.low[0], self.high[1] - self.low[1]);
        let (u, v) = ((x - self.low[0]) / width, (y - self.low[1]) / depth);
        let (nx, ny) = (self.heights.len(), self.heights[0].len());
        let slope_x = self.weighted(&spline::basis_slopes(nx, u), &spline::basis(ny, v)) / width;
        let slope_y = self.weighted(&spline::basis(nx, u), &spline::basis_slopes(ny, v)) / depth;
        let (along_x, along_y) = (
            self.frame.vector([1.0, 0.0, slope_x]),
            self.frame.vector([0.0, 1.0, slope_y]),
        );
        unit(cross(along_x, along_y))
    }

    fn weighted(&self, along_x: &[f64], along_y: &[f64]) -> f64 {
        let row = |heights: &[f64]| {
            heights
                .iter()
                .zip(along_y)
                .map(|(height, weight)| height * weight)
                .sum::<f64>()
        };
        self.heights
            .iter()
            .zip(along_x)
            .map(|(heights, weight)| weight * row(heights))
            .sum()
    }
}
