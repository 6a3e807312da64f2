//! Compares one measured file with itself and with a reference. Counts and disagreements come out.

use crate::{
    Agreement, FileReading, Finding, GroupCounts, MeasureSettings, MeasuredFile, ReferenceFile,
    ReferenceSolid, SelfCount, VolumeCount, compare, compare_volumes, self_check,
};
use std::collections::BTreeMap;

/// The partition of a file is not counted if two faces of one type meet this close to θ, in degrees.
const ANGLE_SLACK_DEG: f64 = 1e-3;

/// The counts of one file for its group, and all its problems.
#[derive(Clone, Debug)]
pub struct FileComparison {
    /// The agreements with the reference, and each disagreement.
    pub agreement: Agreement,
    /// Faces and solids that contradict themselves.
    pub findings: Vec<Finding>,
    partition_counts: bool,
    volumes: VolumeCount,
    watertight: (usize, usize),
    own: SelfCount,
}

impl FileComparison {
    /// Compares a file with the faces of the reference, and with its solids if there are volumes.
    #[must_use]
    pub fn of(
        measured: &MeasuredFile,
        reference: &ReferenceFile,
        volumes: Option<&BTreeMap<u64, ReferenceSolid>>,
        settings: &MeasureSettings,
    ) -> Self {
        let (own, findings) = self_check(measured, settings.options.angle_rad);
        let mut agreement = compare(&FileReading::from(measured), &reference.reading());

        let (volumes, differences) = volumes
            .map(|solids| compare_volumes(measured, solids))
            .unwrap_or_default();
        let differences = differences
            .into_iter()
            .map(|text| format!("volume: {text}"));
        agreement.disagreements.extend(differences);

        let (watertight, open) = watertight_solids(measured);
        agreement.disagreements.extend(open);

        Self {
            agreement,
            findings,
            partition_counts: !reference.has_angle_near(settings.theta_deg, ANGLE_SLACK_DEG),
            volumes,
            watertight,
            own,
        }
    }

    /// Adds the file to its group.
    pub fn add_to(&self, counts: &mut GroupCounts) {
        counts.add(&self.agreement, self.partition_counts);
        counts.volumes.add(self.volumes);
        counts.own.add(self.own);
        counts.watertight.0 += self.watertight.0;
        counts.watertight.1 += self.watertight.1;
    }
}

/// The number of closed solids of the file with a watertight mesh, and one line per other closed solid.
fn watertight_solids(measured: &MeasuredFile) -> ((usize, usize), Vec<String>) {
    let mut count = (0, 0);
    let mut open = Vec::new();
    for (solid, measured) in measured.brep.solids.iter().zip(&measured.solids) {
        if !measured.closed {
            continue;
        }
        count.1 += 1;
        if measured.mesh.watertight {
            count.0 += 1;
        } else {
            open.push(format!(
                "watertight: solid #{} does not close",
                solid.step_id
            ));
        }
    }
    (count, open)
}
