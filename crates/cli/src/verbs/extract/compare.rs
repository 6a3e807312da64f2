//! Tests whether a small file gives the same results as the large one: both are measured and compared by the numbers of the large
//! one.

use partprobe_brep::{LostEntity, ReadError};
use partprobe_verify::{MeasureSettings, MeasuredFile};
use std::collections::BTreeMap;
use std::fmt::Write;

/// The relative tolerance of areas. Neighbors that are missing in the small file may have made the mesh of the large one finer.
const SAME_AREA: f64 = 1e-3;

/// The measurements of some instances of a file, by the numbers of the large file.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct InstanceReading {
    /// Type and area in mm² of each face.
    pub(super) faces: BTreeMap<u64, (&'static str, f64)>,
    /// The reason why each entity was lost. If a file cannot be read at all, the reason has the number 0.
    pub(super) lost: BTreeMap<u64, String>,
    /// The chord tolerance that was used, in mm.
    pub(super) chord_mm: Option<f64>,
}

impl InstanceReading {
    /// Measures a text. `old_of` gives the number in the large file, or `None` for entities that are not compared.
    pub(super) fn of(
        text: &[u8],
        settings: &MeasureSettings,
        old_of: impl Fn(u64) -> Option<u64>,
    ) -> Self {
        match MeasuredFile::from_step(text, settings) {
            Ok(measured) => Self::of_measured(&measured, old_of),
            Err(ReadError::NoFaces { lost }) => Self {
                lost: reasons(&lost, old_of),
                ..Self::default()
            },
            Err(error) => Self {
                lost: BTreeMap::from([(0, error.to_string())]),
                ..Self::default()
            },
        }
    }

    fn of_measured(measured: &MeasuredFile, old_of: impl Fn(u64) -> Option<u64>) -> Self {
        let shape = &measured.shape;
        let mut faces = BTreeMap::new();
        for face in &shape.graph.faces {
            if let Some(id) = old_of(face.step_id) {
                faces
                    .entry(id)
                    .or_insert((face.face_type.name(), face.area));
            }
        }
        Self {
            faces,
            lost: reasons(&shape.lost, old_of),
            chord_mm: Some(shape.chord_mm),
        }
    }

    /// The differences of the small file from the large one, one line each.
    pub(super) fn differences(&self, small: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        for (id, (face_type, area)) in &self.faces {
            match small.faces.get(id) {
                None => differences.push(format!("face #{id} is not read in the extract")),
                Some((small_type, _)) if small_type != face_type => {
                    differences
                        .push(format!("face #{id} is of type {face_type} in the file and {small_type} in the extract"));
                }
                Some((_, small_area))
                    if (area - small_area).abs() > SAME_AREA * area.abs().max(small_area.abs()) =>
                {
                    differences.push(format!(
                        "face #{id} has an area of {area:.6} mm² in the file and {small_area:.6} in the extract"
                    ));
                }
                Some(_) => {}
            }
        }
        let only = |id: &&u64| !self.faces.contains_key(id);
        differences.extend(
            small
                .faces
                .keys()
                .filter(only)
                .map(|id| format!("face #{id} is read in the extract alone")),
        );
        for id in self
            .lost
            .keys()
            .chain(small.lost.keys().filter(|id| !self.lost.contains_key(id)))
        {
            let reason = |lost: &BTreeMap<u64, String>| {
                lost.get(id)
                    .cloned()
                    .unwrap_or_else(|| "nothing".to_owned())
            };
            let (before, after) = (reason(&self.lost), reason(&small.lost));
            if before != after {
                differences.push(format!("lost at #{id}: {before}, in the extract {after}"));
            }
        }
        differences
    }
}

/// The first reason at each number.
fn reasons(lost: &[LostEntity], old_of: impl Fn(u64) -> Option<u64>) -> BTreeMap<u64, String> {
    let mut reasons = BTreeMap::new();
    for loss in lost {
        if let Some(id) = old_of(loss.step_id) {
            reasons
                .entry(id)
                .or_insert_with(|| renumbered(&loss.reason, &old_of));
        }
    }
    reasons
}

/// A reason with each `#` number that `old_of` knows replaced.
fn renumbered(reason: &str, old_of: &impl Fn(u64) -> Option<u64>) -> String {
    let mut pieces = reason.split('#');
    let mut text = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let n_digits = piece.bytes().take_while(u8::is_ascii_digit).count();
        let (digits, rest) = piece.split_at(n_digits);
        let number = digits
            .parse()
            .ok()
            .and_then(old_of)
            .map_or_else(|| digits.to_owned(), |id| id.to_string());
        // Writing to a string cannot fail.
        let _ = write!(text, "#{number}{rest}");
    }
    text
}

/// The same settings with the chord tolerance of the large file in millimeters, for a text with another diagonal, and the
/// fraction of that diagonal.
pub(super) fn with_chord_of(
    settings: &MeasureSettings,
    large: &InstanceReading,
    text: &[u8],
) -> (MeasureSettings, Option<f64>) {
    let diagonal_mm = || {
        Some(
            partprobe_brep::tessellation_without_mesh(
                &partprobe_brep::read(text, &settings.budget).ok()?,
            )
            .diagonal_mm,
        )
    };
    let fraction = large
        .chord_mm
        .zip(diagonal_mm())
        .map(|(chord_mm, diagonal_mm)| chord_mm / diagonal_mm);
    let fraction = fraction.filter(|fraction| fraction.is_finite() && *fraction > 0.0);
    let mut settings = *settings;
    settings.options.chord_fraction = fraction.unwrap_or(settings.options.chord_fraction);
    (settings, fraction)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shown(faces: &[(u64, &'static str, f64)], lost: &[(u64, &str)]) -> InstanceReading {
        InstanceReading {
            faces: faces
                .iter()
                .map(|&(id, face_type, area)| (id, (face_type, area)))
                .collect(),
            lost: lost
                .iter()
                .map(|&(id, reason)| (id, reason.to_owned()))
                .collect(),
            chord_mm: None,
        }
    }

    #[test]
    fn differences_are_named() {
        let large = shown(
            &[(1, "plane", 10.0), (2, "cone", 5.0), (3, "plane", 1.0)],
            &[(7, "a"), (8, "b")],
        );
        assert_eq!(large.differences(&large), Vec::<String>::new());
        let small = shown(
            &[(1, "plane", 10.001), (2, "plane", 5.0), (4, "plane", 1.0)],
            &[(7, "c")],
        );
        let found = large.differences(&small);
        let begins = [
            "face #2 is of type cone",
            "face #3 is not read",
            "face #4 is read in the extract alone",
            "lost at #7: a, in the extract c",
            "lost at #8: b, in the extract nothing",
        ];
        assert_eq!(found.len(), begins.len(), "{found:?}");
        for (found, begin) in found.iter().zip(begins) {
            assert!(found.starts_with(begin), "{found}");
        }
    }

    #[test]
    fn reasons_get_the_numbers_of_the_large_file() {
        let old_of = |id: u64| (id < 10).then_some(id + 100);
        assert_eq!(
            renumbered("#1: its edge #22, then #x and #9", &old_of),
            "#101: its edge #22, then #x and #109"
        );
        assert_eq!(renumbered("nothing", &old_of), "nothing");
    }
}
