//! Checks the values of a config: each must be in its range, and values must fit to each other.
//!
//! What needs the data or the files of a config is checked by the stage that reads them.

use super::settings::{Config, TrainTable};
use anyhow::{Context, Result, ensure};
use partprobe_cluster::ClustererFactory;
use partprobe_label::{Kernel, Unit};
use partprobe_sources::face_source_named;
use partprobe_truck::TruckError;

/// More points than this do not fit into memory together with their tokens.
const MAX_POINTS: usize = 10_000_000;

impl Config {
    /// Refuses values with which no stage can work. The message names the key.
    ///
    /// # Errors
    /// If a value is out of its range.
    pub(crate) fn check(&self) -> Result<()> {
        self.check_label()?;
        self.check_shapes()?;
        self.check_comparison()?;
        self.check_evaluation()?;
        self.train.check()?;
        #[cfg(feature = "train")]
        if let Some(implicit) = &self.implicit {
            implicit.check()?;
        }
        for (name, table) in &self.sources {
            table.check(name)?;
        }
        self.check_source_names()?;
        self.net.check()?;
        self.tokens.check()?;
        self.loss.check()?;
        self.optim.check()?;
        #[cfg(feature = "train")]
        if self.train.epochs == 0 {
            self.optim.schedule.ensure_fits(self.train.steps)?;
        }
        self.augment.check()?;
        Ok(())
    }

    /// Partition and tessellation.
    fn check_label(&self) -> Result<()> {
        let label = &self.label;
        ensure!(
            (0.0..=180.0).contains(&label.theta_deg),
            "label.theta_deg must be from 0 to 180"
        );
        ensure!(
            in_range(label.chord_fraction, 1e-6, 0.5),
            "label.chord_fraction must be from 1e-6 to 0.5"
        );
        ensure!(
            in_range(label.angle_rad, 1e-3, 1.5),
            "label.angle_rad must be from 0.001 to 1.5"
        );
        ensure!(
            in_range(label.volume_loss, 0.0, 0.5),
            "label.volume_loss must be from 0 to 0.5"
        );
        if label.kernel == Kernel::Truck {
            ensure!(
                partprobe_truck::IS_BUILT_IN,
                "label.kernel: {}",
                TruckError::NotBuilt
            );
            ensure!(
                label.unit == Unit::File && !label.instances && label.attributes.is_empty(),
                "label.kernel = \"truck\" labels whole files and nothing else; set label.unit = \"file\", label.instances = \
                 false, label.attributes = []"
            );
        }
        ensure!(
            !(label.instances && label.unit == Unit::Solid),
            "label.instances places whole assemblies; it goes with label.unit = \"file\" only"
        );
        ensure!(
            !label.emit.is_empty(),
            "label.emit must name at least one of labels, carrier, points"
        );
        ensure!(
            are_distinct(&label.emit),
            "label.emit names something twice"
        );
        ensure!(
            are_distinct(&label.layers),
            "label.layers names a source twice"
        );
        for name in &label.layers {
            ensure!(
                !self.sources.contains_key(name),
                "label.layers names `{name}`, whose labels are imported; a layer is computed by a built-in source. Leave it out: \
                 `compare.supervision`, `compare.references` and `partprobe sample --source {name}` join imported labels when they \
                 are used"
            );
            face_source_named(name).context("label.layers")?;
        }
        ensure!(label.memory_mb >= 64, "label.memory_mb must be at least 64");
        ensure!(label.watchdog_s > 0, "label.watchdog_s must be positive");
        Ok(())
    }

    /// Which shapes there are, and how many points of them.
    fn check_shapes(&self) -> Result<()> {
        let (synth, sample) = (&self.synth, &self.sample);
        ensure!(
            (1..=MAX_POINTS).contains(&sample.n_points),
            "sample.n_points must be from 1 to {MAX_POINTS}"
        );
        ensure!(synth.n > 0, "synth.n must be positive");
        ensure!(
            2 <= synth.min_parts && synth.min_parts <= synth.max_parts && synth.max_parts <= 40,
            "synth.min_parts and synth.max_parts must satisfy 2 ≤ min_parts ≤ max_parts ≤ 40"
        );
        ensure!(
            self.select.min_parts <= self.select.max_parts,
            "select.min_parts must not exceed select.max_parts"
        );
        Ok(())
    }

    /// The split, and what is compared.
    fn check_comparison(&self) -> Result<()> {
        let (split, compare) = (&self.split, &self.compare);
        let shares = [split.train, split.valid, split.test];
        ensure!(
            shares.iter().all(|share| in_range(*share, 0.0, 1.0)),
            "split: each share must be from 0 to 1"
        );
        ensure!(
            (shares.iter().sum::<f64>() - 1.0).abs() < 1e-9,
            "split: train, valid and test must add up to 1"
        );
        ensure!(
            split.near_difference >= 0.0 && split.near_difference.is_finite(),
            "split.near_difference must be 0 or positive"
        );
        ensure!(
            0.0 < split.train_share && split.train_share <= 1.0,
            "split.train_share must be above 0 and at most 1"
        );
        ensure!(
            !compare.supervision.is_empty(),
            "compare.supervision must name at least one label source"
        );
        ensure!(
            are_distinct(&compare.supervision),
            "compare.supervision names a source twice"
        );
        ensure!(
            compare.score_against_supervisions || !compare.references.is_empty(),
            "compare.references must name at least one label source if compare.score_against_supervisions is false"
        );
        ensure!(
            are_distinct(&compare.seeds),
            "compare.seeds holds a seed twice"
        );
        ensure!(
            !compare.seeds.is_empty(),
            "compare.seeds must hold at least one seed"
        );
        Ok(())
    }

    /// Clustering, and the conditions under which backbones are scored again.
    fn check_evaluation(&self) -> Result<()> {
        for (idx, endpoint) in self.endpoints.iter().enumerate() {
            endpoint.check()?;
            ensure!(
                self.endpoints[..idx]
                    .iter()
                    .all(|other| other.name != endpoint.name),
                "endpoints: two have the name `{}`",
                endpoint.name
            );
        }
        let known_clusterers = ClustererFactory::known_names();
        ensure!(
            !self.eval.clusterers.is_empty(),
            "eval.clusterers must name at least one of {known_clusterers}"
        );
        ensure!(self.eval.restarts > 0, "eval.restarts must be positive");
        ensure!(
            self.eval.max_iterations > 0,
            "eval.max_iterations must be positive"
        );
        ensure!(
            self.eval.tolerance >= 0.0 && self.eval.tolerance.is_finite(),
            "eval.tolerance must be 0 or positive"
        );
        ensure!(
            are_distinct(&self.eval.clusterers),
            "eval.clusterers names a clusterer twice"
        );
        Ok(())
    }
}

impl TrainTable {
    fn check(&self) -> Result<()> {
        ensure!(
            (self.steps == 0) != (self.epochs == 0),
            "one of train.steps and train.epochs must be positive, and the other 0"
        );
        for (key, value) in [
            ("batch_shapes", self.batch_shapes),
            ("accumulate", self.accumulate),
        ] {
            ensure!(
                (1..=1_000_000).contains(&value),
                "train.{key} must be from 1 to 1000000"
            );
        }
        ensure!(
            self.init.as_deref() != Some(""),
            "train.init must name a file of weights; leave it out for random weights"
        );
        ensure!(
            self.valid_every == 0 || self.valid_every_epochs == 0,
            "train.valid_every counts steps and train.valid_every_epochs epochs; one of them must be 0"
        );
        ensure!(
            self.patience == 0 || self.valid_every + self.valid_every_epochs > 0,
            "train.patience counts validations; set train.valid_every or train.valid_every_epochs"
        );
        Ok(())
    }
}

fn are_distinct<T: PartialEq>(values: &[T]) -> bool {
    values
        .iter()
        .enumerate()
        .all(|(idx, value)| !values[..idx].contains(value))
}

fn in_range(value: f64, low: f64, high: f64) -> bool {
    (low..=high).contains(&value)
}
