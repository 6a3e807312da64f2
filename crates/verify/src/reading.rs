//! Reduces a file to data that two kernels can compare: faces by their `#` numbers, and pairs of them.

use crate::MeasuredFile;
use std::collections::BTreeMap;

/// A face that a kernel has read.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceReading {
    /// The name of the primitive type.
    pub face_type: String,
    /// A number that the faces of one part share.
    pub part: u64,
    /// Area of the trimmed surface, in square millimeters.
    pub area: Option<f64>,
    /// The area of the face's triangles, or `None` if it has no triangle.
    pub mesh_area: Option<f64>,
}

/// Faces by `#` number, and the pairs that share an edge, once per edge.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileReading {
    /// The faces.
    pub faces: BTreeMap<u64, FaceReading>,
    /// The pairs, sorted, the lower `#` number first.
    pub pairs: Vec<[u64; 2]>,
}

impl FileReading {
    /// Sorts the pairs.
    #[must_use]
    pub fn new(faces: BTreeMap<u64, FaceReading>, mut pairs: Vec<[u64; 2]>) -> Self {
        pairs.iter_mut().for_each(|pair| pair.sort_unstable());
        pairs.sort_unstable();
        Self { faces, pairs }
    }

    /// The lowest `#` number of each face's part: equal maps mean equal partitions.
    #[must_use]
    pub fn lowest_of_part(&self) -> BTreeMap<u64, u64> {
        let mut lowest: BTreeMap<u64, u64> = BTreeMap::new();
        for (&step_id, face) in &self.faces {
            lowest.entry(face.part).or_insert(step_id);
        }
        self.faces
            .iter()
            .map(|(&step_id, face)| (step_id, lowest[&face.part]))
            .collect()
    }
}

impl From<&MeasuredFile> for FileReading {
    fn from(measured: &MeasuredFile) -> Self {
        let graph = &measured.shape.graph;
        let mesh = &measured.shape.mesh;
        let mut mesh_areas: Vec<Option<f64>> = vec![None; graph.faces.len()];
        for (area, &face) in mesh.triangle_areas().into_iter().zip(&mesh.tri_face) {
            *mesh_areas[face as usize].get_or_insert(0.0) += area;
        }
        let observed = |(idx, face): (usize, &partprobe_carrier::Face)| {
            let part = u64::from(measured.partition.parts()[idx]);
            let face_type = face.face_type.name().to_owned();
            (
                face.step_id,
                FaceReading {
                    face_type,
                    part,
                    area: Some(face.area),
                    mesh_area: mesh_areas[idx],
                },
            )
        };
        let faces = graph.faces.iter().enumerate().map(observed).collect();
        let pairs = graph
            .edges
            .iter()
            .map(|edge| edge.faces.map(|face| graph.faces[face as usize].step_id))
            .collect();
        Self::new(faces, pairs)
    }
}
