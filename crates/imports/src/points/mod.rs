//! Imports one label per point of a cloud: type `points`.
//!
//! Each point of the carrier gets the label of the nearest labeled point. If the cloud has normals, the normals of both points
//! must agree, so that a thin sheet does not get labels from its other side.

mod cloud;
mod hdf5;
#[cfg_attr(not(feature = "hdf5"), path = "no_hdf5.rs")]
mod hdf5_file;

use crate::entries::{Content, Entries, Entry, only_one};
use crate::import::{Import, ImportError, JoinProblem, JoinReport, JoinedLabels};
use crate::import_type::{ImportType, ParameterKey};
use crate::nearest_label::NearestLabel;
use crate::parameters;
use crate::position::ensure_same_position;
use crate::shape_key::ShapeKey;
pub(crate) use cloud::{Cloud, label_of};
use hdf5::{Hdf5Request, Hdf5Row, cloud_of_file, cloud_of_row, is_hdf5, rows_of_file};
use partprobe_carrier::{Carrier, IGNORE, sha256_hex};
use partprobe_sources::{Origin, SourceContext, SourceFiles, SourceLabels};
use partprobe_transfer::{Limits, NearestPoint, Surface};
use std::sync::Arc;

/// Labels of points.
pub(crate) const POINTS: ImportType = ImportType {
    name: "points",
    description: "labels of points of a cloud: PLY, NPY, rows of text, or HDF5",
    keys: &[
        ParameterKey::required(
            "path",
            "a folder with the labeled points of each shape, or a file with those of one",
        ).path(),
        ParameterKey::optional(
            "points",
            "a folder with the positions, or one HDF5 file, if the files of `path` hold labels only",
        ).path(),
        ParameterKey::optional(
            "labels_from",
            "HDF5: which array holds the labels (labels, or seg_id)",
        ),
        ParameterKey::optional(
            "ids",
            "HDF5 with many shapes: a text file with the name of each shape, one per line",
        ).path(),
        ParameterKey::optional(
            "factor",
            "what positions are multiplied by to be millimeters (1)",
        ),
        ParameterKey::optional(
            "max_distance",
            "how far the nearest labeled point may be, as a fraction of the diagonal (0.05)",
        ),
        ParameterKey::optional(
            "max_angle_deg",
            "how far normals may differ, in degrees, if the points have normals (45)",
        ),
    ],
    check_values: |context| Settings::of(context).map(drop),
    make: open_points,
};

/// The endings of files with labels and positions.
const CLOUD_ENDINGS: &[&str] = &[
    ".ply", ".npy", ".txt", ".xyz", ".xyzc", ".pts", ".csv", ".h5", ".hdf5",
];
/// The endings of files with only labels.
const LABEL_ENDINGS: &[&str] = &[".seg", ".npy", ".txt", ".h5", ".hdf5"];
/// The largest distance of the box of a cloud from that of the carrier, as a fraction of the diagonal. It is large because a
/// sample seldom contains the corners of a shape.
const MAX_BOX_OFFSET: f64 = 0.1;

struct PointLabels {
    entries: Entries<Hdf5Row>,
    positions: Option<Entries<Hdf5Row>>,
    settings: Settings,
}

/// The settings of the join.
struct Settings {
    /// The array of an HDF5 file with the labels, or `None` to find it.
    labels_from: Option<String>,
    factor: f64,
    max_distance: f64,
    max_angle_deg: f64,
}

impl Settings {
    fn of(context: &SourceContext) -> Result<Self, ImportError> {
        Ok(Self {
            labels_from: context.parameter("labels_from").map(str::to_owned),
            factor: parameters::number(context, "factor", 1e-9..=1e9, 1.0)?,
            max_distance: parameters::number(context, "max_distance", 0.0..=1.0, 0.05)?,
            max_angle_deg: parameters::number(context, "max_angle_deg", 0.0..=180.0, 45.0)?,
        })
    }
}

fn open_points(context: &SourceContext) -> Result<Box<dyn Import>, ImportError> {
    let settings = Settings::of(context)?;
    let files = parameters::files(context)?;
    let ids = context.parameter("ids");
    let ids = ids.map(|path| names(path, files.as_ref())).transpose()?;
    let entries_at = |path: &str, endings: &'static [&'static str]| {
        let key_of = |below: &str| {
            let is_one = endings.iter().any(|ending| below.ends_with(ending));
            is_one.then(|| ShapeKey::of_label_path(below, &[]))
        };
        let read_all = |path: &str, bytes: Vec<u8>| all_entries(path, bytes, ids.as_deref());
        Entries::at(path, files.clone(), key_of, read_all)
    };
    let positions = context.parameter("points");
    let positions = positions
        .map(|path| entries_at(path, CLOUD_ENDINGS))
        .transpose()?;
    let endings = match positions {
        Some(_) => LABEL_ENDINGS,
        None => CLOUD_ENDINGS,
    };
    let path = context.parameter("path").unwrap_or_default();
    Ok(Box::new(PointLabels {
        entries: entries_at(path, endings)?,
        positions,
        settings,
    }))
}

/// The lines of a text file.
fn names(path: &str, files: &dyn SourceFiles) -> Result<Vec<String>, ImportError> {
    let unreadable = |reason: String| ImportError::Unreadable(reason);
    let bytes = files
        .read(path)
        .map_err(|error| unreadable(error.to_string()))?;
    let text =
        String::from_utf8(bytes).map_err(|_| unreadable(format!("{path}: not text in UTF-8")))?;
    let lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    Ok(lines.map(str::to_owned).collect())
}

/// The entries of a single file. It has the points of the shape after which it is named, or rows of HDF5 with one shape each.
fn all_entries(
    path: &str,
    bytes: Vec<u8>,
    ids: Option<&[String]>,
) -> Result<Vec<Entry<Hdf5Row>>, String> {
    match ids {
        Some(ids) if is_hdf5(path) => rows_of_file(path, bytes, ids),
        _ => Ok(vec![Entry {
            name: path.to_owned(),
            key: ShapeKey::of_label_path(path, &[]),
            content: Content::File(path.to_owned()),
        }]),
    }
}

/// Points, their origin, and the bytes from which they were read.
struct Loaded {
    cloud: Cloud,
    name: String,
    bytes: Vec<u8>,
}

impl PointLabels {
    /// The points of the only entry of a shape.
    fn loaded(
        entries: &Entries<Hdf5Row>,
        found: &[&Entry<Hdf5Row>],
        wanted: Hdf5Request<'_>,
    ) -> Result<Loaded, JoinProblem> {
        let entry = only_one(found)?;
        let unreadable =
            |reason: String| JoinProblem::Unreadable(format!("{}: {reason}", entry.name));
        match &entry.content {
            Content::Read(row) => {
                let cloud = cloud_of_row(row, wanted).map_err(unreadable)?;
                Ok(Loaded {
                    bytes: cloud.bytes(),
                    name: entry.name.clone(),
                    cloud,
                })
            }
            Content::File(path) => {
                let unreadable =
                    |reason: String| JoinProblem::Unreadable(format!("{path}: {reason}"));
                let bytes = entries.read(path)?;
                let cloud = if is_hdf5(path) {
                    cloud_of_file(bytes.clone(), wanted)
                } else {
                    Cloud::read(path, &bytes)
                };
                Ok(Loaded {
                    cloud: cloud.map_err(unreadable)?,
                    name: path.clone(),
                    bytes,
                })
            }
            Content::Damaged(reason) => Err(unreadable(reason.clone())),
        }
    }

    /// The labeled points of a shape, the names of their entries, and the hash of the bytes.
    fn cloud(&self, id: &str) -> Result<(Cloud, Vec<String>, String), JoinProblem> {
        let unreadable =
            |name: &str, reason: String| JoinProblem::Unreadable(format!("{name}: {reason}"));
        let found = self.entries.of_shape(id)?;
        let names = found.iter().map(|entry| entry.name.clone()).collect();
        let wanted = Hdf5Request::Labels(self.settings.labels_from.as_deref());
        let mut own = Self::loaded(&self.entries, &found, wanted)?;

        if let Some(positions) = &self.positions {
            let found = positions.of_shape(id).map_err(|problem| match problem {
                JoinProblem::NoLabels => JoinProblem::Refused(
                    "there are labels, but `points` has no positions for this shape".to_owned(),
                ),
                other => other,
            })?;
            let other = Self::loaded(positions, &found, Hdf5Request::Positions)?;
            own.cloud
                .take_positions(other.cloud)
                .map_err(|reason| unreadable(&other.name, reason))?;
            own.bytes.extend(other.bytes);
            own.name = other.name;
        }
        own.cloud
            .check()
            .map_err(|reason| unreadable(&own.name, reason))?;
        own.cloud.scale(self.settings.factor);
        Ok((own.cloud, names, sha256_hex(&own.bytes)))
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
            max_distance: self.settings.max_distance * diagonal,
            max_angle_deg: (!cloud.normals.is_empty()).then_some(self.settings.max_angle_deg),
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
            n_separate: 0,
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

    fn entries_of(&self, id: &str) -> Vec<String> {
        self.entries.names_of_shape(id)
    }
}
