//! Writes the tables as Markdown for people, CSV for spreadsheets and JSON for programs.

use super::rows::{AgreementMetric, AgreementRow, RefusedShape};
use super::shape::BANDS;
use super::statistic::Statistic;
use super::tables::{AgreementTable, AgreementTables, CAP, CurvePoint};
use crate::k_bin::KBin;
use std::collections::BTreeMap;
use std::fmt::Write as _;

impl AgreementTables {
    /// The tables in Markdown: for each channel the scores, the bands, the K bins and the two curves.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = String::new();
        let settings = &self.settings;
        for channel in &settings.channels {
            let of_channel = |table: &&AgreementTable| table.channel == *channel;
            let tables: Vec<&AgreementTable> = self.tables.iter().filter(of_channel).collect();
            if tables.is_empty() {
                continue;
            }
            let separator = if text.is_empty() { "" } else { "\n" };
            let _ = writeln!(
                text,
                "{separator}Agreement with `{}` at {} points per shape, labels by `{channel}` \
                 (mean ± standard deviation over shapes, 95 % interval of the mean):\n",
                settings.reference, settings.n_points
            );
            push_scores(&mut text, &tables);
            push_ceilings(&mut text, &tables);
            push_counts(&mut text, &tables);
            push_bands(&mut text, &tables);
            push_bins(&mut text, &tables);
            push_curve(
                &mut text,
                &tables,
                "distance to the nearest border of the reference",
                |table| &table.by_distance,
            );
            push_curve(&mut text, &tables, "local thickness", |table| {
                &table.by_thickness
            });
        }
        text.push_str(&refused_lines(&self.refused));
        text
    }

    /// The table of a comparison of tessellations: one row per source and pair. The reference is the first tessellation.
    #[must_use]
    pub fn to_tessellation_markdown(&self) -> String {
        let names = [
            "accuracy",
            "miou",
            "boundary_0.5",
            "ceiling_accuracy",
            "ceiling_miou",
        ];
        let counts = ["n_reference", "n_labels"];
        let mut text = format!(
            "Self-consistency at {} points per shape, drawn on `{}` (mean ± standard deviation over shapes):\n\n\
             | source | tessellations | shapes | self-accuracy | self-mIoU | boundary 0.5 % | accuracy, ceiling | \
             mIoU, ceiling | labels on {} | labels on the other |\n|---|---|---:|---:|---:|---:|---:|---:|---:|---:|\n",
            self.settings.n_points, self.settings.reference, self.settings.reference
        );
        for source in &self.settings.sources {
            for table in self.tables.iter().filter(|table| table.source == *source) {
                let score = |name: &&str| with_deviation(table.statistics.get(*name), 3);
                let count = |name: &&str| with_deviation(table.statistics.get(*name), 1);
                let cells: Vec<String> = names
                    .iter()
                    .map(score)
                    .chain(counts.iter().map(count))
                    .collect();
                let _ = writeln!(
                    text,
                    "| `{source}` | {}, {} | {} | {} |",
                    self.settings.reference,
                    table.channel,
                    table.n_shapes,
                    cells.join(" | ")
                );
            }
        }
        text + &refused_lines(&self.refused)
    }

    /// One line per channel, source and number, with six decimals.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let mut text = String::from("channel,source,number,mean,deviation,low,high,n_shapes\n");
        for table in &self.tables {
            for (name, statistic) in ordered(table) {
                let head = format!("{},{},{name}", table.channel, csv_field(&table.source));
                push_csv_statistic(&mut text, &head, statistic);
            }
        }
        text
    }

    /// One line per point of the two curves, with six decimals.
    #[must_use]
    pub fn curves_csv(&self) -> String {
        let mut text = String::from(
            "channel,source,curve,from,to,fraction_of_points,mean,deviation,low,high,n_shapes\n",
        );
        for table in &self.tables {
            let curves = [
                ("distance", &table.by_distance),
                ("thickness", &table.by_thickness),
            ];
            for (name, points) in curves {
                for point in points {
                    let to = point.to.map(|to| to.to_string()).unwrap_or_default();
                    let head = format!(
                        "{},{},{name},{},{to},{:.6}",
                        table.channel,
                        csv_field(&table.source),
                        point.from,
                        point.fraction_of_points
                    );
                    match &point.accuracy {
                        Some(accuracy) => push_csv_statistic(&mut text, &head, accuracy),
                        None => {
                            let _ = writeln!(text, "{head},,,,,0");
                        }
                    }
                }
            }
        }
        text
    }

    /// One line per shape that a source refused.
    #[must_use]
    pub fn refused_csv(&self) -> String {
        let line = |refused: &RefusedShape| {
            let fields = [&refused.source, &refused.shape, &refused.reason];
            fields.map(|field| csv_field(field)).join(",") + "\n"
        };
        let lines: String = self.refused.iter().map(line).collect();
        format!("source,shape,reason\n{lines}")
    }

    /// Everything, in full precision.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Maps with text keys, numbers and text always serialize. The fallback only avoids a panic.
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .unwrap_or_default()
    }
}

impl AgreementRow {
    /// The first line of a CSV file of rows.
    #[must_use]
    pub fn csv_header() -> String {
        let names = AgreementMetric::ALL.map(|metric| metric.name);
        format!("shape,source,channel,{}\n", names.join(","))
    }

    /// The row as a line of a CSV file, with six decimals. A number that the shape does not have is empty.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let value = |metric: AgreementMetric| {
            (metric.of)(self).map_or_else(String::new, |value| format!("{value:.6}"))
        };
        format!(
            "{},{},{},{}\n",
            csv_field(&self.shape),
            csv_field(&self.source),
            self.channel,
            AgreementMetric::ALL.map(value).join(",")
        )
    }
}

/// The numbers of a table in the order of [`AgreementMetric::ALL`].
fn ordered(table: &AgreementTable) -> impl Iterator<Item = (&'static str, &Statistic)> {
    let found = |metric: AgreementMetric| Some((metric.name, table.statistics.get(metric.name)?));
    AgreementMetric::ALL.into_iter().filter_map(found)
}

fn push_csv_statistic(text: &mut String, head: &str, statistic: &Statistic) {
    let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.6}"));
    let _ = writeln!(
        text,
        "{head},{:.6},{},{},{},{}",
        statistic.mean,
        number(statistic.deviation),
        number(statistic.interval.map(|interval| interval.low)),
        number(statistic.interval.map(|interval| interval.high)),
        statistic.n_shapes
    );
}

fn push_scores(text: &mut String, tables: &[&AgreementTable]) {
    let names = ["accuracy", "miou", "boundary_0.5", "ari"];
    push_table(text, &headings(&names, &["shapes"]), tables, |table| {
        let cell = |name: &str| with_interval(table.statistics.get(name));
        let mut cells: Vec<String> = names.iter().map(|name| cell(name)).collect();
        cells.push(table.n_shapes.to_string());
        cells
    });
}

fn push_ceilings(text: &mut String, tables: &[&AgreementTable]) {
    let names = ["ceiling_accuracy", "ceiling_miou", "ceiling_boundary_0.5"];
    let _ = writeln!(
        text,
        "\nTransfer ceilings (the reference through the same channel):\n"
    );
    push_table(text, &headings(&names, &[]), tables, |table| {
        names
            .iter()
            .map(|name| with_deviation(table.statistics.get(*name), 3))
            .collect()
    });
}

fn push_counts(text: &mut String, tables: &[&AgreementTable]) {
    let names = ["n_reference", "n_labels", "n_merges", "n_splits"];
    let at_cap = format!("shapes with {CAP} labels or more");
    let _ = writeln!(text, "\nParts, labels, merges and splits per shape:\n");
    push_table(text, &headings(&names, &[&at_cap]), tables, |table| {
        let cell = |name: &str| with_deviation(table.statistics.get(name), 1);
        let mut cells: Vec<String> = names.iter().map(|name| cell(name)).collect();
        cells.push(format!("{:.0} %", 100.0 * table.fraction_at_cap));
        cells
    });
}

fn push_bands(text: &mut String, tables: &[&AgreementTable]) {
    let names = ["boundary_0.25", "boundary_0.5", "boundary_1", "boundary_2"];
    debug_assert_eq!(names.len(), BANDS.len());
    let _ = writeln!(
        text,
        "\nAccuracy in bands around the borders of the reference:\n"
    );
    push_table(text, &headings(&names, &[]), tables, |table| {
        names
            .iter()
            .map(|name| with_deviation(table.statistics.get(*name), 3))
            .collect()
    });
}

fn push_bins(text: &mut String, tables: &[&AgreementTable]) {
    let is_used = |&idx: &usize| tables.iter().any(|table| table.bins[idx].n_shapes > 0);
    let used: Vec<usize> = (0..KBin::ALL.len()).filter(is_used).collect();
    let heading = |&idx: &usize| format!("K {}", KBin::ALL[idx].name());
    let headings: Vec<String> = used.iter().map(heading).collect();
    let _ = writeln!(
        text,
        "\nAccuracy / mIoU / boundary 0.5 % by the number of reference parts, in brackets the shapes:\n"
    );
    push_table(text, &headings, tables, |table| {
        let cell = |&idx: &usize| {
            let bin = &table.bins[idx];
            let [accuracy, miou, boundary] =
                [bin.accuracy, bin.miou, bin.boundary].map(|found| mean(found.as_ref(), 2));
            format!("{accuracy} / {miou} / {boundary} ({})", bin.n_shapes)
        };
        used.iter().map(cell).collect()
    });
}

fn push_curve(
    text: &mut String,
    tables: &[&AgreementTable],
    what: &str,
    points_of: fn(&AgreementTable) -> &Vec<CurvePoint>,
) {
    let heading = |point: &CurvePoint| match point.to {
        Some(to) => format!("≤ {}", 100.0 * to),
        None => format!("> {}", 100.0 * point.from),
    };
    let headings: Vec<String> = points_of(tables[0]).iter().map(heading).collect();
    let _ = writeln!(text, "\nAccuracy by the {what}, in % of the diagonal:\n");
    push_table(text, &headings, tables, |table| {
        let cell = |point: &CurvePoint| mean(point.accuracy.as_ref(), 3);
        points_of(table).iter().map(cell).collect()
    });
}

fn headings(names: &[&str], others: &[&str]) -> Vec<String> {
    let of_metric = |name: &&str| {
        AgreementMetric::named(name)
            .map_or_else(|| (*name).to_owned(), |found| found.heading.to_owned())
    };
    let others = others.iter().map(|other| (*other).to_owned());
    names.iter().map(of_metric).chain(others).collect()
}

fn push_table(
    text: &mut String,
    headings: &[String],
    tables: &[&AgreementTable],
    cells_of: impl Fn(&AgreementTable) -> Vec<String>,
) {
    let _ = writeln!(text, "| source | {} |", headings.join(" | "));
    let _ = writeln!(text, "|---|{}", "---:|".repeat(headings.len()));
    for table in tables {
        let _ = writeln!(
            text,
            "| `{}` | {} |",
            table.source,
            cells_of(table).join(" | ")
        );
    }
}

fn mean(statistic: Option<&Statistic>, decimals: usize) -> String {
    statistic.map_or_else(
        || "–".to_owned(),
        |found| format!("{:.decimals$}", found.mean),
    )
}

fn with_deviation(statistic: Option<&Statistic>, decimals: usize) -> String {
    let mean = mean(statistic, decimals);
    match statistic.and_then(|found| found.deviation) {
        Some(deviation) => format!("{mean} ± {deviation:.decimals$}"),
        None => mean,
    }
}

fn with_interval(statistic: Option<&Statistic>) -> String {
    let cell = with_deviation(statistic, 3);
    match statistic.and_then(|found| found.interval) {
        Some(interval) => format!("{cell} [{:.3}, {:.3}]", interval.low, interval.high),
        None => cell,
    }
}

/// A list of the refusals: for each source and reason, the number of shapes and the first of them. It is empty if nothing was
/// refused.
pub(super) fn refused_lines(refused: &[RefusedShape]) -> String {
    let mut by_reason: BTreeMap<(&str, &str), Vec<&str>> = BTreeMap::new();
    for RefusedShape {
        source,
        shape,
        reason,
    } in refused
    {
        by_reason.entry((source, reason)).or_default().push(shape);
    }
    let mut text = String::new();
    if !by_reason.is_empty() {
        text.push_str("\nRefused:\n\n");
    }
    for ((source, reason), shapes) in by_reason {
        let noun = if shapes.len() == 1 { "shape" } else { "shapes" };
        let _ = writeln!(
            text,
            "- `{source}`, {} {noun}, first `{}`: {reason}",
            shapes.len(),
            shapes[0]
        );
    }
    text
}

/// The text in quotation marks if a comma, a quotation mark or a line end in it would break the line.
pub(super) fn csv_field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tables::agreement_tables;
    use super::super::tables::tests::{example, settings};
    use super::*;

    #[test]
    fn every_source_has_a_row_in_each_table() {
        let text = agreement_tables(&example(), Vec::new(), settings()).to_markdown();
        let n_rows = |source: &str| {
            text.lines()
                .filter(|line| line.starts_with(&format!("| `{source}` |")))
                .count()
        };
        assert_eq!((n_rows("x"), n_rows("y"), n_rows("z")), (7, 7, 0), "{text}");
        assert!(
            text.contains("| `x` | 0.875 ± 0.177 [0.750, 1.000] |"),
            "{text}"
        );
    }

    #[test]
    fn csv_lines_have_the_columns_of_their_header() {
        let found = agreement_tables(&example(), Vec::new(), settings());
        let rows: String = example().iter().map(AgreementRow::to_csv).collect();
        for csv in [
            found.to_csv(),
            found.curves_csv(),
            AgreementRow::csv_header() + &rows,
        ] {
            let columns: Vec<usize> = csv.lines().map(|line| line.split(',').count()).collect();
            assert!(
                columns.len() > 3 && columns.iter().all(|&n| n == columns[0]),
                "{csv}"
            );
        }
        assert_eq!(csv_field("a,\"b"), "\"a,\"\"b\"");
    }

    #[test]
    fn what_was_refused_is_counted_by_reason() {
        let refused = |shape: &str| RefusedShape {
            source: "color".to_owned(),
            shape: shape.to_owned(),
            reason: "no face has a color".to_owned(),
        };
        let found = agreement_tables(&example(), vec![refused("b"), refused("a")], settings());
        let text = found.to_markdown();
        assert!(
            text.ends_with("- `color`, 2 shapes, first `a`: no face has a color\n"),
            "{text}"
        );
    }

    #[test]
    fn json_holds_the_numbers() {
        let json = agreement_tables(&example(), Vec::new(), settings()).to_json();
        let found: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(found["reference"], "step-parts");
        assert_eq!(found["tables"][1]["statistics"]["accuracy"]["mean"], 0.875);
    }
}
