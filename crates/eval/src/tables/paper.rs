//! Compares the numbers of a run with those that the STEP-Parts paper prints for its probe.
//!
//! The paper compares STEP-Parts with PartField. A run compares its first two label sources. Its tables are copied as printed
//! (section "Point-Based Downstream Probe with PTv3"). The two are not directly comparable: networks, shapes and numbers of parts
//! differ.

use super::{TableRow, Tables};
use crate::k_bin::KBin;
use crate::metrics::{ACCURACY, GTC_ACCURACY, MIOU};
use std::fmt::Write as _;

/// One row of the paper: a supervision under one referee. GTc is a fraction of points.
struct Printed {
    miou: f64,
    accuracy: f64,
    gtc: f64,
    /// K 2–4, 5–9, 10–19.
    bins: [f64; 3],
}

/// By referee (STEP-Parts, then PartField), and then by supervision in the same order.
const PAPER: [[Printed; 2]; 2] = [
    [
        Printed {
            miou: 0.60,
            accuracy: 0.76,
            gtc: 0.79,
            bins: [0.71, 0.58, 0.51],
        },
        Printed {
            miou: 0.51,
            accuracy: 0.68,
            gtc: 0.68,
            bins: [0.66, 0.45, 0.39],
        },
    ],
    [
        Printed {
            miou: 0.57,
            accuracy: 0.72,
            gtc: 0.69,
            bins: [0.68, 0.55, 0.46],
        },
        Printed {
            miou: 0.52,
            accuracy: 0.69,
            gtc: 0.66,
            bins: [0.68, 0.49, 0.39],
        },
    ],
];

const PAPER_SOURCES: [&str; 2] = ["STEP-Parts", "PartField"];

const BINS: [KBin; 3] = [KBin::K2To4, KBin::K5To9, KBin::K10To19];

impl Tables {
    /// The three probe tables of the paper, with the rows of this run below the paper's. Returns `None` unless both label sources
    /// are supervisions and references of the run.
    #[must_use]
    pub fn paper_comparison(&self, sources: [&str; 2]) -> Option<String> {
        let clusterer = self.clusterer.as_str();
        let mut rows: Vec<[&TableRow; 2]> = Vec::new();
        for reference in sources {
            let of_reference = |supervision| self.row(supervision, reference, clusterer);
            rows.push([of_reference(sources[0])?, of_reference(sources[1])?]);
        }
        let mut text = String::from(
            "The paper's numbers are of its own shapes and of PartField; \"this run\" has other shapes, another network and another second \
             source.\n\nScored against STEP-Parts:\n\n\
             | | supervision | mIoU | accuracy | K 2-4 | K 5-9 | K 10-19 |\n|---|---|---:|---:|---:|---:|---:|\n",
        );
        push_probe(&mut text, sources, &rows[0]);
        text.push_str(
            "\nScored against either source:\n\n\
             | | supervision | mIoU | accuracy | GTc | mIoU (second) | accuracy (second) | GTc (second) |\n\
             |---|---|---:|---:|---:|---:|---:|---:|\n",
        );
        push_cross(&mut text, sources, &rows);
        text.push_str(
            "\nmIoU by number of parts:\n\n\
             | | supervision / reference | all | K 2-4 | K 5-9 | K 10-19 |\n|---|---|---:|---:|---:|---:|\n",
        );
        push_bins(&mut text, sources, &rows);
        text.push_str(
            "\nGTc: our loss trains for it (its cross-entropy compares tokens with the centers of the parts). The paper's loss may not.\n",
        );
        Some(text)
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"))
}

fn bins_of(row: &TableRow) -> String {
    let cell = |bin: &KBin| {
        let found = row.bins.iter().find(|found| found.bin == *bin);
        found.map_or_else(
            || "–".to_owned(),
            |found| match found.miou {
                Some(miou) => format!("{miou:.3} ({})", found.n_shapes),
                None => "–".to_owned(),
            },
        )
    };
    BINS.iter().map(cell).collect::<Vec<_>>().join(" | ")
}

fn paper_bins(printed: &Printed) -> String {
    let bins: Vec<String> = printed.bins.iter().map(|bin| format!("{bin:.2}")).collect();
    bins.join(" | ")
}

fn push_probe(text: &mut String, sources: [&str; 2], rows: &[&TableRow; 2]) {
    for (name, printed) in PAPER_SOURCES.iter().zip(&PAPER[0]) {
        let Printed { miou, accuracy, .. } = printed;
        let bins = paper_bins(printed);
        let _ = writeln!(
            text,
            "| paper | {name} | {miou:.2} | {accuracy:.2} | {bins} |"
        );
    }
    for (name, row) in sources.iter().zip(rows) {
        let [miou, accuracy] =
            [MIOU, ACCURACY].map(|metric| number(row.means.get(&metric).copied()));
        let _ = writeln!(
            text,
            "| this run | `{name}` | {miou} | {accuracy} | {} |",
            bins_of(row)
        );
    }
}

fn push_cross(text: &mut String, sources: [&str; 2], rows: &[[&TableRow; 2]]) {
    for (idx, name) in PAPER_SOURCES.iter().enumerate() {
        let of = |referee: usize| {
            let Printed {
                miou,
                accuracy,
                gtc,
                ..
            } = &PAPER[referee][idx];
            format!("{miou:.2} | {accuracy:.2} | {gtc:.2}")
        };
        let _ = writeln!(text, "| paper | {name} | {} | {} |", of(0), of(1));
    }
    for (idx, name) in sources.iter().enumerate() {
        let of = |referee: usize| {
            let means = &rows[referee][idx].means;
            [MIOU, ACCURACY, GTC_ACCURACY]
                .map(|metric| number(means.get(&metric).copied()))
                .join(" | ")
        };
        let _ = writeln!(text, "| this run | `{name}` | {} | {} |", of(0), of(1));
    }
}

fn push_bins(text: &mut String, sources: [&str; 2], rows: &[[&TableRow; 2]]) {
    for referee in 0..2 {
        for supervision in 0..2 {
            let printed = &PAPER[referee][supervision];
            let _ = writeln!(
                text,
                "| paper | {} / {} | {:.2} | {} |",
                PAPER_SOURCES[supervision],
                PAPER_SOURCES[referee],
                printed.miou,
                paper_bins(printed)
            );
        }
    }
    for referee in 0..2 {
        for supervision in 0..2 {
            let row = rows[referee][supervision];
            let _ = writeln!(
                text,
                "| this run | `{}` / `{}` | {} | {} |",
                sources[supervision],
                sources[referee],
                number(row.means.get(&MIOU).copied()),
                bins_of(row)
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::ScoreRow;
    use crate::tables::tables;
    use crate::tables::tests::{example, settings};

    #[test]
    fn every_row_is_below_that_of_the_paper() {
        let mut rows = example();
        let scored_twice = example().into_iter().map(|row| ScoreRow {
            reference: "brep-face".to_owned(),
            ..row
        });
        rows.extend(scored_twice);
        let found = tables(&rows, &settings());
        let text = found.paper_comparison(["step-parts", "brep-face"]).unwrap();
        for expected in [
            "| paper | STEP-Parts | 0.60 | 0.76 | 0.71 | 0.58 | 0.51 |",
            "| this run | `step-parts` | 0.625 | 0.812 | 0.562 (1) | 0.625 (1) | 0.688 (1) |",
            "| paper | PartField | 0.51 | 0.68 | 0.68 | 0.52 | 0.69 | 0.66 |",
            "| this run | `brep-face` | 0.375 | 0.688 | 0.900 | 0.375 | 0.688 | 0.900 |",
            "| paper | STEP-Parts / PartField | 0.57 | 0.68 | 0.55 | 0.46 |",
            "| this run | `brep-face` / `step-parts` | 0.375 | 0.312 (1) | 0.375 (1) | 0.438 (1) |",
        ] {
            assert!(text.contains(expected), "{text}");
        }
        assert_eq!(found.paper_comparison(["step-parts", "other"]), None);
    }
}
