//! Compares the exact volume of each solid: lines of another kernel's volumes go in, and counts and disagreements come out.

use crate::MeasuredFile;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Volumes agree if they differ by at most this fraction of the reference's volume.
const VOLUME_TOLERANCE: f64 = 0.01;

/// The solids of one file. There are none if the reference could not read it.
#[derive(Clone, Debug, Deserialize)]
pub struct VolumesLine {
    /// The path below the compared folder.
    pub file: String,
    #[serde(default)]
    solids: Vec<SolidRow>,
}

/// `[step id, whether closed, volume, whether valid]`.
type SolidRow = (Option<u64>, bool, f64, bool);

/// The data of a solid in the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceSolid {
    /// Whether all its shells are closed.
    pub is_closed: bool,
    /// The volume that its true surfaces enclose, in cubic millimeters.
    pub volume: f64,
    /// Whether the reference's own checker finds no error in it.
    pub is_valid: bool,
}

/// The numbers of closed solids that agree in volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VolumeCount {
    /// Solids that are closed according to the reference.
    pub n_solids: usize,
    /// Solids whose true surfaces enclose the reference's volume within 1 %.
    pub n_agreeing: usize,
    /// Solids whose mesh encloses it within 1 %.
    pub n_meshes_agreeing: usize,
    /// Solids that are also valid according to the reference's checker.
    pub n_valid: usize,
    /// Those of them whose true surfaces enclose the reference's volume within 1 %.
    pub n_valid_agreeing: usize,
}

impl VolumeCount {
    /// Adds the solids of another file or group.
    pub fn add(&mut self, other: Self) {
        self.n_solids += other.n_solids;
        self.n_agreeing += other.n_agreeing;
        self.n_meshes_agreeing += other.n_meshes_agreeing;
        self.n_valid += other.n_valid;
        self.n_valid_agreeing += other.n_valid_agreeing;
    }
}

impl VolumesLine {
    /// The solids by `#` number. If the reference has divided a solid into pieces, they are joined again.
    #[must_use]
    pub fn by_number(&self) -> BTreeMap<u64, ReferenceSolid> {
        by_number(&self.solids)
    }
}

fn by_number(solids: &[SolidRow]) -> BTreeMap<u64, ReferenceSolid> {
    let mut found: BTreeMap<u64, ReferenceSolid> = BTreeMap::new();
    for &(step_id, is_closed, volume, is_valid) in solids {
        let Some(step_id) = step_id else { continue };
        let nothing = ReferenceSolid {
            is_closed: true,
            volume: 0.0,
            is_valid: true,
        };
        let solid = found.entry(step_id).or_insert(nothing);
        solid.is_closed &= is_closed;
        solid.is_valid &= is_valid;
        solid.volume += volume;
    }
    found
}

/// Compares the volumes of the solids that are closed according to the reference.
#[must_use]
pub fn compare_volumes(
    ours: &MeasuredFile,
    theirs: &BTreeMap<u64, ReferenceSolid>,
) -> (VolumeCount, Vec<String>) {
    let solids = ours.brep.solids.iter().zip(&ours.solids);
    let ours: BTreeMap<u64, [f64; 2]> = solids
        .map(|(solid, measured)| (solid.step_id, [measured.volume, measured.mesh.volume]))
        .collect();
    count_volumes(&ours, theirs)
}

/// `ours` are the volumes of the true surfaces and of the mesh.
fn count_volumes(
    ours: &BTreeMap<u64, [f64; 2]>,
    theirs: &BTreeMap<u64, ReferenceSolid>,
) -> (VolumeCount, Vec<String>) {
    let mut count = VolumeCount::default();
    let mut differences = Vec::new();
    for (step_id, reference) in theirs.iter().filter(|(_, solid)| solid.is_closed) {
        let volumes = ours.get(step_id).copied().unwrap_or([f64::NAN; 2]);
        let within = |volume: f64| {
            (volume - reference.volume).abs() <= VOLUME_TOLERANCE * reference.volume.abs()
        };
        let [agrees, mesh_agrees] = volumes.map(within);
        count.n_solids += 1;
        count.n_agreeing += usize::from(agrees);
        count.n_meshes_agreeing += usize::from(mesh_agrees);
        count.n_valid += usize::from(reference.is_valid);
        count.n_valid_agreeing += usize::from(reference.is_valid && agrees);
        if !agrees {
            differences.push(difference(*step_id, volumes, *reference));
        }
    }
    (count, differences)
}

fn difference(step_id: u64, [volume, mesh]: [f64; 2], reference: ReferenceSolid) -> String {
    let ReferenceSolid {
        volume: theirs,
        is_valid,
        ..
    } = reference;
    let checker = if is_valid {
        ""
    } else {
        ", whose checker calls it invalid"
    };
    if volume.is_nan() {
        return format!("solid #{step_id} is missing, reference {theirs:.6} mm³{checker}");
    }
    format!(
        "solid #{step_id} has {volume:.6} mm³, its mesh {mesh:.6}, reference {theirs:.6}{checker}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(ours: &[(u64, [f64; 2])], expected: [usize; 5], differences: &[&str]) {
        let theirs = by_number(&[
            (Some(5), true, 100.0, true),
            (Some(6), false, 1.0, true),
            (Some(7), true, 4.0, true),
            (Some(7), true, 6.0, false),
            (None, true, 3.0, true),
        ]);
        let (count, found) = count_volumes(&ours.iter().copied().collect(), &theirs);
        let counts = [
            count.n_solids,
            count.n_agreeing,
            count.n_meshes_agreeing,
            count.n_valid,
            count.n_valid_agreeing,
        ];
        assert_eq!(counts, expected);
        assert_eq!(found, differences);
    }

    #[test]
    fn each_closed_solid_is_compared_once() {
        check(
            &[(5, [100.9, 98.0]), (6, [2.0, 2.0]), (7, [10.0, 10.0])],
            [2, 2, 1, 1, 1],
            &[],
        );
        check(
            &[(7, [12.0, 10.0])],
            [2, 0, 1, 1, 0],
            &[
                "solid #5 is missing, reference 100.000000 mm³",
                "solid #7 has 12.000000 mm³, its mesh 10.000000, reference 10.000000, whose checker calls it invalid",
            ],
        );
    }
}
