//! Reads a line of a reference: the reading of one file by another kernel.

use crate::{FaceReading, FileReading};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// One file as the reference has read it.
#[derive(Clone, Debug, Deserialize)]
pub struct ReferenceFile {
    /// The path below the compared folder. Its first component is the group.
    pub file: String,
    /// `ok` if the reference could read the file.
    pub status: String,
    #[serde(default)]
    faces: Vec<ReferenceFace>,
    #[serde(default)]
    edges: Vec<ReferenceEdge>,
}

/// `[step id, occurrence, type, part, shell, analytic area, mesh area]`.
#[derive(Clone, Debug, Deserialize)]
struct ReferenceFace(
    Option<u64>,
    IgnoredAny,
    String,
    u64,
    IgnoredAny,
    Option<f64>,
    Option<f64>,
);

/// `[face index, face index, φ in degrees, length]`.
#[derive(Clone, Debug, Deserialize)]
struct ReferenceEdge(usize, usize, Option<f64>, IgnoredAny);

impl ReferenceFile {
    /// A file without data of a reference.
    #[must_use]
    pub fn unseen(file: String) -> Self {
        Self {
            file,
            status: "ok".to_owned(),
            faces: Vec::new(),
            edges: Vec::new(),
        }
    }

    /// The first component of the path, or `.` if the file is in the folder itself.
    #[must_use]
    pub fn group(&self) -> &str {
        self.file.split_once('/').map_or(".", |(group, _)| group)
    }

    /// Whether two faces of one type meet within `slack` degrees of `theta_deg`, so that kernels may round to different sides.
    #[must_use]
    pub fn has_angle_near(&self, theta_deg: f64, slack: f64) -> bool {
        self.edges.iter().any(|edge| {
            let same_type = self
                .faces
                .get(edge.0)
                .zip(self.faces.get(edge.1))
                .is_some_and(|(a, b)| a.2 == b.2);
            same_type && edge.2.is_some_and(|phi| (phi - theta_deg).abs() < slack)
        })
    }

    /// The distinct faces, each by its first occurrence, and the edges between them.
    #[must_use]
    pub fn reading(&self) -> FileReading {
        let mut first_of: BTreeMap<u64, usize> = BTreeMap::new();
        for (idx, face) in self.faces.iter().enumerate() {
            if let Some(step_id) = face.0 {
                first_of.entry(step_id).or_insert(idx);
            }
        }
        let step_id_of = |idx: usize| {
            self.faces
                .get(idx)
                .and_then(|face| face.0)
                .filter(|id| first_of.get(id) == Some(&idx))
        };
        let pair_of = |edge: &ReferenceEdge| Some([step_id_of(edge.0)?, step_id_of(edge.1)?]);
        let faces = first_of
            .iter()
            .map(|(&step_id, &idx)| (step_id, self.faces[idx].reading()))
            .collect();
        FileReading::new(faces, self.edges.iter().filter_map(pair_of).collect())
    }
}

impl ReferenceFace {
    fn reading(&self) -> FaceReading {
        FaceReading {
            face_type: self.2.clone(),
            part: self.3,
            area: self.5,
            mesh_area: self.6,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> ReferenceFile {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn a_repeated_occurrence_counts_once() {
        let file = line(
            r#"{"file":"abc/x.step","status":"ok",
               "faces":[[5,0,"plane",0,0,1.0,1.0],[6,0,"plane",0,0,1.0,1.0],[5,1,"plane",1,1,1.0,1.0],[6,1,"plane",1,1,1.0,null]],
               "edges":[[0,1,8.0005,2.0],[2,3,8.0005,2.0]]}"#,
        );
        let reading = file.reading();
        assert_eq!(reading.faces.keys().copied().collect::<Vec<_>>(), [5, 6]);
        assert_eq!(reading.pairs, [[5, 6]]);
        assert!(file.has_angle_near(8.0, 1e-3) && !file.has_angle_near(8.0, 1e-4));
        assert_eq!(file.group(), "abc");
        assert!(
            line(r#"{"file":"x.step","status":"no_faces"}"#)
                .reading()
                .faces
                .is_empty()
        );
    }
}
