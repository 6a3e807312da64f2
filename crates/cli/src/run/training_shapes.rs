//! Gives a training its shapes: points are kept in memory, or drawn again from the carrier each time that they are needed.
//!
//! Both give the same points, which depend only on the shape's id and the settings.

use crate::config::SampleConfig;
use crate::points::points_of;
use anyhow::{Context, Result};
use partprobe_carrier::PointSample;
use partprobe_dataset::CarrierRef;
use partprobe_net::TrainShape;
use std::borrow::Cow;

/// The shapes from which a training draws its batches, in the order of the split.
pub(crate) struct TrainingShapes {
    shapes: Vec<TrainShape>,
    redraw: Option<Redraw>,
}

/// The origin of points that are not kept.
pub(crate) struct Redraw {
    /// The carrier of each shape, with the hash that it had when it was labeled for this training.
    pub(crate) carriers: Vec<CarrierRef>,
    pub(crate) sample: SampleConfig,
}

impl TrainingShapes {
    /// The shapes without changes or, with `redraw`, without their points.
    pub(crate) fn new(shapes: Vec<TrainShape>, redraw: Option<Redraw>) -> Self {
        Self { shapes, redraw }
    }

    /// The number of shapes.
    pub(crate) fn n(&self) -> usize {
        self.shapes.len()
    }

    /// Gives the shapes the labels of another supervision.
    pub(crate) fn relabel(
        &mut self,
        mut labels_of: impl FnMut(&str) -> Result<Vec<i32>>,
    ) -> Result<()> {
        self.shapes.iter_mut().try_for_each(|shape| {
            shape.labels = labels_of(&shape.id)?;
            Ok(())
        })
    }

    /// A shape with its points.
    ///
    /// # Errors
    /// If its carrier is missing or has changed since it was labeled.
    pub(crate) fn get(&self, idx: usize) -> Result<Cow<'_, TrainShape>> {
        let shape = &self.shapes[idx];
        let Some(redraw) = &self.redraw else {
            return Ok(Cow::Borrowed(shape));
        };
        let sample = draw(&shape.id, &redraw.carriers[idx], &redraw.sample)?;
        Ok(Cow::Owned(TrainShape {
            id: shape.id.clone(),
            sample,
            labels: shape.labels.clone(),
        }))
    }
}

/// The points of the carrier in a file.
///
/// # Errors
/// If the file is missing, damaged or changed, or the carrier cannot be sampled.
pub(crate) fn draw(id: &str, carrier: &CarrierRef, config: &SampleConfig) -> Result<PointSample> {
    let (carrier, _) = carrier.read()?;
    points_of(id, &carrier, config).with_context(|| format!("sampling shape {id}"))
}
