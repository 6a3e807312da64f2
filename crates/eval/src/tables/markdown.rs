//! Writes tables as Markdown, for people.

use super::{DifferenceRow, HomeAdvantage, TableRow, Tables};
use crate::k_bin::KBin;
use crate::metric::Metric;
use crate::metrics::MIOU;
use crate::paired::Difference;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The note below the tables.
const MEANS_NOTE: &str = "\nMeans are over shapes with 2 to 19 reference parts; K bins hold their mean mIoU, in brackets their shapes.\n";

impl Tables {
    /// One Markdown table per reference and clusterer, with three decimals per number.
    ///
    /// A bin shows its mean mIoU and, in brackets, its number of shapes. The Δ row shows 95 % intervals.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = String::new();
        for rows in self.rows.chunk_by(is_same_table) {
            let separator = if text.is_empty() { "" } else { "\n" };
            let TableRow {
                reference,
                clusterer,
                ..
            } = &rows[0];
            let _ = writeln!(
                text,
                "{separator}Scored against `{reference}`, clusters by {clusterer}:\n"
            );
            let of_table = self.differences_of(reference, clusterer);
            let mut differences: Vec<(String, &DifferenceRow)> = Vec::new();
            for row in &of_table {
                differences.push((difference_name("Δ", &row.compared), row));
            }
            let same_source = self.same_source.iter();
            let same_source = same_source
                .filter(|row| row.reference == *reference && row.clusterer == *clusterer);
            differences.extend(same_source.map(|row| (difference_name("A/A", &row.compared), row)));
            MarkdownTable::of(rows).push_to(&mut text, &differences);

            let further = MarkdownTable::of_secondary(rows);
            if !further.metrics.is_empty() {
                text.push_str("\nFurther scores of the same clusters and embeddings:\n\n");
                further.push_to(&mut text, &differences);
            }
            for difference in of_table {
                let _ = writeln!(text, "\n{}", difference.resolution());
            }
            for sentence in &self.footer {
                let _ = writeln!(text, "\n{sentence}");
            }
        }
        self.push_home_advantages(&mut text);
        text.push_str(&self.decisions());
        text.push_str(&self.dose_response());
        if !text.is_empty() {
            text.push_str(MEANS_NOTE);
        }
        text
    }

    /// What is next to the tables of scores: the primary endpoints, the home advantages, the comparisons of trainings that differ
    /// only in their seed, and the sentences below the tables.
    #[must_use]
    pub fn statistics_markdown(&self) -> String {
        let mut text = self.decisions();
        self.push_home_advantages(&mut text);
        if !self.same_source.is_empty() {
            text.push_str(
                "\nTrainings that differ only in their seed (A/A). Each difference is chance:\n\n\
                 | pair | reference | clusters by | Δ mIoU | shapes |\n|---|---|---|---:|---:|\n",
            );
        }
        for row in &self.same_source {
            if let found @ Some(_) = row.differences.get(&MIOU) {
                let [first, second] = &row.compared;
                let _ = writeln!(
                    text,
                    "| `{first}` − `{second}` | `{}` | {} | {} | {} |",
                    row.reference,
                    row.clusterer,
                    difference_cell(found),
                    row.n_shapes
                );
            }
        }
        for sentence in &self.footer {
            let _ = writeln!(text, "\n{sentence}");
        }
        text
    }

    fn push_home_advantages(&self, text: &mut String) {
        for rows in self
            .home_advantages
            .chunk_by(|a, b| a.clusterer == b.clusterer)
        {
            let _ = writeln!(
                text,
                "\nHome advantage H = [(S − N) scored on S] − [(N − S) scored on N], clusters by {}:\n",
                rows[0].clusterer
            );
            push_home_table(text, rows);
            if rows
                .iter()
                .any(|row| row.differences.keys().any(Metric::is_error))
            {
                let _ = writeln!(
                    text,
                    "\nFor the count error, H below 0 is the advantage of S, because smaller errors are better."
                );
            }
        }
    }

    fn differences_of(&self, reference: &str, clusterer: &str) -> Vec<&DifferenceRow> {
        self.differences
            .iter()
            .filter(|row| row.reference == reference && row.clusterer == clusterer)
            .collect()
    }
}

/// Appends a table with one row per pair of supervisions and one column per metric.
fn push_home_table(text: &mut String, rows: &[HomeAdvantage]) {
    let metrics: BTreeSet<Metric> = rows
        .iter()
        .flat_map(|row| row.differences.keys().copied())
        .collect();
    let mut headings = vec!["S, N".to_owned()];
    headings.extend(metrics.iter().map(|metric| metric.heading.to_owned()));
    headings.extend(["shapes", "groups"].map(str::to_owned));
    push_line(text, &headings);
    let _ = writeln!(text, "|---|{}", "---:|".repeat(headings.len() - 1));
    for row in rows {
        let [s, n] = &row.compared;
        let mut cells = vec![format!("`{s}`, `{n}`")];
        cells.extend(
            metrics
                .iter()
                .map(|metric| difference_cell(row.differences.get(metric))),
        );
        cells.extend([row.n_shapes, row.n_groups].map(|n| n.to_string()));
        push_line(text, &cells);
    }
}

/// The name of the row of a difference.
fn difference_name(sign: &str, [first, second]: &[String; 2]) -> String {
    format!("{sign} `{first}` − `{second}`")
}

fn is_same_table(a: &TableRow, b: &TableRow) -> bool {
    a.reference == b.reference && a.clusterer == b.clusterer
}

/// The rows of one table, and the columns of it that are not empty in all of them.
struct MarkdownTable<'a> {
    rows: &'a [TableRow],
    metrics: BTreeSet<Metric>,
    /// Indices in [`KBin::ALL`].
    bins: Vec<usize>,
    /// Whether the bins allow the paper's mix.
    has_paper_mix: bool,
}

fn metrics_of(rows: &[TableRow]) -> impl Iterator<Item = Metric> {
    rows.iter().flat_map(|row| row.means.keys().copied())
}

impl<'a> MarkdownTable<'a> {
    /// The metrics that are not in the second table, with the bins.
    fn of(rows: &'a [TableRow]) -> Self {
        let has_shapes = |bin: &usize| rows.iter().any(|row| row.bins[*bin].n_shapes > 0);
        Self {
            rows,
            metrics: metrics_of(rows)
                .filter(|metric| !metric.is_secondary())
                .collect(),
            bins: (0..KBin::ALL.len()).filter(has_shapes).collect(),
            has_paper_mix: rows.iter().any(|row| row.miou_at_paper_mix.is_some()),
        }
    }

    /// The metrics of the second table.
    fn of_secondary(rows: &'a [TableRow]) -> Self {
        Self {
            rows,
            metrics: metrics_of(rows).filter(Metric::is_secondary).collect(),
            bins: Vec::new(),
            has_paper_mix: false,
        }
    }

    fn push_to(&self, text: &mut String, differences: &[(String, &DifferenceRow)]) {
        let headings = self.headings();
        push_line(text, &headings);
        let _ = writeln!(text, "|---|{}", "---:|".repeat(headings.len() - 1));
        for row in self.rows {
            push_line(text, &self.cells(row));
        }
        for (name, difference) in differences {
            push_line(text, &self.difference_cells(name, difference));
        }
    }

    fn headings(&self) -> Vec<String> {
        let mut cells = vec!["supervision".to_owned()];
        cells.extend(self.metrics.iter().map(|metric| metric.heading.to_owned()));
        let names = self.bins.iter().map(|&bin| KBin::ALL[bin].name());
        cells.extend(names.map(|name| format!("K {name}")));
        if self.has_paper_mix {
            cells.push("paper's mix".to_owned());
        }
        cells.push("shapes".to_owned());
        cells
    }

    fn cells(&self, row: &TableRow) -> Vec<String> {
        let mut cells = vec![format!("`{}`", row.supervision)];
        for metric in &self.metrics {
            cells.push(match row.means.get(metric) {
                Some(mean) => format!("{mean:.3}"),
                None => "–".to_owned(),
            });
        }
        for &bin in &self.bins {
            cells.push(match row.bins[bin].miou {
                Some(miou) => format!("{miou:.3} ({})", row.bins[bin].n_shapes),
                None => "–".to_owned(),
            });
        }
        if self.has_paper_mix {
            let miou = row.miou_at_paper_mix;
            cells.push(miou.map_or_else(|| "–".to_owned(), |miou| format!("{miou:.3}")));
        }
        cells.push(row.n_shapes.to_string());
        cells
    }

    fn difference_cells(&self, name: &str, row: &DifferenceRow) -> Vec<String> {
        let mut cells = vec![name.to_owned()];
        for metric in &self.metrics {
            cells.push(difference_cell(row.differences.get(metric)));
        }
        let n_empty = self.bins.len() + usize::from(self.has_paper_mix);
        cells.extend(std::iter::repeat_n(String::new(), n_empty));
        cells.push(row.n_shapes.to_string());
        cells
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
            ..
        }) => {
            format!("{mean:+.3} [{:+.3}, {:+.3}]", interval.low, interval.high)
        }
        Some(Difference {
            mean,
            interval: None,
            ..
        }) => format!("{mean:+.3}"),
        None => "–".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use crate::tables::tests::{example, settings};
    use crate::tables::{TableSettings, tables};

    #[test]
    fn markdown_shows_means_bins_and_the_difference() {
        let settings = TableSettings {
            footer: vec!["θ 8°.".to_owned()],
            ..settings()
        };
        let text = tables(&example(), &settings).to_markdown();
        let expected = "\
Scored against `step-parts`, clusters by k-means:

| supervision | mIoU | accuracy | GTc accuracy | GTc mIoU | K 1 | K 2-4 | K 5-9 | K 10-19 | K 20+ | shapes |
|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|
| `step-parts` | 0.625 | 0.812 | 0.900 | 0.800 | 0.750 (1) | 0.562 (1) | 0.625 (1) | 0.688 (1) | 0.812 (1) | 3 |
| `brep-face` | 0.375 | 0.688 | 0.900 | 0.800 | 0.500 (1) | 0.312 (1) | 0.375 (1) | 0.438 (1) | 0.562 (1) | 3 |
| `untrained` | 0.250 | 0.625 | 0.900 | 0.800 | 0.250 (1) | 0.250 (1) | 0.250 (1) | 0.250 (1) | 0.250 (1) | 3 |
| `no-network` | 0.125 | 0.562 | – | – | 0.125 (1) | 0.125 (1) | 0.125 (1) | 0.125 (1) | 0.125 (1) | 3 |
| Δ `step-parts` − `brep-face` | +0.250 [+0.250, +0.250] | +0.125 [+0.125, +0.125] | +0.000 [+0.000, +0.000] | +0.000 [+0.000, +0.000] |  |  |  |  |  | 3 |
| A/A `step-parts, seed 0` − `step-parts, seed 1` | -0.125 [-0.125, -0.125] | -0.062 [-0.062, -0.062] | +0.000 [+0.000, +0.000] | +0.000 [+0.000, +0.000] |  |  |  |  |  | 3 |
| A/A `brep-face, seed 0` − `brep-face, seed 1` | -0.125 [-0.125, -0.125] | -0.062 [-0.062, -0.062] | +0.000 [+0.000, +0.000] | +0.000 [+0.000, +0.000] |  |  |  |  |  | 3 |

Δ `step-parts` − `brep-face`: 3 shapes in 2 groups of related shapes (effectively 1.8) resolve a difference of mIoU of ±0.000.

θ 8°.

2 of 4 secondary differences have a corrected p below 0.05: `step-parts` − `brep-face` on `step-parts`, mIoU by k-means +0.250; \
`step-parts` − `brep-face` on `step-parts`, accuracy by k-means +0.125.

Two seeds tell little about the variance between trainings. Train three seeds or more.

Means are over shapes with 2 to 19 reference parts; K bins hold their mean mIoU, in brackets their shapes.
";
        assert_eq!(text, expected);
    }
}
