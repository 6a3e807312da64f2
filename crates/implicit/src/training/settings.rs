//! Defines the settings of a training, with their published or measured defaults.

use crate::network::Trunk;

/// The data from which the trunk learns the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The exact signed distance of points near the surface and in the box.
    OracleSdf,
    /// Only points on the surface, and a penalty on curvature that is not along the axes of a developable surface (FlatCAD).
    FlatCad,
}

/// The part of the network that gets the gradient of the segmentation loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SegGrad {
    /// The trunk and the head, so labels can change the surface.
    Trunk,
    /// Only the head.
    Stop,
}

/// The settings of a training.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The network.
    pub trunk: Trunk,
    /// The data from which it learns the surface.
    pub mode: Mode,
    /// The part of the network that gets the gradient of the segmentation loss.
    pub seg_grad: SegGrad,
    /// The weight of the segmentation loss.
    pub segmentation_weight: f64,
    /// The number of updates.
    pub iterations: usize,
    /// Points on the surface, near it and in the box per update. Each number is rounded up to whole blocks of 96.
    pub points: [usize; 3],
    /// The step of Adam at the first update.
    pub learning_rate: f64,
    /// The step at the last update. It decreases along a half cosine.
    pub final_learning_rate: f64,
    /// Gradients with a larger norm are scaled down to it. A value of 0 means never.
    pub clip_norm: f64,
}

impl Settings {
    /// The default settings of a mode. In measurements, they fit a shape well within minutes.
    #[must_use]
    pub fn of_mode(mode: Mode) -> Self {
        let common = Self {
            trunk: Trunk::Siren128x4,
            mode,
            seg_grad: SegGrad::Trunk,
            segmentation_weight: 0.5,
            iterations: 3_000,
            points: [1_536, 1_536, 768],
            learning_rate: 5e-4,
            final_learning_rate: 1e-6,
            clip_norm: 0.0,
        };
        match mode {
            Mode::OracleSdf => common,
            // The published numbers.
            Mode::FlatCad => Self {
                trunk: Trunk::Siren256x4,
                iterations: 10_000,
                points: [20_000; 3],
                learning_rate: 5e-5,
                final_learning_rate: 5e-5,
                clip_norm: 10.0,
                ..common
            },
        }
    }
}
