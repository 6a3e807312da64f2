//! Imports a label per point of a cloud: type `points`.
//!
//! Each point of the carrier takes the label of the nearest labeled point. If the cloud has normals, those of the two must
//! agree, so that a thin sheet does not take labels from its other side.

mod cloud;

use crate::entries::{Content, Entries, Entry, one_path};
use crate::import::{Import, ImportError, JoinProblem, JoinReport, JoinedLabels};
use crate::import_type::{ImportType, ParameterKey};
use crate::nearest_label::NearestLabel;
use crate::parameters;
use crate::position::ensure_same_position;
use crate::shape_key::ShapeKey;
pub(crate) use cloud::{Cloud, label_of};
use partprobe_carrier::{Carrier, IGNORE, sha256_hex};
use partprobe_sources::{Origin, SourceContext, SourceLabels};
use partprobe_transfer::{Limits, NearestPoint, Surface};
use std::sync::Arc;

/// Labels of points.
pub(crate) const POINTS: ImportType = ImportType {
    name: "points",
    description: "labels of points of a cloud: PLY, NPY, or rows of text",
    keys: &[
        ParameterKey {
            name: "path",
            description: "a folder with the labeled points of each shape, or a file with those of one",
            is_required: true,
        },
        ParameterKey {
            name: "points",
            description: "a folder with the positions, if the files of `path` hold labels only",
            is_required: false,
        },
        ParameterKey {
            name: "factor",
            description: "what positions are multiplied by to be millimeters (1)",
            is_required: false,
        },
        ParameterKey {
            name: "max_distance",
            description: "how far the nearest labeled point may be, as a fraction of the diagonal (0.05)",
            is_required: false,
        },
        ParameterKey {
            name: "max_angle_deg",
            description: "how far normals may differ, in degrees, if the points have normals (45)",
            is_required: false,
        },
    ],
    make: open_points,
};

/// The endings of files with labels and positions.
const CLOUD_ENDINGS: &[&str] = &[".ply", ".npy", ".txt", ".xyz", ".xyzc", ".pts", ".csv"];
/// The endings of files with labels alone.
const LABEL_ENDINGS: &[&str] = &[".seg", ".npy", ".txt"];
/// How far the box of a cloud may be from that of the carrier, as a fraction of the diagonal: a sample seldom holds the
/// corners of a shape.
const MAX_BOX_OFFSET: f64 = 0.1;

struct PointLabels {
    entries: Entries<()>,
    positions: Option<Entries<()>>,
    factor: f64,
    max_distance: f64,
    max_angle_deg: f64,
}

fn open_points(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
    let files = parameters::files(context)?;
    let key_among = |endings: &'static [&'static str]| {
        move |below: &str| {
            let is_one = endings.iter().any(|ending| below.ends_with(ending));
            is_one.then(|| ShapeKey::of_label_path(below, &[]))
        }
    };
    let positions = context
        .parameter("points")
        .map(|path| Entries::at(path, files.clone(), key_among(CLOUD_ENDINGS), one_entry))
        .transpose()?;
    let endings = match positions {
        Some(_) => LABEL_ENDINGS,
        None => CLOUD_ENDINGS,
    };
    let path = context.parameter("path").unwrap_or_default();
    Ok(Box::new(PointLabels {
        entries: Entries::at(path, files, key_among(endings), one_entry)?,
        positions,
        factor: parameters::number(context, "factor", 1e-9..=1e9, 1.0)?,
        max_distance: parameters::number(context, "max_distance", 0.0..=1.0, 0.05)?,
        max_angle_deg: parameters::number(context, "max_angle_deg", 0.0..=180.0, 45.0)?,
    }))
}

/// A single file holds the points of the shape that it is named after.
fn one_entry(path: &str, _bytes: Vec<u8>) -> Result<Vec<Entry<()>>, String> {
    Ok(vec![Entry {
        name: path.to_owned(),
        key: ShapeKey::of_label_path(path, &[]),
        content: Content::File(path.to_owned()),
    }])
}

impl PointLabels {
    /// The labeled points of a shape, the names of their entries, and the hash of the bytes.
    fn cloud(&self, id: &str) -> Result<(Cloud, Vec<String>, String), JoinProblem> {
        let found = self.entries.of_shape(id)?;
        let names = found.iter().map(|entry| entry.name.clone()).collect();
        let path = one_path(&found)?;
        let unreadable =
            |path: &str, reason: String| JoinProblem::Unreadable(format!("{path}: {reason}"));
        let mut bytes = self.entries.read(&path)?;
        let mut cloud = Cloud::read(&path, &bytes).map_err(|reason| unreadable(&path, reason))?;

        if let Some(positions) = &self.positions {
            let found = positions.of_shape(id).map_err(|problem| match problem {
                JoinProblem::NoLabels => JoinProblem::Refused(
                    "there are labels, but `points` has no positions for this shape".to_owned(),
                ),
                other => other,
            })?;
            let path = one_path(&found)?;
            let of_positions = positions.read(&path)?;
            cloud
                .take_positions(&path, &of_positions)
                .map_err(|reason| unreadable(&path, reason))?;
            bytes.extend(of_positions);
        }
        cloud.check().map_err(|reason| unreadable(&path, reason))?;
        cloud.scale(self.factor);
        Ok((cloud, names, sha256_hex(&bytes)))
    }
}

impl Import for PointLabels {
    fn join(&self, carrier: &Carrier) -> Result<JoinedLabels, JoinProblem> {
        let refused =
            |error: partprobe_transfer::TransferError| JoinProblem::Refused(error.to_string());
        let (cloud, entries, content_hash) = self.cloud(&carrier.meta().id)?;
        let diagonal = carrier.meta().diagonal_mm;
        let mesh = carrier.mesh();
        ensure_same_position(&mesh.vertices, &cloud.positions, MAX_BOX_OFFSET * diagonal)?;

        let surface = Surface::of_mesh(mesh).map_err(refused)?;
        let limits = Limits {
            max_distance: self.max_distance * diagonal,
            max_angle_deg: (!cloud.normals.is_empty()).then_some(self.max_angle_deg),
        };
        let normal = |triangle: usize| match mesh.is_cloud() {
            true => mesh.vertex_normal[mesh.triangles[triangle][0] as usize].map(f64::from),
            false => surface.normal(triangle),
        };
        let normals = (0..mesh.triangles.len()).map(normal);
        let rule = NearestLabel {
            nearest: NearestPoint::new(&cloud.positions, &cloud.normals).map_err(refused)?,
            labels: cloud.labels,
            normals: normals.collect(),
            limits,
        };
        let labels = SourceLabels::on_points(mesh, Arc::new(rule));

        let of_triangle = labels.of_triangles().of_triangle();
        let unlabeled = (0u32..)
            .zip(of_triangle)
            .filter(|&(_, &label)| label == IGNORE);
        let report = JoinReport {
            entries,
            by: "nn-point".to_owned(),
            items: "triangles",
            n_items: of_triangle.len(),
            n_matched: of_triangle.iter().filter(|&&label| label != IGNORE).count(),
            unlabeled: unlabeled
                .map(|(triangle, _)| format!("triangle {triangle}"))
                .collect(),
            unused: Vec::new(),
        };
        if report.n_matched == 0 {
            return Err(JoinProblem::Refused(
                "no triangle has a labeled point near its center".to_owned(),
            ));
        }
        let origin = Origin {
            content_hash,
            join: report.to_string(),
        };
        Ok(JoinedLabels {
            labels: labels.with_origin(origin),
            report,
        })
    }

    fn entries(&self) -> Result<Vec<String>, ImportError> {
        Ok(self.entries.names())
    }
}
