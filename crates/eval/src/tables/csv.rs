//! Writes tables as CSV, for spreadsheets.

use super::{DifferenceRow, TableRow, Tables};
use crate::k_bin::KBin;
use crate::metric::Metric;
use std::collections::BTreeSet;
use std::fmt::Write as _;

impl Tables {
    /// One line per supervision, reference and clusterer, and one per Δ, with six decimals per number.
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
}

fn push_csv_row(text: &mut String, row: &TableRow, metrics: &BTreeSet<Metric>) {
    let reference = csv_field(&row.reference);
    let clusterer = csv_field(&row.clusterer);
    let supervision = csv_field(&row.supervision);
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
    let reference = csv_field(&row.reference);
    let clusterer = csv_field(&row.clusterer);
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
    // A difference has no deviation between shapes and no bins.
    let n_blanks = 1 + 2 * KBin::ALL.len();
    let _ = writeln!(text, "{}", ",".repeat(n_blanks));
}

fn csv_number(value: Option<f64>) -> String {
    value.map_or_else(String::new, |value| format!("{value:.6}"))
}

/// A field, in quotes if the format needs them.
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
    use crate::metrics::METRICS;
    use crate::tables::tables;
    use crate::tables::tests::{example, settings};

    #[test]
    fn every_csv_line_has_as_many_fields_as_the_head() {
        let text = tables(&example(), &settings()).to_csv();
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [16 + 3 * METRICS.len(); 6]);
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
    fn fields_are_quoted_only_if_csv_needs_it() {
        assert_eq!(
            ["a", "a,b", "a\"b"].map(csv_field),
            ["a", "\"a,b\"", "\"a\"\"b\""]
        );
    }
}
