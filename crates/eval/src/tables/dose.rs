//! Draws the curve of a score over the dose of one kind of damage, and places other label sources on it.
//!
//! Damaged sources are recognized by their names. A source is placed within one kind of damage only: damage has many dimensions, and
//! merged parts are not more or less than moved boundaries.

use super::{DifferenceRow, TableRow, Tables};
use crate::metrics::MIOU;
use std::fmt::{self, Write as _};

/// A kind of damage: the names of its sources, and the meaning of its dose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DoseKind {
    /// The name of a source without the dose, for example `step-merged-share-`.
    pub prefix: &'static str,
    /// The unit of the dose and what it counts, as in "18 % of its parts merged".
    pub unit: &'static str,
}

/// The kinds of damage to STEP-Parts.
pub const DOSE_KINDS: [DoseKind; 3] = [
    DoseKind {
        prefix: "step-merged-share-",
        unit: "% of its parts merged with a neighbor",
    },
    DoseKind {
        prefix: "step-flipped-",
        unit: "% of its faces given to another part",
    },
    DoseKind {
        prefix: "step-jittered-",
        unit: "‰ of the diagonal as the radius by which its boundaries move",
    },
];

/// The source that is damaged.
const UNDAMAGED: &str = "step-parts";

/// A score at a dose: the difference from the undamaged source, with the ends of its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DosePoint {
    /// The dose.
    pub dose: f64,
    /// mIoU minus that of the undamaged source.
    pub difference: f64,
    /// The ends of the 95 % interval, or `None` if there is none.
    pub interval: Option<[f64; 2]>,
}

/// The scores of one kind of damage.
#[derive(Clone, Debug, PartialEq)]
pub struct DoseCurve {
    /// The kind.
    pub kind: DoseKind,
    /// The points, sorted by dose. The first point is the undamaged source at 0.
    pub points: Vec<DosePoint>,
}

impl DoseCurve {
    /// The smallest dose at which the curve is as low as this difference, linear between doses. Returns `None` if it never is.
    #[must_use]
    pub fn dose_of(&self, difference: f64) -> Option<f64> {
        if difference >= 0.0 {
            return Some(0.0);
        }
        for pair in self.points.windows(2) {
            let [before, after] = [pair[0], pair[1]];
            if after.difference <= difference {
                let fall = before.difference - after.difference;
                let fraction = ((before.difference - difference) / fall).clamp(0.0, 1.0);
                return Some(before.dose + fraction * (after.dose - before.dose));
            }
        }
        None
    }

    fn largest_dose(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.dose)
    }
}

/// The dose at which the damaged source scores like another source.
///
/// As a text, it is the end of a sentence about that source: "scores as `step-parts` with 15 (12 to 18) % of its parts …".
#[derive(Clone, Debug, PartialEq)]
pub struct DosePlacement {
    /// The kind of damage.
    pub kind: DoseKind,
    /// The other source.
    pub source: String,
    /// The dose, or `None` if the source scores worse than the largest dose.
    pub dose: Option<f64>,
    /// The doses at the ends of the interval of the difference, the smaller one first. Each can be `None` as above.
    pub interval: Option<[Option<f64>; 2]>,
    /// The largest dose that was tried.
    pub largest_dose: f64,
}

impl DosePlacement {
    fn new(curve: &DoseCurve, source: &str, point: DosePoint) -> Self {
        let interval = point
            .interval
            .map(|[low, high]| [curve.dose_of(high), curve.dose_of(low)]);
        Self {
            kind: curve.kind,
            source: source.to_owned(),
            dose: curve.dose_of(point.difference),
            interval,
            largest_dose: curve.largest_dose(),
        }
    }
}

impl fmt::Display for DosePlacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let dose = |dose: Option<f64>| match dose {
            Some(dose) => format!("{dose:.0}"),
            None => format!("more than {:.0}", self.largest_dose),
        };
        write!(f, "scores as `{UNDAMAGED}` with {}", dose(self.dose))?;
        // If the whole interval is beyond the largest dose, this is said only once.
        if let Some([low, high]) = self.interval
            && low.or(high).or(self.dose).is_some()
        {
            write!(f, " ({} to {})", dose(low), dose(high))?;
        }
        write!(f, " {}", self.kind.unit)
    }
}

impl Tables {
    /// The curves of the first table: by the reference of the bins and the first clusterer. A kind needs two doses.
    #[must_use]
    pub fn dose_curves(&self) -> Vec<DoseCurve> {
        let Some(first) = self.rows.first() else {
            return Vec::new();
        };
        let rows: Vec<&TableRow> = self
            .rows
            .iter()
            .filter(|row| row.reference == first.reference && row.clusterer == first.clusterer)
            .collect();
        let curve = |kind: DoseKind| {
            let mut points: Vec<DosePoint> = rows
                .iter()
                .filter_map(|row| {
                    let dose: f64 = row.supervision.strip_prefix(kind.prefix)?.parse().ok()?;
                    self.dose_point(row, dose)
                })
                .collect();
            points.push(DosePoint {
                dose: 0.0,
                difference: 0.0,
                interval: None,
            });
            points.sort_by(|a, b| a.dose.total_cmp(&b.dose));
            DoseCurve { kind, points }
        };
        DOSE_KINDS
            .into_iter()
            .map(curve)
            .filter(|curve| curve.points.len() > 2)
            .collect()
    }

    fn dose_point(&self, row: &TableRow, dose: f64) -> Option<DosePoint> {
        let difference = self.difference_from_undamaged(row)?;
        let found = difference.differences.get(&MIOU)?;
        // The row of the table is the undamaged source minus the damaged one.
        Some(DosePoint {
            dose,
            difference: -found.mean,
            interval: found
                .interval
                .map(|interval| [-interval.high, -interval.low]),
        })
    }

    fn difference_from_undamaged(&self, row: &TableRow) -> Option<&DifferenceRow> {
        self.differences.iter().find(|difference| {
            difference.reference == row.reference
                && difference.clusterer == row.clusterer
                && difference.compared[0] == UNDAMAGED
                && difference.compared[1] == row.supervision
        })
    }

    /// The position of each other trained source on each of the [curves](Self::dose_curves), by kind of damage.
    #[must_use]
    pub fn dose_placements(&self) -> Vec<DosePlacement> {
        let undamaged_sources = self.undamaged_sources();
        let of_curve = |curve: DoseCurve| {
            let place =
                |(name, point): &(&str, DosePoint)| DosePlacement::new(&curve, name, *point);
            undamaged_sources.iter().map(place).collect::<Vec<_>>()
        };
        self.dose_curves().into_iter().flat_map(of_curve).collect()
    }

    /// A Markdown section with a table per kind of damage, and a sentence for each other source. It is empty without curves.
    pub(super) fn dose_response(&self) -> String {
        let placements = self.dose_placements();
        let mut text = String::new();
        for curve in self.dose_curves() {
            let _ = writeln!(
                text,
                "\nDose and response: `{UNDAMAGED}` with so many {}:\n\n| dose | Δ mIoU |\n|---:|---:|",
                curve.kind.unit
            );
            for point in &curve.points {
                let interval = point.interval.map_or_else(String::new, |[low, high]| {
                    format!(" [{low:+.3}, {high:+.3}]")
                });
                let _ = writeln!(
                    text,
                    "| {} | {:+.3}{interval} |",
                    point.dose, point.difference
                );
            }
            text.push('\n');
            for placement in placements.iter().filter(|found| found.kind == curve.kind) {
                let _ = writeln!(text, "`{}` {placement}.", placement.source);
            }
        }
        text
    }

    /// The trained sources that are not damaged on purpose, with their difference from the undamaged one.
    fn undamaged_sources(&self) -> Vec<(&str, DosePoint)> {
        let Some(first) = self.rows.first() else {
            return Vec::new();
        };
        let is_dose = |name: &str| DOSE_KINDS.iter().any(|kind| name.starts_with(kind.prefix));
        self.rows
            .iter()
            .filter(|row| row.reference == first.reference && row.clusterer == first.clusterer)
            .filter(|row| !is_dose(&row.supervision))
            .filter_map(|row| Some((row.supervision.as_str(), self.dose_point(row, 0.0)?)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ScoreRow;
    use crate::tables::tables;
    use crate::tables::tests::{row, settings};

    /// mIoU falls by 0.1 for each 10 % of merged parts; another source loses 0.15.
    fn example() -> Vec<ScoreRow> {
        let mut rows = Vec::new();
        for n in 0..12 {
            for seed in 0..2 {
                let miou = 0.6 + 0.01 * f64::from(n);
                let shape = format!("{n}__1");
                for (name, loss) in [
                    ("step-parts", 0.0),
                    ("step-merged-share-10", 0.1),
                    ("step-merged-share-20", 0.2),
                    ("step-flipped-10", 0.3),
                    ("mine", 0.15),
                ] {
                    rows.push(row(&shape, name, seed, 7, miou - loss));
                }
            }
        }
        rows
    }

    fn found() -> Tables {
        let mut settings = settings();
        settings.compared = [
            "step-merged-share-10",
            "step-merged-share-20",
            "step-flipped-10",
            "mine",
        ]
        .map(|other| ["step-parts".to_owned(), other.to_owned()])
        .to_vec();
        tables(&example(), &settings)
    }

    #[test]
    fn a_source_is_placed_between_two_doses_of_one_kind() {
        let curves = found().dose_curves();
        let [curve] = &curves[..] else {
            panic!("one kind has two doses: {curves:?}")
        };
        let doses: Vec<f64> = curve.points.iter().map(|point| point.dose).collect();
        assert_eq!(doses, [0.0, 10.0, 20.0]);
        for (difference, expected) in [
            (0.05, Some(0.0)),
            (0.0, Some(0.0)),
            (-0.05, Some(5.0)),
            (-0.15, Some(15.0)),
            (-0.25, None),
        ] {
            let dose = curve.dose_of(difference);
            assert_eq!(dose.map(f64::round), expected, "{difference}");
        }
        let text = found().dose_response();
        assert!(
            text.contains("`mine` scores as `step-parts` with 15 (15 to 15) % of its parts merged"),
            "{text}"
        );
    }

    #[test]
    fn no_damage_gives_no_section() {
        let mut found = found();
        found
            .rows
            .retain(|row| !row.supervision.starts_with("step-merged"));
        assert_eq!(found.dose_response(), "");
    }
}
