//! Defines the data that all fits of one shape share: its signed distances, its labels by each source, and the points of its
//! scores.

use super::Probe;
use crate::run::Shape;
use anyhow::{Context, Result};
use partprobe_carrier::{Carrier, PointSample};
use partprobe_eval::{clusters_of_labels, score_clusters};
use partprobe_implicit::{
    PointLabels, PointScores, PoolSizes, Pools, Reference, reference_sample, sampling_floor,
};
use partprobe_sources::SourceLabels;

/// A shape that is ready to be fitted.
pub(super) struct PreparedShape {
    pub(super) carrier: Carrier,
    pub(super) reference: Reference,
    pub(super) pools: Pools,
    /// In the order of the probe's sources.
    pub(super) arms: Vec<ArmLabels>,
    /// The labels of the source against which all arms are scored.
    pub(super) step: SourceLabels,
    pub(super) sample: PointSample,
    pub(super) step_of_sample: Vec<i32>,
    pub(super) floor: PointScores,
}

/// The labels of a shape by one source.
pub(super) struct ArmLabels {
    pub(super) arm: String,
    pub(super) surface: SourceLabels,
    pub(super) of_pool: PointLabels,
    pub(super) of_sample: Vec<i32>,
    /// The score of the labels themselves against the reference source.
    pub(super) step_miou: f64,
    pub(super) step_accuracy: f64,
}

impl PreparedShape {
    /// Reads and prepares a shape.
    ///
    /// # Errors
    /// If the carrier cannot be read, its surface is not closed, or a source cannot label it.
    pub(super) fn new(shape: &Shape, probe: &Probe<'_>) -> Result<Self> {
        let (carrier, _) = shape.carrier.read()?;
        let reference = Reference::new(carrier.mesh())?;
        let pools = Pools::new(&reference, PoolSizes::default(), &shape.id)?;
        let n_points = probe.settings.score_points;
        let [sample, second] =
            [0, 1].map(|index| reference_sample(&reference, n_points, &shape.id, index));
        let floor = sampling_floor(&reference, &sample, &second)?;
        let step = probe.reference.labels(&carrier, probe.source_seed)?;
        let step_of_sample = step.label_of_points(&sample)?;
        let mut arms = Vec::new();
        for source in &probe.sources {
            let name = source.name();
            let surface = source
                .labels(&carrier, probe.source_seed)
                .with_context(|| format!("`{name}`"))?;
            let of_sample = surface.label_of_points(&sample)?;
            let agreement = score_clusters(&clusters_of_labels(&of_sample), &step_of_sample)?;
            arms.push(ArmLabels {
                arm: name.to_owned(),
                of_pool: PointLabels::new(surface.label_of_points(&pools.surface.sample)?, &pools)
                    .with_context(|| format!("`{name}`"))?,
                surface,
                of_sample,
                step_miou: agreement.miou,
                step_accuracy: agreement.accuracy,
            });
        }
        Ok(Self {
            carrier,
            reference,
            pools,
            arms,
            step,
            sample,
            step_of_sample,
            floor,
        })
    }

    /// The labels of an arm, or `None` for the control.
    pub(super) fn labels_of(&self, arm: &str) -> Option<&ArmLabels> {
        self.arms.iter().find(|labels| labels.arm == arm)
    }
}
