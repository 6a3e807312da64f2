//! Reads and writes a point sample with its labels as an NPZ archive.

use crate::carrier::npz::attribute_members;
use crate::numpy::array::Array;
use crate::numpy::members::MemberError;
use crate::numpy::npz::{Compression, NpzError, NpzWriteError, arrays_from_npz, arrays_to_npz};
use partprobe_carrier::{PointSample, SurfaceAttributes};
use std::collections::BTreeMap;

/// Labels of sampled points, by the name of their source.
pub type SampleLabels = BTreeMap<String, Vec<i32>>;

const LABEL_PREFIX: &str = "label_";

/// The reason why bytes are not a point sample.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SampleFileError {
    /// The archive is damaged, foreign or newer than the program.
    #[error(transparent)]
    Archive(#[from] NpzError),
    /// A member is missing or has another type or shape.
    #[error(transparent)]
    Member(#[from] MemberError),
    /// A member does not have one row per point.
    #[error("member `{member}` has {found} rows for {expected} points")]
    Rows {
        /// The member.
        member: String,
        /// The number of its rows.
        found: usize,
        /// The number of points.
        expected: usize,
    },
}

/// The bytes of a sample: `points`, `normals`, `triangles`, and `label_<source>` for each source.
///
/// # Errors
/// If the archive would pass the limits of zip.
pub fn sample_to_npz(
    sample: &PointSample,
    labels: &SampleLabels,
    compression: Compression,
) -> Result<Vec<u8>, NpzWriteError> {
    sample_with_attributes_to_npz(sample, &SurfaceAttributes::default(), labels, compression)
}

/// The same with `uv`, `curvature` and `direction` of the points, unless their lists are empty.
///
/// # Errors
/// If the archive would pass the limits of zip.
pub fn sample_with_attributes_to_npz(
    sample: &PointSample,
    attributes: &SurfaceAttributes,
    labels: &SampleLabels,
    compression: Compression,
) -> Result<Vec<u8>, NpzWriteError> {
    let names: Vec<String> = labels
        .keys()
        .map(|source| format!("{LABEL_PREFIX}{source}"))
        .collect();
    let mut members = vec![
        ("points", Array::rows(&sample.points)),
        ("normals", Array::rows(&sample.normals)),
        ("triangles", Array::vector(sample.triangles.clone())),
    ];
    members.extend(attribute_members(
        ["uv", "curvature", "direction"],
        attributes,
    ));
    members.extend(
        names
            .iter()
            .zip(labels.values())
            .map(|(name, values)| (name.as_str(), Array::vector(values.clone()))),
    );
    arrays_to_npz(&members, compression)
}

/// The sample and its labels in the bytes of their file.
///
/// # Errors
/// If the archive is damaged, or its members do not have one row per point.
pub fn sample_from_npz(bytes: &[u8]) -> Result<(PointSample, SampleLabels), SampleFileError> {
    let mut members = arrays_from_npz(bytes)?;
    let sources: Vec<String> = members
        .names()
        .filter_map(|name| name.strip_prefix(LABEL_PREFIX))
        .map(str::to_owned)
        .collect();
    let points: Vec<[f32; 3]> = members.rows("points")?;
    let expected = points.len();
    let normals = checked("normals", members.rows("normals")?, expected)?;
    let triangles = checked("triangles", members.vector("triangles")?, expected)?;
    let mut labels = SampleLabels::new();
    for source in sources {
        let member = format!("{LABEL_PREFIX}{source}");
        labels.insert(
            source,
            checked(&member, members.vector(&member)?, expected)?,
        );
    }
    Ok((
        PointSample {
            points,
            normals,
            triangles,
        },
        labels,
    ))
}

fn checked<T>(member: &str, rows: Vec<T>, expected: usize) -> Result<Vec<T>, SampleFileError> {
    let found = rows.len();
    if found == expected {
        Ok(rows)
    } else {
        Err(SampleFileError::Rows {
            member: member.to_owned(),
            found,
            expected,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_points() -> PointSample {
        PointSample {
            points: vec![[0.5, 1.0, 2.0], [3.0; 3]],
            normals: vec![[0.0, 0.0, 1.0]; 2],
            triangles: vec![7, 0],
        }
    }

    #[test]
    fn samples_come_back_with_every_source() {
        let labels = SampleLabels::from([
            ("step-parts".to_owned(), vec![0, -1]),
            ("primitive".to_owned(), vec![1, 1]),
        ]);
        let bytes = sample_to_npz(&two_points(), &labels, Compression::Deflated).unwrap();
        assert_eq!(sample_from_npz(&bytes), Ok((two_points(), labels)));
    }

    #[test]
    fn a_label_for_each_point_is_needed() {
        let labels = SampleLabels::from([("step-parts".to_owned(), vec![0])]);
        let bytes = sample_to_npz(&two_points(), &labels, Compression::Stored).unwrap();
        let rows = SampleFileError::Rows {
            member: "label_step-parts".to_owned(),
            found: 1,
            expected: 2,
        };
        assert_eq!(sample_from_npz(&bytes), Err(rows));
        let bare = arrays_to_npz(
            &[("points", Array::rows(&[[0.0f32; 3]]))],
            Compression::Stored,
        )
        .unwrap();
        assert_eq!(
            sample_from_npz(&bare),
            Err(MemberError::Missing("normals".to_owned()).into())
        );
        assert!(matches!(
            sample_from_npz(b""),
            Err(SampleFileError::Archive(_))
        ));
    }
}
