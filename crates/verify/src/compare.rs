//! Compares two readings of one file.

use crate::FileReading;
use std::collections::BTreeMap;

/// Areas agree if they differ by at most this fraction of the reference's area.
const AREA_TOLERANCE: f64 = 0.01;
/// The area of a face's triangles may differ from its own area by this fraction. With a larger difference, sampling by area would
/// draw wrong numbers of points.
const MESH_AREA_TOLERANCE: f64 = 0.15;

/// The numbers of faces that agree in area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaCount {
    /// Faces that both readings have.
    pub n_faces: usize,
    /// Faces to which the reference gives an area above zero, analytically or by its mesh.
    pub n_comparable: usize,
    /// Comparable faces whose area is within 1 % of the reference's analytic or mesh area.
    pub n_agreeing: usize,
    /// Faces without a triangle, although the reference's mesh has area there.
    pub n_without_triangles: usize,
    /// Faces whose triangles have the face's own area, within 15 %.
    pub n_unfolded: usize,
}

/// The agreements, and each disagreement in words.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Agreement {
    /// Whether the same `#` numbers are faces.
    pub count: bool,
    /// Whether the faces also have the same types.
    pub types: bool,
    /// Whether the same pairs share the same number of edges.
    pub adjacency: bool,
    /// Whether the partitions are equal.
    pub partition: bool,
    /// The areas.
    pub areas: AreaCount,
    /// Each disagreement, with its `#` numbers.
    pub disagreements: Vec<String>,
}

/// Compares the reading of partprobe with that of the reference.
#[must_use]
pub fn compare(ours: &FileReading, theirs: &FileReading) -> Agreement {
    let mut agreement = Agreement::default();
    let mut note = |what: &str, found: Vec<String>| {
        let agrees = found.is_empty();
        agreement
            .disagreements
            .extend(found.into_iter().map(|text| format!("{what}: {text}")));
        agrees
    };
    agreement.count = note("count", face_differences(ours, theirs));
    agreement.types = note("type", type_differences(ours, theirs)) && agreement.count;
    agreement.adjacency = note("adjacency", pair_differences(&ours.pairs, &theirs.pairs));
    agreement.partition = note("partition", part_differences(ours, theirs)) && agreement.count;
    let (areas, differences) = compare_areas(ours, theirs);
    agreement.areas = areas;
    note("area", differences);
    agreement
}

fn face_differences(ours: &FileReading, theirs: &FileReading) -> Vec<String> {
    let missing = theirs
        .faces
        .keys()
        .filter(|id| !ours.faces.contains_key(id))
        .map(|id| format!("face #{id} is missing"));
    let extra = ours
        .faces
        .keys()
        .filter(|id| !theirs.faces.contains_key(id))
        .map(|id| format!("face #{id} is not in the reference"));
    missing.chain(extra).collect()
}

fn type_differences(ours: &FileReading, theirs: &FileReading) -> Vec<String> {
    let both = ours
        .faces
        .iter()
        .filter_map(|(id, face)| Some((id, &face.face_type, &theirs.faces.get(id)?.face_type)));
    both.filter(|(_, ours, theirs)| ours != theirs)
        .map(|(id, ours, theirs)| format!("#{id} is {ours}, reference {theirs}"))
        .collect()
}

fn pair_differences(ours: &[[u64; 2]], theirs: &[[u64; 2]]) -> Vec<String> {
    let mut counts: BTreeMap<[u64; 2], (usize, usize)> = BTreeMap::new();
    for pair in ours {
        counts.entry(*pair).or_default().0 += 1;
    }
    for pair in theirs {
        counts.entry(*pair).or_default().1 += 1;
    }
    let differing = counts
        .into_iter()
        .filter(|(_, (ours, theirs))| ours != theirs);
    differing
        .map(|([a, b], (ours, theirs))| {
            format!("#{a} and #{b} share {ours} edges, reference {theirs}")
        })
        .collect()
}

fn part_differences(ours: &FileReading, theirs: &FileReading) -> Vec<String> {
    let (ours, theirs) = (ours.lowest_of_part(), theirs.lowest_of_part());
    let both = ours
        .iter()
        .filter_map(|(id, ours)| Some((id, ours, theirs.get(id)?)));
    both.filter(|(_, ours, theirs)| ours != theirs)
        .map(|(id, ours, theirs)| format!("#{id} is in the part of #{ours}, reference #{theirs}"))
        .collect()
}

fn compare_areas(ours: &FileReading, theirs: &FileReading) -> (AreaCount, Vec<String>) {
    let mut count = AreaCount::default();
    let mut differences = Vec::new();
    for (id, face) in &ours.faces {
        let Some(reference) = theirs.faces.get(id) else {
            continue;
        };
        count.n_faces += 1;
        let candidates: Vec<f64> = [reference.area, reference.mesh_area]
            .into_iter()
            .flatten()
            .collect();
        let is_comparable = candidates.iter().any(|&area| area > 0.0);
        count.n_comparable += usize::from(is_comparable);
        let area = face.area.unwrap_or(f64::NAN);
        if candidates
            .iter()
            .any(|reference| (area - reference).abs() <= AREA_TOLERANCE * reference.abs())
        {
            count.n_agreeing += usize::from(is_comparable);
        } else {
            differences.push(format!(
                "#{id} ({}) has {area:.6} mm², reference {candidates:.6?}",
                face.face_type
            ));
        }
        let mesh_area = face.mesh_area.unwrap_or(0.0);
        if (mesh_area - area).abs() <= MESH_AREA_TOLERANCE * area {
            count.n_unfolded += 1;
        } else {
            differences.push(format!(
                "#{id} ({}) has {area:.6} mm², its mesh {mesh_area:.6}",
                face.face_type
            ));
        }
        if face.mesh_area.is_none() && reference.mesh_area.is_some_and(|area| area > 0.0) {
            count.n_without_triangles += 1;
            differences.push(format!("#{id} ({}) has no triangles", face.face_type));
        }
    }
    (count, differences)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FaceReading;

    /// Faces `(id, type, part, area)`; every face has triangles.
    fn observed(faces: &[(u64, &str, u64, f64)], pairs: &[[u64; 2]]) -> FileReading {
        let face = |&(id, face_type, part, area): &(u64, &str, u64, f64)| {
            (
                id,
                FaceReading {
                    face_type: face_type.to_owned(),
                    part,
                    area: Some(area),
                    mesh_area: Some(area),
                },
            )
        };
        FileReading::new(faces.iter().map(face).collect(), pairs.to_vec())
    }

    #[track_caller]
    fn check(ours: &FileReading, exact: [bool; 4], n_agreeing: usize, disagreements: &[&str]) {
        let theirs = observed(
            &[
                (5, "plane", 0, 1.0),
                (6, "plane", 0, 2.0),
                (7, "cone", 1, 3.0),
            ],
            &[[5, 6], [6, 7], [6, 7]],
        );
        let agreement = compare(ours, &theirs);
        assert_eq!(
            [
                agreement.count,
                agreement.types,
                agreement.adjacency,
                agreement.partition
            ],
            exact
        );
        assert_eq!(agreement.areas.n_agreeing, n_agreeing);
        assert_eq!(agreement.disagreements, disagreements);
    }

    #[test]
    fn a_face_without_an_area_in_the_reference_is_not_compared() {
        let theirs = observed(&[(5, "plane", 0, -2.0), (6, "plane", 0, 2.0)], &[]);
        let areas = compare(
            &observed(&[(5, "plane", 0, 1.0), (6, "plane", 0, 2.0)], &[]),
            &theirs,
        )
        .areas;
        assert_eq!(
            (areas.n_faces, areas.n_comparable, areas.n_agreeing),
            (2, 1, 1)
        );
    }

    #[test]
    fn each_disagreement_is_named() {
        let pairs = [[6, 5], [6, 7], [7, 6]];
        check(
            &observed(
                &[
                    (5, "plane", 3, 1.0),
                    (6, "plane", 3, 2.0),
                    (7, "cone", 2, 3.02),
                ],
                &pairs,
            ),
            [true; 4],
            3,
            &[],
        );
        check(
            &observed(&[(5, "plane", 0, 1.0), (6, "plane", 0, 2.0)], &pairs[..1]),
            [false, false, false, false],
            2,
            &[
                "count: face #7 is missing",
                "adjacency: #6 and #7 share 0 edges, reference 2",
            ],
        );
        check(
            &observed(
                &[
                    (5, "plane", 0, 1.0),
                    (6, "bspline", 1, 2.1),
                    (7, "cone", 2, 3.0),
                ],
                &pairs,
            ),
            [true, false, true, false],
            2,
            &[
                "type: #6 is bspline, reference plane",
                "partition: #6 is in the part of #6, reference #5",
                "area: #6 (bspline) has 2.100000 mm², reference [2.000000, 2.000000]",
            ],
        );
    }
}
