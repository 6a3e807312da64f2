//! Writes calibration tables as Markdown for people, CSV for spreadsheets and JSON for programs.

use crate::{AngleCounts, CalibrationTables, Quartiles, StableRange, SweepRow};
use partprobe_carrier::FaceType;
use std::fmt::Write as _;

impl CalibrationTables {
    /// Formats the fractions by type, the sweep, and the stable range.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = format!(
            "{} shapes, of which {} have no two faces to join at any threshold.\n\n",
            self.n_shapes, self.n_shapes_without_merges
        );
        self.push_shares(&mut text);
        self.push_sweep(&mut text);
        self.push_components(&mut text);
        self.push_range(&mut text);
        text
    }

    fn push_shares(&self, text: &mut String) {
        let theta = self.settings.theta_deg;
        let _ = writeln!(
            text,
            "Dihedral angles between faces of one primitive type; a pair of faces has the smallest φ of its edges:\n\n\
             | type | edges | ≤ {theta}° | < 0.5° | 85–95° | undefined | pairs | ≤ {theta}° | < 0.5° | 85–95° |\n\
             |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
        );
        let types = self.histogram.types.iter().filter(|row| row.edges.n > 0);
        for row in types {
            push_share_row(text, row.face_type, &row.edges, &row.pairs);
        }
        push_share_row(text, "all", &self.histogram.edges, &self.histogram.pairs);
    }

    fn push_sweep(&self, text: &mut String) {
        let _ = writeln!(
            text,
            "\nThe sweep, mean (quartiles) over shapes: P parts, S boundary sharpness, D intra-part deviation, \
             H part-size entropy; *changed* counts the shapes whose partition differs from that at {}°:\n\n\
             | θ | P | S | D | H | changed |\n|---:|---:|---:|---:|---:|---:|",
            self.settings.theta_deg
        );
        for row in &self.sweep {
            let _ = writeln!(
                text,
                "| {}° | {} | {}° | {}° | {} | {} ({:.2} %) |",
                row.theta_deg,
                quartiles(&row.n_parts, 1),
                quartiles(&row.sharpness_deg, 2),
                quartiles(&row.deviation_deg, 2),
                quartiles(&row.entropy, 3),
                row.n_changed,
                100.0 * row.changed
            );
        }
    }

    fn push_components(&self, text: &mut String) {
        let has_parts = |code: &usize| self.sweep.iter().any(|row| row.components[*code] > 0.0);
        let codes: Vec<usize> = (0..FaceType::ALL.len()).filter(has_parts).collect();
        let names: Vec<&str> = codes
            .iter()
            .map(|&code| FaceType::ALL[code].name())
            .collect();
        let _ = writeln!(
            text,
            "\nParts of each primitive type, mean over shapes:\n\n| θ | {} |\n|---:|{}",
            names.join(" | "),
            "---:|".repeat(codes.len())
        );
        for row in &self.sweep {
            let cells: Vec<String> = codes
                .iter()
                .map(|&code| format!("{:.3}", row.components[code]))
                .collect();
            let _ = writeln!(text, "| {}° | {} |", row.theta_deg, cells.join(" | "));
        }
    }

    fn push_range(&self, text: &mut String) {
        let (theta, tolerance) = (self.settings.theta_deg, 100.0 * self.settings.tolerance);
        let range_text = |range: &StableRange| {
            let StableRange {
                low_deg,
                high_deg,
                changed,
            } = range;
            format!(
                "{low_deg}° to {high_deg}° ({:.2} % of the shapes change inside)",
                100.0 * changed
            )
        };
        let none = || "none".to_owned();
        let _ = writeln!(
            text,
            "\nRanges of θ in 1–45° over which the partition of at most {tolerance} % of the shapes changes:\n\n\
             - widest, the suggested one: {}\n- widest around {theta}°: {}",
            self.stable_range.as_ref().map_or_else(none, range_text),
            self.range_around_theta
                .as_ref()
                .map_or_else(none, range_text)
        );
    }

    /// Formats one line per degree: the lower bound of the bin, the number of edges, the number of pairs.
    #[must_use]
    pub fn histogram_csv(&self) -> String {
        let mut text = String::from("phi_from_deg,edges,pairs\n");
        for (degree, (edges, pairs)) in self
            .histogram
            .edge_bins
            .iter()
            .zip(&self.histogram.pair_bins)
            .enumerate()
        {
            let _ = writeln!(text, "{degree},{edges},{pairs}");
        }
        text
    }

    /// Formats one line per threshold of the sweep. Statistics have six decimals.
    #[must_use]
    pub fn sweep_csv(&self) -> String {
        let mut text = String::from("theta_deg,n_shapes,n_changed");
        for name in ["n_parts", "sharpness_deg", "deviation_deg", "entropy"] {
            let _ = write!(text, ",{name}_mean,{name}_lower,{name}_median,{name}_upper");
        }
        FaceType::ALL
            .iter()
            .for_each(|kind| text.push_str(&format!(",parts_{kind}")));
        text.push('\n');
        for row in &self.sweep {
            push_csv_row(&mut text, self.n_shapes, row);
        }
        text
    }

    /// Formats all tables in full precision.
    #[must_use]
    pub fn to_json(&self) -> String {
        // Numbers, lists and text can always be serialized. The fallback only keeps the function free of panics.
        serde_json::to_string_pretty(self)
            .map(|json| json + "\n")
            .unwrap_or_default()
    }
}

fn push_share_row(text: &mut String, name: &str, edges: &AngleCounts, pairs: &AngleCounts) {
    let share = |part: u64, all: u64| format!("{:.2} %", 100.0 * part as f64 / all.max(1) as f64);
    let cells = |counts: &AngleCounts| {
        [counts.n_within_theta, counts.n_seam_like, counts.n_right]
            .map(|part| share(part, counts.n))
            .join(" | ")
    };
    let _ = writeln!(
        text,
        "| {name} | {} | {} | {} | {} | {} |",
        edges.n,
        cells(edges),
        edges.n_undefined,
        pairs.n,
        cells(pairs)
    );
}

fn quartiles(values: &Quartiles, decimals: usize) -> String {
    let Quartiles {
        mean,
        lower,
        median,
        upper,
    } = values;
    format!("{mean:.decimals$} ({lower:.decimals$}, {median:.decimals$}, {upper:.decimals$})")
}

fn push_csv_row(text: &mut String, n_shapes: usize, row: &SweepRow) {
    let _ = write!(text, "{},{n_shapes},{}", row.theta_deg, row.n_changed);
    for Quartiles {
        mean,
        lower,
        median,
        upper,
    } in [
        row.n_parts,
        row.sharpness_deg,
        row.deviation_deg,
        row.entropy,
    ] {
        let _ = write!(text, ",{mean:.6},{lower:.6},{median:.6},{upper:.6}");
    }
    row.components
        .iter()
        .for_each(|mean| text.push_str(&format!(",{mean:.6}")));
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Calibration, CalibrationSettings, ShapeAngles};

    fn tables() -> CalibrationTables {
        let settings = CalibrationSettings {
            theta_deg: 8.0,
            thetas_deg: vec![4.0, 8.0],
            tolerance: 0.05,
        };
        let mut tables = Calibration::new(settings).tables();
        let angles = |phi: f64| vec![(FaceType::Plane, phi)];
        tables.histogram.add(
            &ShapeAngles {
                edges: angles(5.0),
                pairs: angles(90.0),
                merges: vec![5.0],
            },
            8.0,
        );
        tables
    }

    #[test]
    fn every_line_of_a_table_has_as_many_fields_as_its_head() {
        let tables = tables();
        for (csv, n_fields) in [(tables.histogram_csv(), 3), (tables.sweep_csv(), 30)] {
            assert!(
                csv.lines().all(|line| line.split(',').count() == n_fields),
                "{csv}"
            );
        }
        assert_eq!(
            (
                tables.histogram_csv().lines().count(),
                tables.sweep_csv().lines().count()
            ),
            (181, 3)
        );
    }

    #[test]
    fn markdown_names_the_share_and_the_range() {
        let text = tables().to_markdown();
        assert!(
            text.contains(
                "| plane | 1 | 100.00 % | 0.00 % | 0.00 % | 0 | 1 | 0.00 % | 0.00 % | 100.00 % |"
            ),
            "{text}"
        );
        assert!(
            text.contains("the suggested one: 1° to 45° (0.00 %"),
            "{text}"
        );
        let none = CalibrationTables {
            stable_range: None,
            ..tables()
        };
        assert!(none.to_markdown().contains("the suggested one: none"));
    }
}
