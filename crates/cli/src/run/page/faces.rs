//! Stores the face of each test point, and computes it for runs that did not store it.

use crate::config::Config;
use crate::points::points_of;
use crate::run::data_path::remembered_data;
use crate::run::folder::RunFolder;
use crate::run::shapes::Shape;
use anyhow::Result;
use partprobe_carrier::{Carrier, FaceType, PointSample, ShapeKind};
use partprobe_dataset::Dataset;
use partprobe_formats::{Array, Members};
use partprobe_report::ShapeFaces;
use std::path::Path;

/// The members of `test/<shape>.npz` with faces.
const MEMBERS: [&str; 3] = ["face", "face_canonical_type", "face_step_id"];

/// The face of each point, and the type and the `#` number of each face, as members of an NPZ file. There are none without a
/// B-Rep.
///
/// # Errors
/// If the carrier of the shape is missing or has changed.
pub(in crate::run) fn face_members(shape: &Shape) -> Result<Vec<(String, Array)>> {
    let (carrier, _) = shape.carrier.read()?;
    let Some(faces) = faces_of(&carrier, &shape.sample) else {
        return Ok(Vec::new());
    };
    let types: Vec<u8> = faces
        .types
        .iter()
        .map(|face_type| face_type.code())
        .collect();
    let arrays = [
        Array::vector(faces.of_point),
        Array::vector(types),
        Array::vector(faces.step_ids),
    ];
    Ok(MEMBERS.map(str::to_owned).into_iter().zip(arrays).collect())
}

/// The faces in the file of a test shape, if it has them.
pub(super) fn stored_faces(members: &mut Members) -> Option<ShapeFaces> {
    let [of_point, types, step_ids] = MEMBERS;
    let types: Vec<u8> = members.vector(types).ok()?;
    Some(ShapeFaces {
        of_point: members.vector(of_point).ok()?,
        types: types
            .into_iter()
            .map(|code| FaceType::from_code(code).unwrap_or(FaceType::Other))
            .collect(),
        step_ids: members.vector(step_ids).ok()?,
    })
}

/// The faces of points that were drawn from a carrier. A mesh or a cloud has no faces with types.
fn faces_of(carrier: &Carrier, sample: &PointSample) -> Option<ShapeFaces> {
    if carrier.kind() != ShapeKind::Brep {
        return None;
    }
    let tri_face = &carrier.mesh().tri_face;
    let faces = &carrier.graph().faces;
    let of_triangle = |&triangle: &u32| tri_face.get(triangle as usize).copied();
    Some(ShapeFaces {
        of_point: sample
            .triangles
            .iter()
            .map(of_triangle)
            .collect::<Option<_>>()?,
        types: faces.iter().map(|face| face.canonical_type).collect(),
        step_ids: faces.iter().map(|face| face.step_id).collect(),
    })
}

/// The origin of the faces of points.
pub(in crate::run) enum FaceSource {
    /// Every test shape has its faces, or there are none.
    Stored,
    /// The data set of a run of an earlier version, which did not store faces.
    Redrawn(Dataset),
    /// The data set does not exist any more. The text is the reason.
    Unknown(String),
}

impl FaceSource {
    /// The data set of the run, or the one that is given.
    ///
    /// # Errors
    /// If the one that is given cannot be opened.
    pub(super) fn of(folder: &RunFolder, data: Option<&Path>) -> Result<Self> {
        if let Some(path) = data {
            return Ok(Self::Redrawn(Dataset::open(path)?));
        }
        let found = remembered_data(folder).and_then(|path| Ok(Dataset::open(&path)?));
        Ok(found.map_or_else(|error| Self::Unknown(format!("{error:#}")), Self::Redrawn))
    }

    /// The faces of a shape with these points, if its carrier still gives the same points.
    pub(super) fn faces(
        &self,
        id: &str,
        points: &[[f32; 3]],
        config: &Config,
    ) -> Option<ShapeFaces> {
        let Self::Redrawn(dataset) = self else {
            return None;
        };
        let entry = dataset.labeled().into_iter().find(|entry| entry.id == id)?;
        let (carrier, _) = dataset.carrier_ref(entry).ok()?.read().ok()?;
        let sample = points_of(id, &carrier, &config.sample).ok()?;
        (sample.points == points).then(|| faces_of(&carrier, &sample))?
    }

    /// The reason why faces may be unknown.
    pub(super) fn note(&self) -> Option<String> {
        match self {
            Self::Stored | Self::Redrawn(_) => None,
            Self::Unknown(reason) => Some(format!(
                "the data set of the run could not be opened ({reason}), so faces and their types are only known if the run stored them; \
                 say with --data DATASET where it is"
            )),
        }
    }
}
