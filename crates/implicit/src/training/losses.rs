//! Defines the terms of a loss. Before weighting, each one is a mean over its points.

use std::ops::AddAssign;

/// The terms of the loss of one update. A term that the mode does not have is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// The distance at points of the surface.
    pub surface: f64,
    /// The error of the distance away from the surface.
    pub off_surface: f64,
    /// 1 − cosine of the angle between gradient and normal at points of the surface.
    pub normal: f64,
    /// |length of the gradient − 1|.
    pub eikonal: f64,
    /// The mixed second derivative in the tangent plane (FlatCAD).
    pub off_diagonal: f64,
    /// The weighted cross-entropy of the labels.
    pub segmentation: f64,
}

impl AddAssign for Losses {
    fn add_assign(&mut self, other: Self) {
        self.surface += other.surface;
        self.off_surface += other.off_surface;
        self.normal += other.normal;
        self.eikonal += other.eikonal;
        self.off_diagonal += other.off_diagonal;
        self.segmentation += other.segmentation;
    }
}

/// The factors with which the terms enter the sum, each already divided by the number of its points.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Factors {
    pub(super) surface: f64,
    pub(super) off_surface: f64,
    pub(super) normal: f64,
    pub(super) eikonal: f64,
    pub(super) off_diagonal: f64,
    pub(super) segmentation: f64,
    /// 1 / the number of points of each term, for the reported means.
    pub(super) means: Means,
}

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Means {
    pub(super) surface: f64,
    pub(super) off_surface: f64,
    pub(super) eikonal: f64,
    pub(super) near: f64,
}

/// −1, 0 or 1.
pub(super) fn sign(x: f32) -> f32 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Adds |length − 1| of a gradient to the derivative by it, and returns the loss.
pub(super) fn eikonal(gradient: &[f32], by_gradient: &mut [f32], factor: f64) -> f64 {
    let length = length_of(gradient);
    let scale = factor as f32 * sign(length - 1.0) / length;
    for (by, x) in by_gradient.iter_mut().zip(gradient) {
        *by += scale * x;
    }
    f64::from((length - 1.0).abs())
}

/// Adds 1 − cosine of the angle between gradient and normal to the derivative by the gradient, and returns the loss.
pub(super) fn normal(
    gradient: &[f32],
    normal: &[f32; 3],
    by_gradient: &mut [f32],
    factor: f64,
) -> f64 {
    let length = length_of(gradient);
    let cosine =
        (gradient[0] * normal[0] + gradient[1] * normal[1] + gradient[2] * normal[2]) / length;
    let scale = factor as f32 / length;
    for ((by, x), n) in by_gradient.iter_mut().zip(gradient).zip(normal) {
        *by -= scale * (n - cosine * x / length);
    }
    f64::from(1.0 - cosine)
}

/// The length of a gradient. It is slightly more than 0 for a zero gradient, so that a division by it is possible.
pub(super) fn length_of(gradient: &[f32]) -> f32 {
    let squared: f32 = gradient.iter().map(|x| x * x).sum();
    squared.sqrt().max(1e-8)
}
