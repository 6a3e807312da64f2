//! Parametric mechanical parts, written as STEP text: a seed and an index go in, an AP214 file comes out,
//! together with the partition that a labeller should find in it and the volume and areas known in closed form.
//!
//! Every part is a closed solid. Nothing here opens a file, prints, reads STEP or tessellates,
//! and the same settings and index give the same text on any machine.

mod draft;
mod expected;
mod families;
mod feature;
pub mod fixtures;
mod frame;
mod geometry;
mod outline;
mod patch;
mod path;
mod shell;
mod side;
mod spline;
mod step;
mod sweep;

use carrier::{FaceType, Partition, keyed_rng};
use draft::Draft;
use families::{EXACT, FAMILIES, Family};
use shell::Shell;
use step::{AngleUnit, Body, Decoration, Document, LengthUnit};

/// The seed, and the bounds on the number of STEP parts.
///
/// Bounds outside 2..=40 are moved to the nearest of these; a maximum below the minimum counts as the minimum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SynthSettings {
    /// The seed that every part's random numbers depend on.
    pub seed: u64,
    /// The fewest STEP parts that a part may have.
    pub min_parts: u32,
    /// The most STEP parts that a part may have.
    pub max_parts: u32,
}

/// One generated solid, and what is known of it before anything reads it.
#[derive(Clone, Debug, PartialEq)]
pub struct SynthPart {
    /// The name, for example `synth-000017-flange`; it is also the product's name in the file.
    pub name: String,
    /// The family that the part was drawn from.
    pub family: &'static str,
    /// The text of the STEP file.
    pub step: String,
    /// How many faces the solid has.
    pub n_faces: u32,
    /// How many STEP parts its faces make at 8°.
    pub n_parts: u32,
    /// The expected part of each face, in the file's order; ids are numbered by each part's lowest face.
    pub face_parts: Vec<u32>,
    /// The primitive type of each face.
    pub face_types: Vec<FaceType>,
    /// The area of each face in square millimetres, exact to rounding; none on B-spline surfaces.
    pub face_areas: Vec<Option<f64>>,
    /// The volume in cubic millimetres, exact to rounding.
    pub volume: f64,
}

/// How often a family is drawn before the part is made to measure instead.
const N_ATTEMPTS: u32 = 200;

/// Generates the part with this index: a pure function of its two arguments.
#[must_use]
pub fn part(settings: &SynthSettings, index: u64) -> SynthPart {
    let bounds = bounds(settings);
    let (family, shell, partition) = (0..N_ATTEMPTS)
        .find_map(|attempt| drawn(settings.seed, index, attempt, bounds))
        .unwrap_or_else(|| made_to_measure(settings.seed, index, bounds));
    let name = format!("synth-{index:06}-{}", family.name);
    let step = step::write(&document(settings.seed, index, &name), &[Body::Solid(&shell)]);
    SynthPart {
        name,
        family: family.name,
        step,
        n_faces: u32::try_from(shell.faces.len()).unwrap_or(u32::MAX),
        n_parts: partition.n_parts(),
        face_parts: partition.parts().to_vec(),
        face_types: shell.faces.iter().map(|face| face.surface.face_type()).collect(),
        face_areas: shell.faces.iter().map(|face| face.area).collect(),
        volume: shell.volume,
    }
}

fn bounds(settings: &SynthSettings) -> [u32; 2] {
    let low = settings.min_parts.clamp(2, 40);
    [low, settings.max_parts.clamp(low, 40)]
}

/// One attempt at a part; none if it has too few parts or too many.
fn drawn(seed: u64, index: u64, attempt: u32, bounds: [u32; 2]) -> Option<(Family, Shell, Partition)> {
    let mut draft = draft(seed, index, attempt, bounds);
    let last = u32::try_from(FAMILIES.len() - 1).unwrap_or(0);
    let family = FAMILIES[draft.count(0, last) as usize];
    (family.draw)(&mut draft);
    let partition = expected::partition(&draft.shell);
    let fits = (bounds[0]..=bounds[1]).contains(&partition.n_parts());
    fits.then_some((family, draft.shell, partition))
}

/// A turned part with a number of parts inside the bounds, whatever they are.
fn made_to_measure(seed: u64, index: u64, bounds: [u32; 2]) -> (Family, Shell, Partition) {
    let mut draft = draft(seed, index, N_ATTEMPTS, bounds);
    (EXACT.draw)(&mut draft);
    let partition = expected::partition(&draft.shell);
    (EXACT, draft.shell, partition)
}

fn draft(seed: u64, index: u64, attempt: u32, [low, high]: [u32; 2]) -> Draft {
    let mut rng = keyed_rng(seed, &["synth", &index.to_string(), &attempt.to_string()]);
    // Small parts are more common than large ones, as in real collections.
    let skew = rand::RngExt::random_range(&mut rng, 0.0..1.0_f64);
    let target = low + (f64::from(high - low) * skew * skew.sqrt()).round() as u32;
    Draft::new(rng, target)
}

/// Units, names and colours of a part's file; most are in millimetres and radians.
fn document(seed: u64, index: u64, name: &str) -> Document {
    let mut rng = keyed_rng(seed, &["synth-file", &index.to_string()]);
    let mut roll = |sides: u32| rand::RngExt::random_range(&mut rng, 0..sides);
    Document {
        name: name.to_owned(),
        length: match roll(10) {
            0 => LengthUnit::Inch,
            1 => LengthUnit::Metre,
            _ => LengthUnit::Millimetre,
        },
        angle: if roll(4) == 0 { AngleUnit::Degree } else { AngleUnit::Radian },
        decoration: match roll(4) {
            0 => Decoration::Named,
            1 => Decoration::NamedAndColoured,
            _ => Decoration::Bare,
        },
        reverse_curves: roll(3) == 0,
    }
}
