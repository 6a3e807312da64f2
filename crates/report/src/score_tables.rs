//! Writes the tables of scores: one per reference and clusterer, with the difference of the compared supervisions.

use crate::html::{escaped, section, with_code};
use crate::names::Names;
use crate::sortable_table::{Cell, SortableTable};
use partprobe_eval::{Difference, DifferenceRow, Metric, TableRow, Tables};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The explanation of the columns, below the tables.
const EXPLANATION: &str = "<p class=\"note\">Means are over shapes with 2 to 19 reference parts; a column <i>K</i> holds the mean mIoU of the shapes with so \
     many parts. mIoU and accuracy: the clusterer knows the number of reference parts, clusters are matched to parts by the \
     Hungarian algorithm, and all sampled points count. GTc: each point goes to the part whose mean embedding is nearest, without \
     a clusterer; our loss trains for it. <code>untrained</code> is the same network with its initial weights, <code>no-network</code> \
     the same clusterer on ½·position and normal, <code>growing-20</code> region growing at 20° on the points, \
     <code>labels-of-…</code> the labels of a source themselves, and <code>token-ceiling</code> the most that the tokens allow. \
     Δ has a 95 % interval, paired by shape.</p>\n";

/// The section with all tables. It is empty without scores.
pub(crate) fn score_tables(tables: &Tables, names: &Names<'_>) -> String {
    let mut body = String::new();
    for (idx, rows) in tables.rows.chunk_by(is_same_table).enumerate() {
        let TableRow {
            reference,
            clusterer,
            ..
        } = &rows[0];
        let title = format!(
            "Scored against <code>{}</code>, clusters by {}",
            escaped(reference),
            escaped(clusterer)
        );
        let difference = tables
            .differences
            .iter()
            .find(|row| row.reference == *reference && row.clusterer == *clusterer);
        let tables = tables_of(idx, rows, difference, names);
        let open = if idx == 0 { " open" } else { "" };
        let _ = write!(
            body,
            "<details class=\"table\"{open}><summary>{title}</summary>\n{tables}</details>\n"
        );
    }
    if !body.is_empty() {
        body.push_str(EXPLANATION);
    }
    section("scores", "Scores", "", &body)
}

fn is_same_table(a: &TableRow, b: &TableRow) -> bool {
    a.reference == b.reference && a.clusterer == b.clusterer
}

/// The table of the main metrics with the bins, and the table of the other metrics.
fn tables_of(
    idx: usize,
    rows: &[TableRow],
    difference: Option<&DifferenceRow>,
    names: &Names<'_>,
) -> String {
    let metrics: BTreeSet<Metric> = rows
        .iter()
        .flat_map(|row| row.means.keys().copied())
        .collect();
    let (further, main): (Vec<Metric>, Vec<Metric>) =
        metrics.into_iter().partition(Metric::is_secondary);
    let mut html = table(
        &format!("scores-{idx}"),
        "Means",
        rows,
        &main,
        true,
        difference,
        names,
    );
    if let Some(difference) = difference {
        let _ = writeln!(
            html,
            "<p class=\"power\">{}</p>",
            with_code(&difference.resolution())
        );
    }
    if !further.is_empty() {
        html.push_str(&table(
            &format!("further-{idx}"),
            "Further scores of the same clusters and embeddings",
            rows,
            &further,
            false,
            difference,
            names,
        ));
    }
    html
}

fn table(
    id: &str,
    caption: &str,
    rows: &[TableRow],
    metrics: &[Metric],
    with_bins: bool,
    difference: Option<&DifferenceRow>,
    names: &Names<'_>,
) -> String {
    let bins: Vec<usize> = (0..rows[0].bins.len())
        .filter(|&bin| {
            with_bins
                && rows
                    .iter()
                    .any(|row| row.bins.get(bin).is_some_and(|mean| mean.n_shapes > 0))
        })
        .collect();
    let mut table = SortableTable::new(id, caption).column("supervision", false);
    if rows.len() > 6 {
        table = table.with_filter("part of a name");
    }
    for metric in metrics {
        table = table.column(metric.heading, true);
    }
    for &bin in &bins {
        let mean = rows[0].bins[bin];
        table = table.column(&format!("K {} ({})", mean.bin.name(), mean.n_shapes), true);
    }
    table = table.column("shapes", true).column("seeds", true);
    for row in rows {
        let mut cells = vec![Cell::html(names.swatch(&row.supervision))];
        cells.extend(
            metrics
                .iter()
                .map(|metric| score_cell(row.means.get(metric).copied())),
        );
        cells.extend(
            bins.iter()
                .map(|&bin| score_cell(row.bins.get(bin).and_then(|mean| mean.miou))),
        );
        for count in [row.n_shapes, row.n_seeds] {
            cells.push(Cell::number(Some(count as f64), &count.to_string()));
        }
        table.row("", &cells);
    }
    if let Some(row) = difference {
        table.foot_row(&difference_cells(row, metrics, bins.len()));
    }
    table.to_html()
}

/// A number with a bar, if it is a fraction.
fn score_cell(value: Option<f64>) -> Cell {
    let cell = Cell::score(value);
    match value {
        Some(value) if (0.0..=1.0).contains(&value) => cell.with_bar(),
        _ => cell,
    }
}

fn difference_cells(row: &DifferenceRow, metrics: &[Metric], n_bins: usize) -> Vec<Cell> {
    let [first, second] = &row.compared;
    let mut cells = vec![Cell::html(format!(
        "Δ {} − {}",
        escaped(first),
        escaped(second)
    ))];
    cells.extend(
        metrics
            .iter()
            .map(|metric| match row.differences.get(metric) {
                Some(found) => Cell::number_html(found.mean, difference_html(found)),
                None => Cell::number(None, "–"),
            }),
    );
    cells.extend((0..n_bins).map(|_| Cell::text("")));
    cells.push(Cell::number(
        Some(row.n_shapes as f64),
        &row.n_shapes.to_string(),
    ));
    cells.push(Cell::text(""));
    cells
}

/// A difference with its sign and its interval, as in `+0.031 [+0.012, +0.050]`.
pub(crate) fn difference_text(difference: &Difference) -> String {
    let mean = signed(difference.mean);
    match difference.interval {
        Some(interval) => format!(
            "{mean} [{}, {}]",
            signed(interval.low),
            signed(interval.high)
        ),
        None => mean,
    }
}

/// The same on two lines, so that columns are narrow.
fn difference_html(difference: &Difference) -> String {
    let text = escaped(&difference_text(difference));
    match text.split_once(' ') {
        Some((mean, interval)) => format!("{mean}<br><small>{interval}</small>"),
        None => text,
    }
}

fn signed(value: f64) -> String {
    format!("{value:+.3}").replace('-', "−")
}
