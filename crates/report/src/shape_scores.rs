//! Averages the score of each shape over the seeds, and lists all shapes with their scores.

use crate::html::{id_html, section};
use crate::sortable_table::{Cell, SortableTable};
use partprobe_eval::{Bootstrap, KBin, Metric, ScoreRow, Statistic, Tables, statistic};
use std::collections::BTreeMap;

/// A shape under one row of the tables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ShapeScore<'a> {
    pub(crate) shape: &'a str,
    pub(crate) group: &'a str,
    pub(crate) k: usize,
    /// The mean over the seeds.
    pub(crate) score: f64,
}

/// The reference and the clusterer of the first table, whose scores the charts show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MainTable<'a> {
    pub(crate) reference: &'a str,
    pub(crate) clusterer: &'a str,
}

impl<'a> MainTable<'a> {
    /// Returns `None` if there is no score.
    pub(crate) fn of(tables: &'a Tables) -> Option<Self> {
        let first = tables.rows.first()?;
        Some(Self {
            reference: &first.reference,
            clusterer: &first.clusterer,
        })
    }

    /// The names of its rows, in the order of the table.
    pub(crate) fn supervisions(self, tables: &'a Tables) -> impl Iterator<Item = &'a str> {
        let rows = tables
            .rows
            .iter()
            .filter(move |row| row.reference == self.reference && row.clusterer == self.clusterer);
        rows.map(|row| row.supervision.as_str())
    }

    /// The scores of each shape under a row, in the order of the ids.
    pub(crate) fn scores(
        self,
        rows: &'a [ScoreRow],
        supervision: &str,
        metric: Metric,
    ) -> Vec<ShapeScore<'a>> {
        let mut shapes: BTreeMap<&str, (&ScoreRow, f64, usize)> = BTreeMap::new();
        let own = rows.iter().filter(|row| {
            row.reference == self.reference
                && row.clusterer == self.clusterer
                && row.supervision == supervision
        });
        for row in own {
            if let Some(value) = metric.of(row) {
                let sum = shapes.entry(&row.shape).or_insert((row, 0.0, 0));
                sum.1 += value;
                sum.2 += 1;
            }
        }
        let each = shapes.into_iter().map(|(shape, (row, sum, n))| ShapeScore {
            shape,
            group: &row.group,
            k: row.k,
            score: sum / n as f64,
        });
        each.collect()
    }
}

/// The settings of the intervals of means.
const BOOTSTRAP: Bootstrap = Bootstrap {
    draws: 1000,
    seed: 0,
    least_groups: Bootstrap::LEAST_GROUPS,
};

/// The mean over the shapes that count in the tables, with its interval.
pub(crate) fn mean_of(scores: &[ShapeScore<'_>]) -> Option<Statistic> {
    let counting = scores.iter().filter(|score| KBin::of(score.k).is_in_mean());
    statistic(counting.map(|score| (score.group, score.score)), BOOTSTRAP)
}

/// The section with a table of all shapes. It is empty without scores.
pub(crate) fn shape_table(
    tables: &Tables,
    rows: &[ScoreRow],
    metric: Metric,
    index_of_shape: &BTreeMap<&str, usize>,
) -> String {
    let Some(main) = MainTable::of(tables) else {
        return String::new();
    };
    let names: Vec<&str> = main.supervisions(tables).collect();
    let mut shapes: BTreeMap<&str, (usize, BTreeMap<&str, f64>)> = BTreeMap::new();
    for name in &names {
        for found in main.scores(rows, name, metric) {
            let shape = shapes.entry(found.shape).or_default();
            shape.0 = found.k;
            shape.1.insert(name, found.score);
        }
    }
    let caption = format!(
        "{} of each test shape against {}",
        metric.heading, main.reference
    );
    let mut table = SortableTable::new("shape-scores", &caption)
        .column("shape", false)
        .column("K", true)
        .with_filter("part of an id")
        .scrolling();
    for name in &names {
        table = table.column(name, true);
    }
    for (shape, (k, scores)) in shapes {
        let name = match index_of_shape.get(shape) {
            Some(idx) => format!(
                "<a href=\"#view\" data-shape=\"{idx}\">{}</a>",
                id_html(shape)
            ),
            None => id_html(shape),
        };
        let mut cells = vec![
            Cell::html(name),
            Cell::number(Some(k as f64), &k.to_string()),
        ];
        cells.extend(
            names
                .iter()
                .map(|name| Cell::score(scores.get(name).copied()).with_bar()),
        );
        table.row("", &cells);
    }
    section(
        "every-shape",
        "Every test shape",
        "A score is the mean over the seeds. Choose a shape to see it in the 3D view.",
        &table.to_html(),
    )
}
