//! Averages rows of scores into one mean per supervision, and compares two supervisions.

mod csv;
mod decisions;
mod difference;
mod dose;
mod endpoint;
mod home_advantage;
mod markdown;
mod order;
mod paper;
mod row;
mod same_source;
mod shape_means;
#[cfg(test)]
pub(crate) mod tests;

pub use difference::DifferenceRow;
pub use dose::{DOSE_KINDS, DoseCurve, DoseKind, DosePlacement, DosePoint};
pub use endpoint::{Endpoint, EndpointError};
pub use home_advantage::HomeAdvantage;
pub use order::labels_row;
pub use row::{BinMean, TableRow};

use crate::bootstrap::Bootstrap;
use crate::metric::Metric;
use crate::metrics::METRICS;
use crate::paired::least_draws;
use crate::score_row::ScoreRow;
use difference::{adjust_p, difference_row};
use home_advantage::home_advantages;
use order::{cell_order, is_trained};
use row::table_row;
use same_source::same_source_rows;
use serde::Serialize;
use shape_means::{Shapes, bin_sizes, shape_means};
use std::collections::{BTreeMap, BTreeSet};

/// The settings of the tables: what they compare, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct TableSettings {
    /// The reference whose number of parts determines the bin of a shape, also under every other reference.
    pub bin_reference: String,
    /// The clusterer of a score that does not name one. Its tables come first.
    pub clusterer: String,
    /// A Δ row is the first of two supervisions minus the second. The first pair is the main one.
    pub compared: Vec<[String; 2]>,
    /// The numbers that decide about the main pair. They are chosen before the trainings.
    pub primary: Vec<Endpoint>,
    /// The standard deviation of a difference between two trainings that differ only in their seeds, if it is known from other
    /// trainings. Pairs with one seed use it.
    pub seed_deviation: Option<f64>,
    /// How the interval of the Δ row is drawn.
    pub bootstrap: Bootstrap,
    /// Sentences below every table: the settings with which it was made, and notes about the scores.
    pub footer: Vec<String>,
}

/// The tables of a run.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Tables {
    /// The clusterer of a score that does not name one.
    pub clusterer: String,
    /// By reference, clusterer and supervision.
    pub rows: Vec<TableRow>,
    /// By reference, clusterer and pair.
    pub differences: Vec<DifferenceRow>,
    /// By reference, clusterer and supervision: comparisons of trainings that differ only in their seed.
    pub same_source: Vec<DifferenceRow>,
    /// By clusterer and pair of supervisions.
    pub home_advantages: Vec<HomeAdvantage>,
    /// The sentences below every table.
    pub footer: Vec<String>,
}

impl Tables {
    /// Returns the row of a supervision under a reference and clusterer, or `None` if there is none.
    #[must_use]
    pub fn row(&self, supervision: &str, reference: &str, clusterer: &str) -> Option<&TableRow> {
        self.rows.iter().find(|row| {
            row.supervision == supervision
                && row.reference == reference
                && row.clusterer == clusterer
        })
    }

    /// The metrics of the list, and then those that only some row has.
    #[must_use]
    pub fn metrics(&self) -> BTreeSet<Metric> {
        let of_rows = self.rows.iter().flat_map(|row| row.means.keys());
        METRICS.iter().chain(of_rows).copied().collect()
    }

    /// All tables as JSON, in full precision.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps with text keys, numbers and text always serialize. The fallback only avoids a panic.
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .unwrap_or_default()
    }
}

/// The shapes of one table, by supervision. Each table has a reference and a clusterer.
struct TableShapes<'a> {
    table: [&'a str; 2],
    of_supervision: BTreeMap<&'a str, Shapes<'a>>,
}

/// Averages rows of scores. The order of the rows does not matter.
#[must_use]
pub fn tables(rows: &[ScoreRow], settings: &TableSettings) -> Tables {
    let k_of_shape = bin_sizes(rows, &settings.bin_reference);
    let mut cells: BTreeMap<_, Vec<&ScoreRow>> = BTreeMap::new();
    for row in rows {
        let cell = cells.entry(cell_order(row, settings)).or_default();
        cell.push(row);
    }

    let mut table_rows = Vec::new();
    let mut shapes_of_tables: Vec<TableShapes<'_>> = Vec::new();
    let mut same_source = Vec::new();
    let mut supervisions: Vec<&str> = Vec::new();
    for cell in cells.values() {
        let shapes = shape_means(cell, &k_of_shape);
        table_rows.push(table_row(cell, &shapes));
        same_source.extend(same_source_rows(cell, &k_of_shape, settings));
        let supervision = cell[0].supervision.as_str();
        if is_trained(supervision) && !supervisions.contains(&supervision) {
            supervisions.push(supervision);
        }

        // The cells of one table are consecutive.
        let table = [cell[0].reference.as_str(), cell[0].clusterer.as_str()];
        if shapes_of_tables
            .last()
            .is_none_or(|last| last.table != table)
        {
            shapes_of_tables.push(TableShapes {
                table,
                of_supervision: BTreeMap::new(),
            });
        }
        if let Some(last) = shapes_of_tables.last_mut() {
            last.of_supervision.insert(&cell[0].supervision, shapes);
        }
    }
    Tables {
        clusterer: settings.clusterer.clone(),
        rows: table_rows,
        differences: difference_rows(&shapes_of_tables, settings),
        same_source,
        home_advantages: home_advantages(&shapes_of_tables, &supervisions, settings.bootstrap),
        footer: settings.footer.clone(),
    }
}

/// The bootstrap with the number of draws that the correction for `n_tests` tests needs. With fewer draws, no difference could be
/// significant.
fn enough_draws(bootstrap: Bootstrap, n_tests: usize) -> Bootstrap {
    let draws = match bootstrap.draws {
        0 => 0,
        draws => draws.max(least_draws(n_tests)),
    };
    Bootstrap { draws, ..bootstrap }
}

fn difference_rows(
    shapes_of_tables: &[TableShapes<'_>],
    settings: &TableSettings,
) -> Vec<DifferenceRow> {
    let n_tests = shapes_of_tables.len() * settings.compared.len() * METRICS.len();
    let bootstrap = enough_draws(settings.bootstrap, n_tests);
    let mut rows = Vec::new();
    for shapes in shapes_of_tables {
        for compared in &settings.compared {
            let row = difference_row(
                shapes.table,
                compared,
                &shapes.of_supervision,
                settings,
                bootstrap,
            );
            rows.extend(row);
        }
    }
    adjust_p(&mut rows);
    rows
}
