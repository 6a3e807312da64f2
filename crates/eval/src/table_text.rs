//! Tables as Markdown for people, CSV for spreadsheets and JSON for programs.

use crate::{Difference, DifferenceRow, KBin, Metric, TableRow, Tables};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// What stands below the tables.
const MEANS_NOTE: &str = "\nMeans are over shapes with 2 to 19 reference parts; K bins hold their mean mIoU, in brackets their shapes.\n";

impl Tables {
    /// One Markdown table for each reference and clusterer, three decimals a number.
    ///
    /// A bin shows its mean mIoU and, in brackets, its number of shapes; the Δ row shows 95 % intervals.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = String::new();
        let same_table = |a: &TableRow, b: &TableRow| {
            (&a.reference, &a.clusterer) == (&b.reference, &b.clusterer)
        };
        for rows in self.rows.chunk_by(same_table) {
            let (reference, clusterer) = (&rows[0].reference, &rows[0].clusterer);
            let separator = if text.is_empty() { "" } else { "\n" };
            let _ = writeln!(
                text,
                "{separator}Scored against `{reference}`, clusters by {clusterer}:\n"
            );
            let is_of_table =
                |row: &&DifferenceRow| (&row.reference, &row.clusterer) == (reference, clusterer);
            push_markdown_table(&mut text, rows, self.differences.iter().find(is_of_table));
        }
        if !text.is_empty() {
            text.push_str(MEANS_NOTE);
        }
        text
    }

    /// One line for each supervision, reference and clusterer, and one for each Δ; six decimals a number.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut text = String::from("reference,clusterer,supervision,n_seeds,n_shapes");
        for Metric { name, .. } in self.metrics() {
            let _ = write!(text, ",{name},{name}_low,{name}_high");
        }
        text.push_str(",miou_deviation");
        for bin in KBin::ALL {
            let _ = write!(text, ",miou_k_{0},n_k_{0}", bin.name());
        }
        text.push('\n');
        for row in &self.rows {
            push_csv_row(&mut text, row, &self.metrics());
        }
        for row in &self.differences {
            push_csv_difference(&mut text, row, &self.metrics());
        }
        text
    }

    /// Everything, in full precision.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps with text keys, numbers and text always serialize; the fallback keeps the function free of panics.
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .unwrap_or_default()
    }
}

fn push_markdown_table(text: &mut String, rows: &[TableRow], difference: Option<&DifferenceRow>) {
    let metrics: BTreeSet<Metric> = rows
        .iter()
        .flat_map(|row| row.means.keys().copied())
        .collect();
    let bins: Vec<usize> = (0..KBin::ALL.len())
        .filter(|&bin| rows.iter().any(|row| row.bins[bin].n_shapes > 0))
        .collect();
    let headings = metrics.iter().map(|metric| metric.heading.to_owned());
    let bin_headings = bins
        .iter()
        .map(|&bin| format!("K {}", KBin::ALL[bin].name()));
    let cells: Vec<String> = ["supervision".to_owned()]
        .into_iter()
        .chain(headings)
        .chain(bin_headings)
        .chain(["shapes".to_owned()])
        .collect();
    push_line(text, &cells);
    let _ = writeln!(text, "|---|{}", "---:|".repeat(cells.len() - 1));
    for row in rows {
        let means = metrics
            .iter()
            .map(|metric| optional(row.means.get(metric).copied(), 3));
        let bins = bins.iter().map(|&bin| match row.bins[bin].miou {
            Some(miou) => format!("{miou:.3} ({})", row.bins[bin].n_shapes),
            None => "–".to_owned(),
        });
        let name = [format!("`{}`", row.supervision)].into_iter();
        push_line(
            text,
            &name
                .chain(means)
                .chain(bins)
                .chain([row.n_shapes.to_string()])
                .collect::<Vec<_>>(),
        );
    }
    if let Some(difference) = difference {
        let [first, second] = &difference.compared;
        let name = [format!("Δ `{first}` − `{second}`")].into_iter();
        let values = metrics
            .iter()
            .map(|metric| difference_cell(difference.differences.get(metric)));
        let blanks = bins.iter().map(|_| String::new());
        let n_shapes = [difference.n_shapes.to_string()];
        push_line(
            text,
            &name
                .chain(values)
                .chain(blanks)
                .chain(n_shapes)
                .collect::<Vec<_>>(),
        );
    }
}

fn push_line(text: &mut String, cells: &[String]) {
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

fn difference_cell(difference: Option<&Difference>) -> String {
    match difference {
        Some(Difference {
            mean,
            interval: Some(interval),
        }) => {
            format!("{mean:+.3} [{:+.3}, {:+.3}]", interval.low, interval.high)
        }
        Some(Difference {
            mean,
            interval: None,
        }) => format!("{mean:+.3}"),
        None => "–".to_owned(),
    }
}

fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.decimals$}"))
}

fn push_csv_row(text: &mut String, row: &TableRow, metrics: &BTreeSet<Metric>) {
    let (reference, clusterer, supervision) = (
        csv_field(&row.reference),
        csv_field(&row.clusterer),
        csv_field(&row.supervision),
    );
    let _ = write!(
        text,
        "{reference},{clusterer},{supervision},{},{}",
        row.n_seeds, row.n_shapes
    );
    for metric in metrics {
        let _ = write!(text, ",{},,", csv_number(row.means.get(metric).copied()));
    }
    let _ = write!(text, ",{}", csv_number(row.miou_deviation));
    for bin in &row.bins {
        let _ = write!(text, ",{},{}", csv_number(bin.miou), bin.n_shapes);
    }
    text.push('\n');
}

fn push_csv_difference(text: &mut String, row: &DifferenceRow, metrics: &BTreeSet<Metric>) {
    let [first, second] = &row.compared;
    let (reference, clusterer) = (csv_field(&row.reference), csv_field(&row.clusterer));
    let compared = csv_field(&format!("{first} - {second}"));
    let _ = write!(text, "{reference},{clusterer},{compared},,{}", row.n_shapes);
    for metric in metrics {
        let difference = row.differences.get(metric);
        let interval = difference.and_then(|difference| difference.interval);
        let numbers = [
            difference.map(|found| found.mean),
            interval.map(|found| found.low),
            interval.map(|found| found.high),
        ];
        let _ = write!(text, ",{}", numbers.map(csv_number).join(","));
    }
    let n_blanks = 1 + 2 * KBin::ALL.len();
    let _ = writeln!(text, "{}", ",".repeat(n_blanks));
}

fn csv_number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.6}"))
}

/// A field in quotes where the format asks for them.
fn csv_field(field: &str) -> String {
    let needs_quotes = field.contains([',', '"', '\n', '\r']);
    if needs_quotes {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables;
    use crate::tables::tests::{example, settings};

    #[test]
    fn markdown_shows_means_bins_and_the_difference() {
        let text = tables(&example(), &settings()).to_markdown();
        let expected = "\
Scored against `step-parts`, clusters by k-means:

| supervision | mIoU | accuracy | GTc accuracy | GTc mIoU | K 1 | K 2-4 | K 5-9 | K 10-19 | K 20+ | shapes |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| `step-parts` | 0.625 | 0.812 | 0.900 | 0.800 | 0.750 (1) | 0.562 (1) | 0.625 (1) | 0.688 (1) | 0.812 (1) | 3 |
| `brep-face` | 0.375 | 0.688 | 0.900 | 0.800 | 0.500 (1) | 0.312 (1) | 0.375 (1) | 0.438 (1) | 0.562 (1) | 3 |
| `untrained` | 0.250 | 0.625 | 0.900 | 0.800 | 0.250 (1) | 0.250 (1) | 0.250 (1) | 0.250 (1) | 0.250 (1) | 3 |
| `no-network` | 0.125 | 0.562 | – | – | 0.125 (1) | 0.125 (1) | 0.125 (1) | 0.125 (1) | 0.125 (1) | 3 |
| Δ `step-parts` − `brep-face` | +0.250 [+0.250, +0.250] | +0.125 [+0.125, +0.125] | +0.000 [+0.000, +0.000] | +0.000 [+0.000, +0.000] |  |  |  |  |  | 3 |

Means are over shapes with 2 to 19 reference parts; K bins hold their mean mIoU, in brackets their shapes.
";
        assert_eq!(text, expected);
    }

    #[test]
    fn every_csv_line_has_as_many_fields_as_the_head() {
        let text = tables(&example(), &settings()).to_csv();
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [28; 6]);
        assert!(
            text.contains("\nstep-parts,k-means,no-network,1,3,0.125000,,,0.562500,,,,,,,,,"),
            "{text}"
        );
        assert!(
            text.contains(
                "\nstep-parts,k-means,step-parts - brep-face,,3,0.250000,0.250000,0.250000,"
            ),
            "{text}"
        );
    }

    #[test]
    fn json_holds_every_number() {
        let json: serde_json::Value =
            serde_json::from_str(&tables(&example(), &settings()).to_json()).unwrap();
        assert_eq!(json["rows"][0]["means"]["miou"], 0.625);
        assert_eq!(json["rows"][0]["bins"][4]["bin"], "20+");
        assert_eq!(
            json["differences"][0]["differences"]["accuracy"]["interval"]["low"],
            0.125
        );
    }

    #[test]
    fn quotes_stand_where_csv_asks_for_them() {
        assert_eq!(
            ["a", "a,b", "a\"b"].map(csv_field),
            ["a", "\"a,b\"", "\"a\"\"b\""]
        );
    }
}
