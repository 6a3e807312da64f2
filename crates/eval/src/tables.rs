//! Rows of scores → means a supervision, and the difference between two supervisions with its interval.

use crate::bootstrap::{Bootstrap, GroupSum, Interval, interval_of_mean};
use crate::{KBin, METRICS, MIOU, Metric, ScoreRow};
use partprobe_carrier::keyed_rng;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// Supervisions that are no training, in the order in which they close a table.
const WITHOUT_TRAINING: [&str; 2] = ["untrained", "no-network"];

/// What a table is made for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableSettings {
    /// The reference whose number of parts decides a shape's bin, under every other reference too.
    pub bin_reference: String,
    /// The clusterer that a score means where no other is named; its tables come first.
    pub clusterer: String,
    /// The Δ row is the first of these supervisions minus the second.
    pub compared: Option<[String; 2]>,
    /// How the interval of the Δ row is drawn.
    pub bootstrap: Bootstrap,
}

/// A mean over the shapes of one bin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BinMean {
    /// The bin.
    pub bin: KBin,
    /// Mean mIoU; none for an empty bin.
    pub miou: Option<f64>,
    /// How many shapes the bin has.
    pub n_shapes: usize,
}

/// The means of one supervision under one reference and clusterer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TableRow {
    /// What the clusters are scored against.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// What the backbone was trained on.
    pub supervision: String,
    /// How many seeds were averaged.
    pub n_seeds: usize,
    /// How many shapes with 2 to 19 parts the means are over.
    pub n_shapes: usize,
    /// Mean of each metric over those shapes, a shape's own value being its mean over seeds; absent without values.
    pub means: BTreeMap<Metric, f64>,
    /// Standard deviation of the shapes' mIoU; none for fewer than two.
    pub miou_deviation: Option<f64>,
    /// Mean mIoU by number of parts, a single part and 20 and more included.
    pub bins: Vec<BinMean>,
}

/// A mean difference over the shapes that both supervisions have.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Mean of the first minus the second.
    pub mean: f64,
    /// Where it lies in 95 % of the bootstrap's draws; none for fewer than two groups of shapes.
    pub interval: Option<Interval>,
}

/// The difference between the two compared supervisions under one reference and clusterer.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DifferenceRow {
    /// What the clusters are scored against.
    pub reference: String,
    /// The algorithm that made the clusters.
    pub clusterer: String,
    /// First minus second.
    pub compared: [String; 2],
    /// How many shapes with 2 to 19 parts both have.
    pub n_shapes: usize,
    /// How many groups of related shapes those are.
    pub n_groups: usize,
    /// The difference of each metric; absent where one of the two has no values.
    pub differences: BTreeMap<Metric, Difference>,
}

/// The tables of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tables {
    /// The clusterer that a score means where no other is named.
    pub clusterer: String,
    /// By reference, clusterer and supervision.
    pub rows: Vec<TableRow>,
    /// By reference and clusterer.
    pub differences: Vec<DifferenceRow>,
}

impl Tables {
    /// The row of a supervision under a reference and clusterer, if there is one.
    #[must_use]
    pub fn row(&self, supervision: &str, reference: &str, clusterer: &str) -> Option<&TableRow> {
        let is_asked = |row: &&TableRow| {
            row.supervision == supervision
                && row.reference == reference
                && row.clusterer == clusterer
        };
        self.rows.iter().find(is_asked)
    }

    /// The metrics of the list, and then those that only some row has.
    #[must_use]
    pub fn metrics(&self) -> BTreeSet<Metric> {
        let of_rows = self.rows.iter().flat_map(|row| row.means.keys());
        METRICS.iter().chain(of_rows).copied().collect()
    }
}

/// One shape under one reference, clusterer and supervision, averaged over seeds.
struct ShapeMean<'a> {
    bin: KBin,
    group: &'a str,
    means: BTreeMap<Metric, f64>,
}

/// The shapes of one table row, by id.
type Shapes<'a> = BTreeMap<&'a str, ShapeMean<'a>>;

/// Averages rows of scores; the order of the rows does not matter.
#[must_use]
pub fn tables(rows: &[ScoreRow], settings: &TableSettings) -> Tables {
    let k_of_shape = bin_sizes(rows, &settings.bin_reference);
    let mut cells: BTreeMap<_, Vec<&ScoreRow>> = BTreeMap::new();
    for row in rows {
        cells
            .entry(cell_order(row, settings))
            .or_default()
            .push(row);
    }
    let mut found = Tables {
        clusterer: settings.clusterer.clone(),
        rows: Vec::new(),
        differences: Vec::new(),
    };
    let mut shapes_of: BTreeMap<[&str; 2], BTreeMap<&str, Shapes<'_>>> = BTreeMap::new();
    let mut tables_in_order: Vec<[&str; 2]> = Vec::new();
    for cell in cells.values() {
        let shapes = shape_means(cell, &k_of_shape);
        found.rows.push(table_row(cell, &shapes));
        let table = [cell[0].reference.as_str(), cell[0].clusterer.as_str()];
        if tables_in_order.last() != Some(&table) {
            tables_in_order.push(table);
        }
        shapes_of
            .entry(table)
            .or_default()
            .insert(&cell[0].supervision, shapes);
    }
    if let Some(compared) = &settings.compared {
        let difference = |table: &[&str; 2]| {
            difference_row(*table, compared, &shapes_of[table], settings.bootstrap)
        };
        found.differences = tables_in_order.iter().filter_map(difference).collect();
    }
    found
}

/// Number of parts of each shape under the reference that bins; the smallest where rows disagree.
fn bin_sizes<'a>(rows: &'a [ScoreRow], bin_reference: &str) -> BTreeMap<&'a str, usize> {
    let mut sizes = BTreeMap::new();
    for row in rows.iter().filter(|row| row.reference == bin_reference) {
        let size = sizes.entry(row.shape.as_str()).or_insert(row.k);
        *size = row.k.min(*size);
    }
    sizes
}

/// Where a row stands: the binning reference and the default clusterer first, what was compared before the rest,
/// and what was not trained last.
fn cell_order<'a>(row: &'a ScoreRow, settings: &TableSettings) -> impl Ord + use<'a> {
    let compared = settings
        .compared
        .as_ref()
        .and_then(|pair| pair.iter().position(|name| *name == row.supervision));
    let untrained = WITHOUT_TRAINING
        .iter()
        .position(|name| *name == row.supervision);
    let rank = match (compared, untrained) {
        (Some(place), _) => place,
        (None, None) => 2,
        (None, Some(place)) => 3 + place,
    };
    let (other_reference, other_clusterer) = (
        row.reference != settings.bin_reference,
        row.clusterer != settings.clusterer,
    );
    let names = (
        row.reference.as_str(),
        other_clusterer,
        row.clusterer.as_str(),
        rank,
        row.supervision.as_str(),
    );
    (other_reference, names)
}

fn shape_means<'a>(cell: &[&'a ScoreRow], k_of_shape: &BTreeMap<&str, usize>) -> Shapes<'a> {
    let mut by_shape: BTreeMap<&str, Vec<&ScoreRow>> = BTreeMap::new();
    for row in cell {
        by_shape.entry(&row.shape).or_default().push(row);
    }
    let shape_mean = |(shape, mut rows): (&'a str, Vec<&'a ScoreRow>)| {
        rows.sort_by_key(|row| row.seed);
        let k = k_of_shape.get(shape).copied().unwrap_or(rows[0].k);
        let mean_of =
            |metric: Metric| Some((metric, mean(rows.iter().filter_map(|row| metric.of(row)))?));
        let metrics: BTreeSet<Metric> = rows
            .iter()
            .flat_map(|row| row.scores.keys().copied())
            .collect();
        let means = metrics.into_iter().filter_map(mean_of).collect();
        (
            shape,
            ShapeMean {
                bin: KBin::of(k),
                group: &rows[0].group,
                means,
            },
        )
    };
    by_shape.into_iter().map(shape_mean).collect()
}

fn table_row(cell: &[&ScoreRow], shapes: &Shapes<'_>) -> TableRow {
    let in_mean = || shapes.values().filter(|shape| shape.bin.is_in_mean());
    let values =
        |metric: Metric| in_mean().filter_map(move |shape| shape.means.get(&metric).copied());
    let metrics: BTreeSet<Metric> = in_mean()
        .flat_map(|shape| shape.means.keys().copied())
        .collect();
    let means: BTreeMap<Metric, f64> = metrics
        .into_iter()
        .filter_map(|metric| Some((metric, mean(values(metric))?)))
        .collect();
    let deviations = means
        .get(&MIOU)
        .map(|mean| values(MIOU).map(move |miou| (miou - mean).powi(2)));
    let n_shapes = in_mean().count();
    let bin_mean = |bin: KBin| {
        let of_bin: Vec<&ShapeMean<'_>> =
            shapes.values().filter(|shape| shape.bin == bin).collect();
        let miou = mean(
            of_bin
                .iter()
                .filter_map(|shape| shape.means.get(&MIOU).copied()),
        );
        BinMean {
            bin,
            miou,
            n_shapes: of_bin.len(),
        }
    };
    TableRow {
        reference: cell[0].reference.clone(),
        clusterer: cell[0].clusterer.clone(),
        supervision: cell[0].supervision.clone(),
        n_seeds: cell
            .iter()
            .map(|row| row.seed)
            .collect::<BTreeSet<u64>>()
            .len(),
        n_shapes,
        miou_deviation: deviations
            .filter(|_| n_shapes > 1)
            .map(|all| (all.sum::<f64>() / (n_shapes - 1) as f64).sqrt()),
        means,
        bins: KBin::ALL.map(bin_mean).to_vec(),
    }
}

/// The Δ row of one table; none if one of the compared supervisions has no row in it.
fn difference_row(
    [reference, clusterer]: [&str; 2],
    compared: &[String; 2],
    shapes: &BTreeMap<&str, Shapes<'_>>,
    bootstrap: Bootstrap,
) -> Option<DifferenceRow> {
    let [first, second] = [
        shapes.get(compared[0].as_str())?,
        shapes.get(compared[1].as_str())?,
    ];
    let pairs = first
        .iter()
        .filter_map(|(shape, mean)| Some((mean, second.get(shape)?)));
    let pairs: Vec<(&ShapeMean<'_>, &ShapeMean<'_>)> =
        pairs.filter(|(first, _)| first.bin.is_in_mean()).collect();
    let metrics: BTreeSet<Metric> = pairs
        .iter()
        .flat_map(|(first, _)| first.means.keys().copied())
        .collect();
    let difference = |metric: Metric| {
        let mut groups: BTreeMap<&str, GroupSum> = BTreeMap::new();
        for (first, second) in &pairs {
            if let (Some(a), Some(b)) = (first.means.get(&metric), second.means.get(&metric)) {
                let group = groups.entry(first.group).or_default();
                group.sum += a - b;
                group.n += 1;
            }
        }
        let groups: Vec<GroupSum> = groups.into_values().collect();
        let n: usize = groups.iter().map(|group| group.n).sum();
        let mean = groups.iter().map(|group| group.sum).sum::<f64>() / n as f64;
        // One stream for all metrics and clusterers: each draw takes the same shapes under each of them.
        let mut rng = keyed_rng(bootstrap.seed, &["bootstrap", reference]);
        (n > 0).then(|| {
            (
                metric,
                Difference {
                    mean,
                    interval: interval_of_mean(&groups, bootstrap.draws, &mut rng),
                },
            )
        })
    };
    Some(DifferenceRow {
        reference: reference.to_owned(),
        clusterer: clusterer.to_owned(),
        compared: compared.clone(),
        n_shapes: pairs.len(),
        n_groups: pairs
            .iter()
            .map(|(first, _)| first.group)
            .collect::<BTreeSet<&str>>()
            .len(),
        differences: metrics.into_iter().filter_map(difference).collect(),
    })
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = values.fold((0.0, 0usize), |(sum, n), value| (sum + value, n + 1));
    (n > 0).then(|| sum / n as f64)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{ACCURACY, GTC_ACCURACY, GTC_MIOU};
    use proptest::prelude::*;

    pub(crate) fn row(shape: &str, supervision: &str, seed: u64, k: usize, miou: f64) -> ScoreRow {
        let mut scores = BTreeMap::from([(MIOU, miou), (ACCURACY, 0.5 + 0.5 * miou)]);
        if supervision != "no-network" {
            scores.extend([(GTC_ACCURACY, 0.9), (GTC_MIOU, 0.8)]);
        }
        ScoreRow {
            shape: shape.to_owned(),
            supervision: supervision.to_owned(),
            seed,
            reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            k,
            scores,
            group: shape.split("__").next().unwrap_or(shape).to_owned(),
        }
    }

    pub(crate) fn settings() -> TableSettings {
        TableSettings {
            bin_reference: "step-parts".to_owned(),
            clusterer: "k-means".to_owned(),
            compared: Some(["step-parts".to_owned(), "brep-face".to_owned()]),
            bootstrap: Bootstrap {
                draws: 200,
                seed: 0,
            },
        }
    }

    /// Two seeds, two supervisions and the two untrained rows over shapes in all bins.
    pub(crate) fn example() -> Vec<ScoreRow> {
        let mut rows = Vec::new();
        for (n, (shape, k)) in [
            ("a__1", 3),
            ("a__2", 7),
            ("b__1", 12),
            ("c__1", 1),
            ("d__1", 25),
        ]
        .into_iter()
        .enumerate()
        {
            let miou = 0.5 + 0.0625 * n as f64;
            for seed in [0, 1] {
                let bonus = 0.125 * seed as f64;
                rows.push(row(shape, "step-parts", seed, k, miou + bonus));
                rows.push(row(shape, "brep-face", seed, k, miou + bonus - 0.25));
            }
            rows.push(row(shape, "untrained", 0, k, 0.25));
            rows.push(row(shape, "no-network", 0, k, 0.125));
        }
        rows
    }

    #[test]
    fn means_are_over_seeds_then_over_shapes_of_the_papers_bins() {
        let found = tables(&example(), &settings());
        let names: Vec<&str> = found
            .rows
            .iter()
            .map(|row| row.supervision.as_str())
            .collect();
        assert_eq!(
            names,
            ["step-parts", "brep-face", "untrained", "no-network"]
        );
        let first = &found.rows[0];
        assert_eq!((first.n_seeds, first.n_shapes), (2, 3));
        assert!((first.means[&MIOU] - 0.625).abs() < 1e-12);
        assert!((first.miou_deviation.unwrap() - 0.0625).abs() < 1e-12);
        let bins: Vec<(usize, Option<f64>)> = first
            .bins
            .iter()
            .map(|bin| (bin.n_shapes, bin.miou))
            .collect();
        assert_eq!(
            bins,
            [
                (1, Some(0.75)),
                (1, Some(0.5625)),
                (1, Some(0.625)),
                (1, Some(0.6875)),
                (1, Some(0.8125))
            ]
        );
        assert_eq!(
            found.rows[3].means.keys().copied().collect::<Vec<_>>(),
            [MIOU, ACCURACY]
        );
    }

    #[test]
    fn a_constant_difference_has_a_narrow_interval() {
        let found = tables(&example(), &settings());
        let [difference] = &found.differences[..] else {
            panic!("one table, one Δ row")
        };
        assert_eq!((difference.n_shapes, difference.n_groups), (3, 2));
        let miou = difference.differences[&MIOU];
        assert_eq!(
            miou,
            Difference {
                mean: 0.25,
                interval: Some(Interval {
                    low: 0.25,
                    high: 0.25
                })
            }
        );
    }

    #[test]
    fn another_reference_is_binned_by_the_binning_one() {
        let mut rows = example();
        rows.extend(example().into_iter().map(|row| ScoreRow {
            reference: "brep-face".to_owned(),
            k: 30,
            ..row
        }));
        let found = tables(&rows, &settings());
        assert_eq!(found.rows.len(), 8);
        assert_eq!(found.rows[4].n_shapes, 3);
        assert_eq!(found.differences.len(), 2);
        // A shape without a row of the binning reference counts by its own number of parts.
        let alone: Vec<ScoreRow> = rows
            .into_iter()
            .filter(|row| row.reference == "brep-face")
            .collect();
        let found = tables(&alone, &settings());
        assert_eq!(
            (found.rows[0].n_shapes, found.rows[0].bins[4].n_shapes),
            (0, 5)
        );
        assert_eq!(found.rows[0].means, BTreeMap::new());
    }

    #[test]
    fn no_rows_give_empty_tables() {
        let found = tables(&[], &settings());
        assert!(found.rows.is_empty() && found.differences.is_empty());
        let one_sided: Vec<ScoreRow> = example()
            .into_iter()
            .filter(|row| row.supervision != "brep-face")
            .collect();
        assert!(tables(&one_sided, &settings()).differences.is_empty());
    }

    proptest! {
        #[test]
        fn the_order_of_rows_does_not_matter(order in Just(example()).prop_shuffle()) {
            prop_assert_eq!(tables(&order, &settings()), tables(&example(), &settings()));
        }
    }
}
