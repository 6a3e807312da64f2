//! Generates mechanical parts as STEP text, together with the results that a STEP reader should compute from them.
//!
//! ```
//! use partprobe_synth::{SynthSettings, part};
//!
//! let settings = SynthSettings { seed: 1, min_parts: 4, max_parts: 9 };
//! let part = part(&settings, 0);
//! assert!(part.step.starts_with("ISO-10303-21;"));
//! assert_eq!(part.face_parts.len(), part.n_faces as usize);
//! assert!((4..=9).contains(&part.n_parts) && part.volume > 0.0);
//! ```
//!
//! # What it guarantees
//!
//! - Every part is a closed solid in an AP214 file.
//! - The partition that a labeler should find, the volume, and the areas of all faces except those on B-spline surfaces are
//!   computed in closed form from the construction, not from the text.
//! - The same settings and index give the same text on every machine.
//!
//! # What it does not do
//!
//! It opens no file, prints nothing, does not read STEP and does not tessellate.

mod expected;
mod families;
mod feature;
pub mod fixtures;
mod frame;
mod geometry;
mod part_builder;
mod patch;
mod path;
mod profile;
mod shell;
mod side;
mod spline;
mod step;
mod sweep;
mod wavy_block;

use families::{EXACT, FAMILIES, Family};
use part_builder::PartBuilder;
use partprobe_carrier::{FaceType, Partition, keyed_rng};
use rand::RngExt as _;
use shell::Shell;
use step::{AngleUnit, Body, Decoration, Document, LengthUnit};

/// The seed, and the bounds on the number of STEP parts.
///
/// Bounds are clamped to 2 and 40. A maximum below the minimum is set to the minimum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SynthSettings {
    /// The seed that every part's random numbers depend on.
    pub seed: u64,
    /// The fewest STEP parts that a part may have.
    pub min_parts: u32,
    /// The most STEP parts that a part may have.
    pub max_parts: u32,
}

/// One generated solid, and its properties that follow from the construction.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthPart {
    /// The name, for example `synth-000017-flange`; it is also the product's name in the file.
    pub name: String,
    /// The family that the part was drawn from.
    pub family: &'static str,
    /// The text of the STEP file.
    pub step: String,
    /// The number of faces of the solid.
    pub n_faces: u32,
    /// The number of STEP parts of its faces at 8°.
    pub n_parts: u32,
    /// The expected part of each face, in the order of the file. Parts are numbered in the order of their first faces.
    pub face_parts: Vec<u32>,
    /// The primitive type of each face.
    pub face_types: Vec<FaceType>,
    /// The area of each face in square millimeters, exact up to rounding. `None` for B-spline surfaces.
    pub face_areas: Vec<Option<f64>>,
    /// The volume in cubic millimeters, exact up to rounding.
    pub volume: f64,
}

/// The number of attempts with random families. If all fail, a stepped pin with exactly the target number of parts is made.
const N_ATTEMPTS: u32 = 200;
/// The number of these attempts that are accepted only if their number of parts is near the target.
const N_NEAR_ATTEMPTS: u32 = 60;

/// Generates the part with this index. The result depends only on the two arguments.
#[must_use]
pub fn part(settings: &SynthSettings, index: u64) -> SynthPart {
    let bounds = bounds(settings);
    let target = target(settings.seed, index, bounds);
    let attempt = |attempt| Attempt {
        seed: settings.seed,
        index,
        attempt,
        target,
    };
    let (family, shell, partition) = (0..N_ATTEMPTS)
        .find_map(|n| attempt(n).drawn(bounds))
        .unwrap_or_else(|| attempt(N_ATTEMPTS).built(|_| EXACT));
    let name = format!("synth-{index:06}-{}", family.name);
    let step = step::write(
        &document(settings.seed, index, &name),
        &[Body::Solid(&shell)],
    );
    SynthPart {
        name,
        family: family.name,
        step,
        n_faces: u32::try_from(shell.faces.len()).unwrap_or(u32::MAX),
        n_parts: partition.n_parts(),
        face_parts: partition.parts().to_vec(),
        face_types: shell
            .faces
            .iter()
            .map(|face| face.surface.face_type())
            .collect(),
        face_areas: shell.faces.iter().map(|face| face.area).collect(),
        volume: shell.volume,
    }
}

fn bounds(settings: &SynthSettings) -> [u32; 2] {
    let low = settings.min_parts.clamp(2, 40);
    [low, settings.max_parts.clamp(low, 40)]
}

/// Draws the target number of STEP parts. Small numbers are more common, as in real collections.
fn target(seed: u64, index: u64, [low, high]: [u32; 2]) -> u32 {
    let mut rng = keyed_rng(seed, &["synth-target", &index.to_string()]);
    let skew = rng.random_range(0.0..1.0_f64);
    low + (f64::from(high - low) * skew * skew.sqrt()).round() as u32
}

/// One attempt to generate a part.
struct Attempt {
    seed: u64,
    index: u64,
    attempt: u32,
    target: u32,
}

impl Attempt {
    /// Draws a part of a random family. Returns `None` if it has too few or too many STEP parts.
    fn drawn(&self, [low, high]: [u32; 2]) -> Option<(Family, Shell, Partition)> {
        let last = u32::try_from(FAMILIES.len() - 1).unwrap_or(0);
        let built = self.built(|builder| FAMILIES[builder.count(0, last) as usize]);
        let n_parts = built.2.n_parts();
        let is_near =
            n_parts.abs_diff(self.target) <= 1 + self.target / 4 || self.attempt >= N_NEAR_ATTEMPTS;
        ((low..=high).contains(&n_parts) && is_near).then_some(built)
    }

    fn built(&self, choose: impl Fn(&mut PartBuilder) -> Family) -> (Family, Shell, Partition) {
        let rng = keyed_rng(
            self.seed,
            &["synth", &self.index.to_string(), &self.attempt.to_string()],
        );
        let mut builder = PartBuilder::new(rng, self.target);
        let family = choose(&mut builder);
        (family.draw)(&mut builder);
        let partition = expected::partition(&builder.shell);
        (family, builder.shell, partition)
    }
}

/// Draws the units, names and colors of a part's file. Most files are in millimeters and radians.
fn document(seed: u64, index: u64, name: &str) -> Document {
    let mut rng = keyed_rng(seed, &["synth-file", &index.to_string()]);
    let mut roll = |sides: u32| rng.random_range(0..sides);
    Document {
        name: name.to_owned(),
        length: match roll(10) {
            0 => LengthUnit::Inch,
            1 => LengthUnit::Meter,
            _ => LengthUnit::Millimeter,
        },
        angle: if roll(4) == 0 {
            AngleUnit::Degree
        } else {
            AngleUnit::Radian
        },
        decoration: match roll(4) {
            0 => Decoration::Named,
            1 => Decoration::NamedAndColored,
            _ => Decoration::Bare,
        },
        reverse_curves: roll(3) == 0,
    }
}

/// Checks that entities are numbered 1, 2, … in order, that every reference points at one of them, and that the text is
/// ASCII.
#[cfg(test)]
#[track_caller]
fn step_text_check(name: &str, step: &str) {
    assert!(
        step.is_ascii()
            && step.starts_with("ISO-10303-21;")
            && step.ends_with("END-ISO-10303-21;\n"),
        "{name}"
    );
    let entities: Vec<&str> = step.lines().filter(|line| line.starts_with('#')).collect();
    for (i, line) in entities.iter().enumerate() {
        assert!(line.starts_with(&format!("#{}=", i + 1)), "{name}: {line}");
        assert!(
            !line.contains("NaN") && !line.contains("inf"),
            "{name}: {line}"
        );
        for reference in line.split('#').skip(2) {
            let digits: String = reference.chars().take_while(char::is_ascii_digit).collect();
            assert!(
                (1..=entities.len()).contains(&digits.parse().unwrap()),
                "{name}: {line}"
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(settings: &SynthSettings, index: u64) {
        let bounds = bounds(settings);
        let target = target(settings.seed, index, bounds);
        let built = (0..N_ATTEMPTS).find_map(|attempt| {
            Attempt {
                seed: settings.seed,
                index,
                attempt,
                target,
            }
            .drawn(bounds)
        });
        if let Some((family, shell, _)) = built {
            assert_eq!(
                shell.defects(),
                Vec::<String>::new(),
                "{} {index}",
                family.name
            );
        }
        let part = part(settings, index);
        step_text_check(&part.name, &part.step);
        assert!(
            (bounds[0]..=bounds[1]).contains(&part.n_parts),
            "{} has {} parts",
            part.name,
            part.n_parts
        );
        assert_eq!(
            part.n_faces as usize,
            part.step.matches("=ADVANCED_FACE(").count()
        );
        assert!(
            part.volume > 0.0 && part.face_areas.iter().flatten().all(|&area| area > 0.0),
            "{}",
            part.name
        );
        assert_eq!(part, super::part(settings, index));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn every_part_is_closed_and_keeps_its_bounds(seed: u64, index: u64, low in 0u32..40, more in 0u32..20) {
            check(&SynthSettings { seed, min_parts: low, max_parts: low + more }, index);
        }
    }

    #[test]
    fn every_narrow_bound_can_be_met() {
        for n in 2..=40 {
            check(
                &SynthSettings {
                    seed: 5,
                    min_parts: n,
                    max_parts: n,
                },
                u64::from(n),
            );
        }
    }

    #[test]
    fn a_thousand_parts_are_a_thousand_shapes_of_every_family() {
        let settings = SynthSettings {
            seed: 1,
            min_parts: 2,
            max_parts: 40,
        };
        let parts: Vec<SynthPart> = (0..1000).map(|index| part(&settings, index)).collect();
        let volumes: std::collections::BTreeSet<u64> =
            parts.iter().map(|part| part.volume.to_bits()).collect();
        assert_eq!(volumes.len(), parts.len());
        for part in &parts {
            assert!(
                part.face_areas.iter().flatten().all(|&area| area > 0.0),
                "{}",
                part.name
            );
        }
        for family in FAMILIES {
            assert!(
                parts.iter().any(|part| part.family == family.name),
                "{} is never drawn",
                family.name
            );
        }
    }
}
