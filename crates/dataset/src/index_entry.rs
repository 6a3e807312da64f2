//! Defines a line of the index: a shape with its counts and files, or a file without a carrier and the reason.

use partprobe_carrier::{Carrier, ShapeKind};
use serde::{Deserialize, Serialize};

/// How labeling a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A carrier was written.
    Ok,
    /// The file cannot be labeled. The reason is given.
    Failed,
    /// The worker process ended because of memory, stack, or a defect of the program.
    Crashed,
    /// The watchdog ended the worker process.
    TimedOut,
    /// The file needs more work or memory than the settings allow. The reason names the budget.
    OverBudget,
    /// The member of an archive is not read, because its name is unsafe or already used, or because it is not a plain file. Or
    /// the package to which files are attached does not have this file.
    Refused,
    /// The labels differ from those of the package to which the file was attached. The reason names the first difference.
    Differs,
    /// An item in a folder is not read, because it is not a file or does not have an extension of STEP files.
    Skipped,
}

impl Status {
    /// The name that the index uses.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Failed => "failed",
            Self::Crashed => "crashed",
            Self::TimedOut => "timed-out",
            Self::OverBudget => "over-budget",
            Self::Refused => "refused",
            Self::Differs => "differs",
            Self::Skipped => "skipped",
        }
    }
}

/// One line of the index: a shape with its carrier, or a file without one.
///
/// The counts are 0 if there is no carrier.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct IndexEntry {
    /// The shape's id. The carrier's file is named after it.
    pub id: String,
    /// The file, given by the name of the argument and the path below it. It is the same on any machine.
    pub source: String,
    /// How labeling ended.
    pub status: Status,
    /// The reason why there is no carrier.
    pub reason: Option<String>,
    /// The carrier, relative to the data set.
    pub file: Option<String>,
    /// The hash of the carrier's contents, in hexadecimal, or `None` if an earlier version of the program labeled the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_hash: Option<String>,
    /// The file with only the labels and the face graph, if it was requested, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels_file: Option<String>,
    /// The point sample, if it was requested, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_file: Option<String>,
    /// The index of a refused member in its archive, counted from 1. It distinguishes members with the same name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub member: Option<u64>,
    /// The number of files that are not read, if the line counts such files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n_skipped: Option<u64>,
    /// SHA-256 of the STEP text, in hexadecimal, or `None` if the text could not be read.
    pub sha256: Option<String>,
    /// `#` number of the solid, if solids are the unit.
    pub solid_step_id: Option<u64>,
    /// The solid's name, unless it is a name like `Part 1`.
    pub product: Option<String>,
    /// `mesh` or `cloud`, for a shape without a B-Rep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The number of further solids of the file that equal this one and were not labeled again.
    pub n_equal_solids: usize,
    /// Faces.
    pub n_faces: usize,
    /// The number of parts before small ones were absorbed.
    pub n_parts: usize,
    /// The number of parts after small ones were absorbed.
    pub n_labels: usize,
    /// Triangles of the plain carrier.
    pub n_triangles: usize,
    /// Shared edges.
    pub n_edges: usize,
    /// Shared edges without a defined angle.
    pub n_undefined_angles: usize,
    /// Edges with more than two faces.
    pub n_non_manifold_edges: u64,
    /// Every face, loop and entity that was lost, with its `#` number and the reason.
    pub lost: Vec<String>,
    /// Notes about what was left out on purpose, and about faces that the file gives as triangles, with `#` numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl IndexEntry {
    /// The line of a file that has no carrier.
    #[must_use]
    pub fn without_carrier(id: &str, source: &str, status: Status, reason: String) -> Self {
        Self {
            source: source.to_owned(),
            reason: Some(reason),
            ..Self::new(id, status)
        }
    }

    /// A line with only the id and the status of a shape. The other fields are empty or 0.
    #[must_use]
    pub fn new(id: &str, status: Status) -> Self {
        Self {
            id: id.to_owned(),
            source: String::new(),
            status,
            reason: None,
            file: None,
            content_hash: None,
            labels_file: None,
            points_file: None,
            member: None,
            n_skipped: None,
            sha256: None,
            solid_step_id: None,
            product: None,
            kind: None,
            n_equal_solids: 0,
            n_faces: 0,
            n_parts: 0,
            n_labels: 0,
            n_triangles: 0,
            n_edges: 0,
            n_undefined_angles: 0,
            n_non_manifold_edges: 0,
            lost: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// The line of a shape with this carrier. Values that are not in a carrier, such as the source and the file, are empty or 0.
    #[must_use]
    pub fn of_carrier(carrier: &Carrier) -> Self {
        let meta = carrier.meta();
        let graph = carrier.graph();
        let kind = carrier.kind();
        let n_undefined_angles = graph.edges.iter().filter(|edge| edge.phi.is_nan()).count();
        Self {
            sha256: Some(meta.source_sha256.clone()),
            kind: (kind != ShapeKind::Brep).then(|| kind.name().to_owned()),
            n_faces: graph.faces.len(),
            n_parts: carrier.n_raw_parts(),
            n_labels: carrier.n_parts(),
            n_triangles: carrier.mesh().triangles.len(),
            n_edges: graph.edges.len(),
            n_undefined_angles,
            lost: meta.lost.clone(),
            notes: meta.notes.clone(),
            ..Self::new(&meta.id, Status::Ok)
        }
    }

    /// The shape's files, relative to the data set.
    pub fn files(&self) -> impl Iterator<Item = &String> {
        [&self.file, &self.labels_file, &self.points_file]
            .into_iter()
            .flatten()
    }
}
