//! Fits one network and scores its last iterate.

use super::Probe;
use super::pictures::write_pictures;
use super::record::{FitRecord, Outcome};
use super::shape::{ArmLabels, PreparedShape};
use anyhow::{Result, bail};
use indicatif::ProgressBar;
use partprobe_eval::score_clusters;
use partprobe_implicit::{
    Network, Reconstruction, Training, cons_knn, cons_normal, shared_label_scores, surface_scores,
};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

/// One network: a shape, the source of its labels, and a seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Fit {
    pub(super) shape: String,
    /// The label source, or `control`.
    pub(super) arm: String,
    pub(super) seed: u64,
}

impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}, seed {}", self.shape, self.arm, self.seed)
    }
}

/// A line of `log.jsonl`: the cost and the last losses of a fit.
#[derive(Serialize)]
struct LogLine<'a> {
    shape: &'a str,
    supervision: &'a str,
    seed: u64,
    fit_seconds: f64,
    score_seconds: f64,
    loss_surface: f64,
    loss_off_surface: f64,
    loss_normal: f64,
    loss_eikonal: f64,
    loss_segmentation: f64,
}

impl Fit {
    /// The record of a fit that cannot be made.
    pub(super) fn failed(&self, reason: &str) -> FitRecord {
        FitRecord {
            shape: self.shape.clone(),
            arm: self.arm.clone(),
            seed: self.seed,
            outcome: Outcome::Failed {
                reason: reason.to_owned(),
            },
        }
    }

    /// Fits the network and scores it.
    ///
    /// # Errors
    /// If the user stops the program, or a file cannot be written. A network without a surface is a record.
    pub(super) fn record(
        &self,
        shape: &PreparedShape,
        probe: &Probe<'_>,
        bar: &ProgressBar,
    ) -> Result<FitRecord> {
        let labels = shape.labels_of(&self.arm);
        let settings = probe.settings.fit_settings()?;
        let begun = Instant::now();
        let mut training = Training::new(
            &shape.pools,
            labels.map(|labels| &labels.of_pool),
            &settings,
            self.seed,
        );
        let mut losses = None;
        bar.set_message(self.to_string());
        while training.n_updates() < settings.iterations {
            if probe.execution.interrupt.is_set() {
                bail!(
                    "stopped at {self}; finished fits stay in {}, and --resume continues",
                    probe.folder.root().display()
                );
            }
            losses = Some(training.update());
            bar.inc(1);
        }
        let network = training.finish();
        let fit_seconds = begun.elapsed().as_secs_f64();
        let scored = self.scored(&network, shape, labels, probe)?;
        let losses = losses.unwrap_or_default();
        probe.folder.log(&LogLine {
            shape: &self.shape,
            supervision: &self.arm,
            seed: self.seed,
            fit_seconds,
            score_seconds: begun.elapsed().as_secs_f64() - fit_seconds,
            loss_surface: losses.surface,
            loss_off_surface: losses.off_surface,
            loss_normal: losses.normal,
            loss_eikonal: losses.eikonal,
            loss_segmentation: losses.segmentation,
        })?;
        Ok(scored)
    }

    fn scored(
        &self,
        network: &Network,
        shape: &PreparedShape,
        labels: Option<&ArmLabels>,
        probe: &Probe<'_>,
    ) -> Result<FitRecord> {
        let resolution = probe.settings.resolution()?;
        let n_points = probe.settings.score_points;
        let made =
            Reconstruction::new(network, &shape.reference, resolution, n_points, &self.shape);
        let reconstruction = match made {
            Ok(reconstruction) => reconstruction,
            Err(error) => return Ok(self.failed(&error.to_string())),
        };
        let mut scores = surface_part(&reconstruction, shape)?;
        if let Some(labels) = labels {
            scores.extend(label_part(network, &reconstruction, shape, labels)?);
        }
        let is_exported = probe
            .seeds
            .iter()
            .take(probe.settings.export_seeds)
            .any(|&seed| seed == self.seed);
        if is_exported {
            write_pictures(self, shape, labels, &reconstruction, probe)?;
        }
        Ok(FitRecord {
            shape: self.shape.clone(),
            arm: self.arm.clone(),
            seed: self.seed,
            outcome: Outcome::of_scores(scores),
        })
    }
}

type Scores = BTreeMap<&'static str, f64>;

fn surface_part(reconstruction: &Reconstruction, shape: &PreparedShape) -> Result<Scores> {
    let (exact, by_points) = surface_scores(reconstruction, &shape.reference, &shape.sample)?;
    Ok(BTreeMap::from([
        ("cdl1", exact.cdl1),
        ("f1", exact.f1),
        ("nc", exact.nc),
        ("cdl1_pp", by_points.cdl1),
        ("f1_pp", by_points.f1),
        ("nc_pp", by_points.nc),
        ("cdl1_floor", shape.floor.cdl1),
        ("f1_floor", shape.floor.f1),
        ("nc_floor", shape.floor.nc),
        ("n_triangles", reconstruction.mesh.triangles.len() as f64),
    ]))
}

fn label_part(
    network: &Network,
    reconstruction: &Reconstruction,
    shape: &PreparedShape,
    labels: &ArmLabels,
) -> Result<Scores> {
    let projected = reconstruction.projected();
    let own = labels.surface.label_of_points(&projected)?;
    let step = score_clusters(
        &reconstruction.labels,
        &shape.step.label_of_points(&projected)?,
    )?;
    let at_reference = network.labels(&shape.reference.in_frame(&shape.sample));
    let step_at_reference = score_clusters(&at_reference, &shape.step_of_sample)?;
    let mut scores = BTreeMap::from([
        ("miou_step", step.miou),
        ("accuracy_step", step.accuracy),
        ("miou_step_reference", step_at_reference.miou),
        ("accuracy_step_reference", step_at_reference.accuracy),
        ("labels_miou_step", labels.step_miou),
        ("labels_accuracy_step", labels.step_accuracy),
        ("n_labels", labels.of_pool.n_labels() as f64),
        (
            "cons_knn",
            cons_knn(&reconstruction.sample, &reconstruction.labels),
        ),
        (
            "cons_normal",
            cons_normal(network, &shape.reference, reconstruction),
        ),
    ]);
    if let Some(own) = shared_label_scores(&reconstruction.labels, &own) {
        scores.extend([("miou_own", own.miou), ("accuracy_own", own.accuracy)]);
    }
    if let Some(own) = shared_label_scores(&at_reference, &labels.of_sample) {
        scores.extend([
            ("miou_own_reference", own.miou),
            ("accuracy_own_reference", own.accuracy),
        ]);
    }
    Ok(scores)
}
