//! Averages the rows of shapes: over all of them, by their number of parts, and by the positions of the points.

use super::curve::{AgreementBin, DISTANCE_LIMITS, THICKNESS_LIMITS};
use super::rows::{AgreementMetric, AgreementRow, RefusedShape};
use super::shape::ShapeAgreement;
use super::statistic::{Statistic, statistic};
use crate::bootstrap::Bootstrap;
use crate::k_bin::KBin;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The settings of the tables, and the text above them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgreementTablesSettings {
    /// The reference source.
    pub reference: String,
    /// The compared sources, in the order in which rows are shown.
    pub sources: Vec<String>,
    /// The channels, in the order of the tables.
    pub channels: Vec<String>,
    /// Points of each shape.
    pub n_points: usize,
    /// The bootstrap of the intervals.
    #[serde(skip)]
    pub bootstrap: Bootstrap,
}

/// All tables of a comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AgreementTables {
    /// The settings with which they were made.
    #[serde(flatten)]
    pub settings: AgreementTablesSettings,
    /// One table row per channel and source with at least one shape.
    pub tables: Vec<AgreementTable>,
    /// The shapes that a source refused, by source and shape.
    pub refused: Vec<RefusedShape>,
}

/// One source through one channel, over all shapes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AgreementTable {
    /// The channel.
    pub channel: String,
    /// The source.
    pub source: String,
    /// Shapes that were compared.
    pub n_shapes: usize,
    /// Shapes on which the source has at least 20 labels, as a fraction: the cap of the paper's exporter.
    pub fraction_at_cap: f64,
    /// Every number by its name. A number that no shape has is absent.
    pub statistics: BTreeMap<String, Statistic>,
    /// Scores by the number of reference parts.
    pub bins: Vec<KBinAgreement>,
    /// Accuracy by the distance to the nearest reference border.
    pub by_distance: Vec<CurvePoint>,
    /// Accuracy by the local thickness.
    pub by_thickness: Vec<CurvePoint>,
}

/// The labels of a capped source.
pub(super) const CAP: usize = 20;

/// The shapes with a number of parts in one bin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct KBinAgreement {
    /// The bin.
    pub bin: KBin,
    /// Shapes in it.
    pub n_shapes: usize,
    /// The accuracy. `None` if the bin is empty.
    pub accuracy: Option<Statistic>,
    /// The mean IoU.
    pub miou: Option<Statistic>,
    /// The accuracy in the 0.5 % band.
    pub boundary: Option<Statistic>,
}

/// The points in one bin of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// The lower limit, as a fraction of the diagonal.
    pub from: f64,
    /// The upper limit. `None` if there is none.
    pub to: Option<f64>,
    /// The accuracy of each shape in the bin, over the shapes that have points there. `None` if none has.
    pub accuracy: Option<Statistic>,
    /// The fraction of all points of all shapes that lie in the bin.
    pub fraction_of_points: f64,
}

/// Averages rows. The order of the rows and of the refused shapes does not matter.
#[must_use]
pub fn agreement_tables(
    rows: &[AgreementRow],
    mut refused: Vec<RefusedShape>,
    settings: AgreementTablesSettings,
) -> AgreementTables {
    let mut tables = Vec::new();
    for channel in &settings.channels {
        for source in &settings.sources {
            let is_of_source =
                |row: &&AgreementRow| row.channel == *channel && row.source == *source;
            let mut chosen: Vec<&AgreementRow> = rows.iter().filter(is_of_source).collect();
            chosen.sort_by(|a, b| a.shape.cmp(&b.shape));
            if !chosen.is_empty() {
                tables.push(table(&chosen, settings.bootstrap));
            }
        }
    }
    refused.sort();
    AgreementTables {
        settings,
        tables,
        refused,
    }
}

/// One source through one channel. `rows` must not be empty.
fn table(rows: &[&AgreementRow], bootstrap: Bootstrap) -> AgreementTable {
    let over = |of: fn(&AgreementRow) -> Option<f64>| of_rows(rows, of, bootstrap);
    let named = |metric: &AgreementMetric| Some((metric.name.to_owned(), over(metric.of)?));
    let bin = |bin: KBin| {
        let of_bin = |row: &&&AgreementRow| KBin::of(row.agreement.n_reference) == bin;
        let rows: Vec<&AgreementRow> = rows.iter().filter(of_bin).copied().collect();
        let over = |of: fn(&AgreementRow) -> Option<f64>| of_rows(&rows, of, bootstrap);
        KBinAgreement {
            bin,
            n_shapes: rows.len(),
            accuracy: over(|row| Some(row.agreement.accuracy)),
            miou: over(|row| Some(row.agreement.miou)),
            boundary: over(|row| row.agreement.boundary[1]),
        }
    };
    let is_capped = |row: &&&AgreementRow| row.agreement.n_labels >= CAP;
    AgreementTable {
        channel: rows[0].channel.clone(),
        source: rows[0].source.clone(),
        n_shapes: rows.len(),
        fraction_at_cap: rows.iter().filter(is_capped).count() as f64 / rows.len() as f64,
        statistics: AgreementMetric::ALL.iter().filter_map(named).collect(),
        bins: KBin::ALL.map(bin).to_vec(),
        by_distance: curve(rows, |of| &of.by_distance, &DISTANCE_LIMITS, bootstrap),
        by_thickness: curve(rows, |of| &of.by_thickness, &THICKNESS_LIMITS, bootstrap),
    }
}

fn of_rows(
    rows: &[&AgreementRow],
    of: fn(&AgreementRow) -> Option<f64>,
    bootstrap: Bootstrap,
) -> Option<Statistic> {
    let value = |row: &&'_ AgreementRow| of(row).map(|value| (row.group.clone(), value));
    let values: Vec<(String, f64)> = rows.iter().filter_map(value).collect();
    statistic(
        values.iter().map(|(group, value)| (group.as_str(), *value)),
        bootstrap,
    )
}

fn curve(
    rows: &[&AgreementRow],
    bins_of: fn(&ShapeAgreement) -> &Vec<AgreementBin>,
    limits: &[f64],
    bootstrap: Bootstrap,
) -> Vec<CurvePoint> {
    let bin_of = |row: &&AgreementRow, idx: usize| bins_of(&row.agreement).get(idx).copied();
    let n_in_bin = |idx: usize| -> u64 {
        let bins = rows.iter().filter_map(|row| bin_of(row, idx));
        bins.map(|bin| bin.n_points).sum()
    };
    let n_points: u64 = (0..limits.len()).map(n_in_bin).sum();
    let point = |(idx, &limit): (usize, &f64)| {
        let accuracy =
            |row: &&'_ AgreementRow| Some((row.group.clone(), bin_of(row, idx)?.accuracy()?));
        let values: Vec<(String, f64)> = rows.iter().filter_map(accuracy).collect();
        CurvePoint {
            from: if idx == 0 { 0.0 } else { limits[idx - 1] },
            to: Some(limit).filter(|limit| limit.is_finite()),
            accuracy: statistic(
                values.iter().map(|(group, value)| (group.as_str(), *value)),
                bootstrap,
            ),
            fraction_of_points: n_in_bin(idx) as f64 / n_points.max(1) as f64,
        }
    };
    limits.iter().enumerate().map(point).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::agreement::{CeilingScores, PointPositions, agreement};
    use proptest::prelude::*;

    /// A shape of four points, two of each part, on which the source is right (`n_wrong` = 0), or wrong at one point.
    fn row(shape: &str, source: &str, n_wrong: usize) -> AgreementRow {
        let labels = if n_wrong == 0 {
            [0, 0, 1, 1]
        } else {
            [0, 1, 1, 1]
        };
        let positions = PointPositions {
            border_distance: &[0.1, 0.004, 0.001, f64::NAN],
            thickness: &[0.1; 4],
        };
        AgreementRow {
            shape: shape.to_owned(),
            group: shape.to_owned(),
            source: source.to_owned(),
            channel: "index".to_owned(),
            agreement: agreement(&labels, &[0, 0, 1, 1], positions).unwrap(),
            ceiling: CeilingScores {
                accuracy: 1.0,
                miou: 1.0,
                boundary: Some(1.0),
            },
        }
    }

    pub(in crate::agreement) fn example() -> Vec<AgreementRow> {
        vec![row("a", "x", 0), row("b", "x", 1), row("a", "y", 1)]
    }

    pub(in crate::agreement) fn settings() -> AgreementTablesSettings {
        AgreementTablesSettings {
            reference: "step-parts".to_owned(),
            sources: ["y", "x", "z"].map(str::to_owned).to_vec(),
            channels: vec!["index".to_owned()],
            n_points: 4,
            bootstrap: Bootstrap {
                draws: 50,
                seed: 0,
                least_groups: 2,
            },
        }
    }

    #[test]
    fn rows_are_averaged_by_source_in_the_requested_order() {
        let found = agreement_tables(&example(), Vec::new(), settings());
        let names: Vec<(&str, usize)> = found
            .tables
            .iter()
            .map(|table| (table.source.as_str(), table.n_shapes))
            .collect();
        assert_eq!(names, [("y", 1), ("x", 2)]);
        let of_x = &found.tables[1];
        let accuracy = of_x.statistics["accuracy"];
        assert!((accuracy.mean - 0.875).abs() < 1e-12 && accuracy.n_shapes == 2);
        assert!((of_x.statistics["boundary_0.25"].mean - 1.0).abs() < 1e-12);
        assert!((of_x.statistics["boundary_0.5"].mean - 0.75).abs() < 1e-12);
        let bins: Vec<usize> = of_x.bins.iter().map(|bin| bin.n_shapes).collect();
        assert_eq!(bins, [0, 2, 0, 0, 0]);
        assert_eq!(of_x.fraction_at_cap, 0.0);
    }

    #[test]
    fn curves_average_shapes_and_count_points() {
        let found = agreement_tables(&example(), Vec::new(), settings());
        let curve = &found.tables[1].by_distance;
        let means: Vec<Option<f64>> = curve
            .iter()
            .map(|point| Some(point.accuracy?.mean))
            .collect();
        assert_eq!(means[..3], [Some(1.0), Some(0.5), None]);
        let fractions: f64 = curve.iter().map(|point| point.fraction_of_points).sum();
        assert!((fractions - 1.0).abs() < 1e-12);
        assert_eq!(
            (curve[0].from, curve[0].to, curve[7].to),
            (0.0, Some(0.0025), None)
        );
    }

    proptest! {
        #[test]
        fn the_order_of_rows_does_not_matter(order in Just(example()).prop_shuffle()) {
            prop_assert_eq!(agreement_tables(&order, Vec::new(), settings()), agreement_tables(&example(), Vec::new(), settings()));
        }
    }
}
