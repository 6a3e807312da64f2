//! Defines the settings of the implicit probe. `configs/implicit.toml` documents each value.

use anyhow::{Context, Result, ensure};
use partprobe_implicit::{Mode, Resolution, SegGrad, Settings, Trunk};
use serde::{Deserialize, Serialize};

/// The table `[implicit]`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ImplicitConfig {
    pub(crate) trunk: String,
    pub(crate) mode: ModeConfig,
    pub(crate) seg_grad: SegGradConfig,
    pub(crate) segmentation_weight: f64,
    pub(crate) control: bool,
    pub(crate) iterations: usize,
    /// The numbers of points on the surface, near it, and in the box.
    pub(crate) points: [usize; 3],
    pub(crate) learning_rate: f64,
    pub(crate) final_learning_rate: f64,
    pub(crate) clip_norm: f64,
    pub(crate) resolution: usize,
    pub(crate) score_points: usize,
    pub(crate) export_seeds: usize,
    pub(crate) picture_size: usize,
}

/// The data from which the trunk learns the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ModeConfig {
    /// Exact signed distances.
    OracleSdf,
    /// Surface points and a penalty on curvature.
    Flatcad,
}

/// The part of the network that gets the gradient of the segmentation loss.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SegGradConfig {
    /// The trunk and the head.
    Trunk,
    /// Only the head.
    Stop,
}

impl ImplicitConfig {
    /// Refuses values with which no fit can work.
    ///
    /// # Errors
    /// If a value is out of its range. The message names the key.
    pub(crate) fn check(&self) -> Result<()> {
        self.fit_settings()?;
        self.resolution()?;
        ensure!(self.iterations > 0, "implicit.iterations must be positive");
        let [surface, near, uniform] = self.points;
        ensure!(
            surface > 0 && near + uniform > 0,
            "implicit.points: there must be points on the surface, and points near it or in the box"
        );
        ensure!(
            self.points.iter().all(|&n| n <= 1_000_000),
            "implicit.points must be at most 1000000 each"
        );
        for (key, value) in [
            ("learning_rate", self.learning_rate),
            ("final_learning_rate", self.final_learning_rate),
            ("segmentation_weight", self.segmentation_weight),
        ] {
            ensure!(
                value.is_finite() && value > 0.0,
                "implicit.{key} must be positive"
            );
        }
        ensure!(
            self.clip_norm.is_finite() && self.clip_norm >= 0.0,
            "implicit.clip_norm must not be negative"
        );
        ensure!(
            (100..=10_000_000).contains(&self.score_points),
            "implicit.score_points must be from 100 to 10000000"
        );
        ensure!(
            (16..=4096).contains(&self.picture_size),
            "implicit.picture_size must be from 16 to 4096"
        );
        Ok(())
    }

    /// The settings of a fit.
    ///
    /// # Errors
    /// If the trunk is unknown.
    pub(crate) fn fit_settings(&self) -> Result<Settings> {
        let trunk: Trunk = self.trunk.parse().context("implicit.trunk")?;
        Ok(Settings {
            trunk,
            mode: match self.mode {
                ModeConfig::OracleSdf => Mode::OracleSdf,
                ModeConfig::Flatcad => Mode::FlatCad,
            },
            seg_grad: match self.seg_grad {
                SegGradConfig::Trunk => SegGrad::Trunk,
                SegGradConfig::Stop => SegGrad::Stop,
            },
            segmentation_weight: self.segmentation_weight,
            iterations: self.iterations,
            points: self.points,
            learning_rate: self.learning_rate,
            final_learning_rate: self.final_learning_rate,
            clip_norm: self.clip_norm,
        })
    }

    /// The grid of the surface.
    ///
    /// # Errors
    /// If there is no grid with this number of cells.
    pub(crate) fn resolution(&self) -> Result<Resolution> {
        Resolution::new(self.resolution)
            .context("implicit.resolution must be a multiple of 32, from 32 to 512")
    }
}
