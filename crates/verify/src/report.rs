//! Makes one JSON document of the result: counts and rates by group, and each finding with its numbers.

use crate::{Finding, GroupCounts, Quantity};
use serde::Serialize;
use std::collections::BTreeMap;

/// All results of a folder of files.
#[derive(Debug, Serialize)]
pub struct VerificationReport {
    /// The groups by name: the first component of their files' paths.
    pub groups: BTreeMap<String, Counts>,
    /// All groups together.
    pub all: Counts,
    /// Each face and solid that contradicts itself.
    pub findings: Vec<FindingRow>,
    /// Each file that could not be read.
    pub failed: Vec<TextRow>,
    /// Files of the reference that are not in the folder.
    pub absent: Vec<String>,
    /// With a reference: each disagreement with it, with its `#` numbers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disagreements: Option<Vec<TextRow>>,
}

/// A face or solid that contradicts itself.
#[derive(Debug, Serialize)]
pub struct FindingRow {
    /// The file, below the folder.
    path: String,
    /// The `#` number of the face or solid.
    entity: u64,
    what: Quantity,
    #[serde(skip_serializing_if = "Option::is_none")]
    face_type: Option<&'static str>,
    values: TwoValues,
}

/// The same quantity, computed twice. It is `null` if it is NaN.
#[derive(Debug, Serialize)]
struct TwoValues {
    surface: f64,
    mesh: f64,
}

impl FindingRow {
    /// The finding in the file at `path`.
    #[must_use]
    pub fn new(path: &str, finding: &Finding) -> Self {
        let Finding {
            step_id,
            what,
            face_type,
            surface,
            mesh,
        } = *finding;
        Self {
            path: path.to_owned(),
            entity: step_id,
            what,
            face_type,
            values: TwoValues { surface, mesh },
        }
    }
}

/// A text about a file.
#[derive(Debug, Serialize)]
pub struct TextRow {
    /// The file, below the folder.
    pub path: String,
    /// The text.
    pub reason: String,
}

/// The sums over the files of a group.
#[derive(Debug, Serialize)]
pub struct Counts {
    n_files: usize,
    n_failed: usize,
    n_findings: usize,
    /// Faces whose quadrature and triangles give the same area.
    own_areas: Rate,
    /// Closed solids whose surfaces and triangles enclose the same volume.
    own_volumes: Rate,
    /// The counts that need a reference.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    by_reference: Option<ReferenceCounts>,
}

/// Files, faces and solids that agree with the reference.
#[derive(Debug, Serialize)]
struct ReferenceCounts {
    count: Rate,
    types: Rate,
    adjacency: Rate,
    partition: Rate,
    all_four: Rate,
    areas: Rate,
    n_faces_without_triangles: usize,
    mesh_areas: Rate,
    volumes: Rate,
    volumes_of_valid_solids: Rate,
    mesh_volumes: Rate,
    watertight: Rate,
}

/// A count out of a total.
#[derive(Debug, Serialize)]
struct Rate {
    n: usize,
    of: usize,
    /// `n / of`, or `null` if there is nothing to count.
    rate: Option<f64>,
}

impl Rate {
    fn new((n, of): (usize, usize)) -> Self {
        Self {
            n,
            of,
            rate: (of > 0).then(|| n as f64 / of as f64),
        }
    }
}

impl Counts {
    /// The rates of a group. Those that need a reference are only included if there is one.
    #[must_use]
    pub fn new(counts: &GroupCounts, has_reference: bool) -> Self {
        let own = counts.own;
        Self {
            n_files: counts.n_files,
            n_failed: counts.n_failed,
            n_findings: own.n_findings(),
            own_areas: Rate::new((own.n_faces_agreeing, own.n_faces)),
            own_volumes: Rate::new((own.n_solids_agreeing, own.n_solids)),
            by_reference: has_reference.then(|| ReferenceCounts::new(counts)),
        }
    }
}

impl ReferenceCounts {
    fn new(counts: &GroupCounts) -> Self {
        let [count, types, adjacency, all_four] =
            counts.exact.map(|exact| Rate::new((exact, counts.n_files)));
        let volumes = counts.volumes;
        Self {
            count,
            types,
            adjacency,
            partition: Rate::new(counts.partition),
            all_four,
            areas: Rate::new(counts.areas),
            n_faces_without_triangles: counts.n_without_triangles,
            mesh_areas: Rate::new((counts.n_unfolded, counts.n_faces)),
            volumes: Rate::new((volumes.n_agreeing, volumes.n_solids)),
            volumes_of_valid_solids: Rate::new((volumes.n_valid_agreeing, volumes.n_valid)),
            mesh_volumes: Rate::new((volumes.n_meshes_agreeing, volumes.n_solids)),
            watertight: Rate::new(counts.watertight),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_finding_has_its_position_and_both_numbers() {
        let area = Finding {
            step_id: 12,
            what: Quantity::Area,
            face_type: Some("plane"),
            surface: 2.5,
            mesh: f64::NAN,
        };
        let volume = Finding {
            step_id: 7,
            what: Quantity::Volume,
            face_type: None,
            surface: 8.0,
            mesh: 7.0,
        };
        for (finding, expected, text) in [
            (
                area,
                json!({"path": "a/b.step", "entity": 12, "what": "area", "face_type": "plane",
                       "values": {"surface": 2.5, "mesh": null}}),
                "face #12 (plane) has 2.500000 mm², its mesh NaN",
            ),
            (
                volume,
                json!({"path": "a/b.step", "entity": 7, "what": "volume", "values": {"surface": 8.0, "mesh": 7.0}}),
                "solid #7 encloses 8.000000 mm³, its mesh 7.000000",
            ),
        ] {
            assert_eq!(
                serde_json::to_value(FindingRow::new("a/b.step", &finding)).unwrap(),
                expected
            );
            assert_eq!(finding.to_string(), text);
        }
    }

    #[test]
    fn a_rate_of_nothing_is_null() {
        for (pair, rate) in [
            ((1, 4), json!(0.25)),
            ((3, 3), json!(1.0)),
            ((0, 0), json!(null)),
        ] {
            assert_eq!(serde_json::to_value(Rate::new(pair)).unwrap()["rate"], rate);
        }
    }
}
