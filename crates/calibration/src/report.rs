//! Computes the calibration tables of a corpus from its shapes.

use crate::{
    AngleHistogram, PartStatistics, ShapeAngles, StableRange, part_statistics, shape_angles,
    stable_range,
};
use partprobe_carrier::{Carrier, FaceType};
use partprobe_sources::partition_by_type_and_angle;
use serde::Serialize;

/// The thresholds and the tolerance of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationSettings {
    /// The operating threshold, in degrees. Fractions and changes refer to it.
    pub theta_deg: f64,
    /// The thresholds of the sweep, in degrees.
    pub thetas_deg: Vec<f64>,
    /// Fraction of the shapes whose partition may change inside the stable range.
    pub tolerance: f64,
}

/// The measurements of one shape.
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeCalibration {
    angles: ShapeAngles,
    sweep: Vec<PartStatistics>,
    changes: Vec<bool>,
}

impl ShapeCalibration {
    /// Measures one shape at every threshold of the sweep.
    #[must_use]
    pub fn of(carrier: &Carrier, settings: &CalibrationSettings) -> Self {
        let graph = carrier.graph();
        let operating = partition_by_type_and_angle(graph, settings.theta_deg);
        let thetas = settings.thetas_deg.iter();
        Self {
            angles: shape_angles(graph),
            sweep: thetas
                .clone()
                .map(|&theta| part_statistics(carrier, theta))
                .collect(),
            changes: thetas
                .map(|&theta| partition_by_type_and_angle(graph, theta) != operating)
                .collect(),
        }
    }
}

/// Collects the measurements of a corpus, shape by shape.
#[derive(Clone, Debug)]
pub struct Calibration {
    settings: CalibrationSettings,
    histogram: AngleHistogram,
    merges: Vec<Vec<f64>>,
    sweep: Vec<Vec<PartStatistics>>,
    n_changed: Vec<usize>,
}

impl Calibration {
    /// A corpus without shapes.
    #[must_use]
    pub fn new(settings: CalibrationSettings) -> Self {
        let n = settings.thetas_deg.len();
        Self {
            settings,
            histogram: AngleHistogram::new(),
            merges: Vec::new(),
            sweep: vec![Vec::new(); n],
            n_changed: vec![0; n],
        }
    }

    /// Adds a shape.
    pub fn add(&mut self, shape: ShapeCalibration) {
        self.histogram.add(&shape.angles, self.settings.theta_deg);
        self.merges.push(shape.angles.merges);
        for (idx, (statistics, changes)) in shape.sweep.into_iter().zip(shape.changes).enumerate() {
            self.sweep[idx].push(statistics);
            self.n_changed[idx] += usize::from(changes);
        }
    }

    /// The tables of all shapes that were added so far.
    #[must_use]
    pub fn tables(&self) -> CalibrationTables {
        let rows = self
            .settings
            .thetas_deg
            .iter()
            .zip(&self.sweep)
            .zip(&self.n_changed);
        CalibrationTables {
            settings: self.settings.clone(),
            n_shapes: self.merges.len(),
            n_shapes_without_merges: self.n_without_merges(),
            histogram: self.histogram.clone(),
            sweep: rows
                .map(|((&theta, shapes), &n_changed)| sweep_row(theta, shapes, n_changed))
                .collect(),
            stable_range: stable_range(&self.merges, self.settings.tolerance, None),
            range_around_theta: stable_range(
                &self.merges,
                self.settings.tolerance,
                Some(self.settings.theta_deg),
            ),
        }
    }

    fn n_without_merges(&self) -> usize {
        self.merges
            .iter()
            .filter(|merges| merges.is_empty())
            .count()
    }
}

/// The calibration tables of a corpus.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibrationTables {
    /// The settings of the calibration.
    pub settings: CalibrationSettings,
    /// Number of shapes that were measured.
    pub n_shapes: usize,
    /// Number of shapes in which no threshold joins two faces.
    pub n_shapes_without_merges: usize,
    /// The distribution of φ.
    pub histogram: AngleHistogram,
    /// One row per threshold of the sweep.
    pub sweep: Vec<SweepRow>,
    /// The widest range of thresholds over which few partitions change.
    pub stable_range: Option<StableRange>,
    /// The widest such range around the operating threshold.
    pub range_around_theta: Option<StableRange>,
}

/// The mean and the quartiles of one statistic over the shapes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quartiles {
    /// The mean.
    pub mean: f64,
    /// A quarter of the values are below this one.
    pub lower: f64,
    /// Half of the values are below this one.
    pub median: f64,
    /// Three quarters of the values are below this one.
    pub upper: f64,
}

impl Quartiles {
    /// Computes the mean and the quartiles of numbers in any order. Returns zeros if there are no numbers.
    #[must_use]
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let Some(last) = values.len().checked_sub(1) else {
            return Self::default();
        };
        let at = |fraction: f64| {
            let place = fraction * last as f64;
            let (below, above) = (
                values[place as usize],
                values[(place as usize + 1).min(last)],
            );
            below + place.fract() * (above - below)
        };
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        Self {
            mean,
            lower: at(0.25),
            median: at(0.5),
            upper: at(0.75),
        }
    }
}

/// Statistics of the corpus at one threshold.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepRow {
    /// The threshold, in degrees.
    pub theta_deg: f64,
    /// Number of parts of a shape, P.
    pub n_parts: Quartiles,
    /// Boundary sharpness, S, in degrees, over the shapes that have a boundary between two parts.
    pub sharpness_deg: Quartiles,
    /// Intra-part deviation, D, in degrees.
    pub deviation_deg: Quartiles,
    /// Part-size entropy, H.
    pub entropy: Quartiles,
    /// Mean number of parts per shape for each primitive type, indexed by the type's code.
    pub components: Vec<f64>,
    /// Number of shapes whose partition differs from that at the operating threshold.
    pub n_changed: usize,
    /// The same number as a fraction of the shapes.
    pub changed: f64,
}

fn sweep_row(theta_deg: f64, shapes: &[PartStatistics], n_changed: usize) -> SweepRow {
    let n_shapes = shapes.len().max(1) as f64;
    let over =
        |value: fn(&PartStatistics) -> f64| Quartiles::of(shapes.iter().map(value).collect());
    let components = |code: usize| {
        shapes
            .iter()
            .map(|shape| f64::from(shape.components[code]))
            .sum::<f64>()
            / n_shapes
    };
    SweepRow {
        theta_deg,
        n_parts: over(|shape| f64::from(shape.n_parts)),
        sharpness_deg: Quartiles::of(
            shapes
                .iter()
                .filter_map(|shape| shape.sharpness_deg)
                .collect(),
        ),
        deviation_deg: over(|shape| shape.deviation_deg),
        entropy: over(|shape| shape.entropy),
        components: (0..FaceType::ALL.len()).map(components).collect(),
        n_changed,
        changed: n_changed as f64 / n_shapes,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(values: &[f64], expected: [f64; 4]) {
        let found = Quartiles::of(values.to_vec());
        assert_eq!(
            [found.mean, found.lower, found.median, found.upper],
            expected
        );
    }

    #[test]
    fn quartiles_interpolate() {
        check(&[], [0.0; 4]);
        check(&[3.0], [3.0; 4]);
        check(&[4.0, 1.0, 3.0, 2.0], [2.5, 1.75, 2.5, 3.25]);
        check(&[5.0, 1.0, 2.0, 3.0, 4.0], [3.0, 2.0, 3.0, 4.0]);
    }
}
