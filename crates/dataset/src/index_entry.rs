//! Defines a line of the index: a shape with its counts and files, or a file without a carrier and the reason.

use partprobe_carrier::{Carrier, ShapeKind};
use serde::{Deserialize, Serialize};

/// How labeling a file ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// A carrier was written.
    Ok,
    /// The file cannot be labeled; the reason says why.
    Failed,
    /// The worker process ended: memory, stack, or a defect of the program.
    Crashed,
    /// The watchdog ended the worker process.
    TimedOut,
    /// The file asks for more work or memory than the settings allow; the reason names the budget.
    OverBudget,
    /// The member of an archive is not read: its name is unsafe or taken, or it is not a plain file. Or the package that files are
    /// attached to does not have this one.
    Refused,
    /// The labels are not those of the package that the file was attached to; the reason names the first difference.
    Differs,
    /// What stands in a folder is not read, because it is not a file or its ending is not one of STEP.
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
/// The counts are 0 where there is no carrier.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct IndexEntry {
    /// The shape's id; the carrier's file is named after it.
    pub id: String,
    /// The file, by the name of the argument and the path below it; it is the same on any machine.
    pub source: String,
    /// How it ended.
    pub status: Status,
    /// Why there is no carrier.
    pub reason: Option<String>,
    /// The carrier, relative to the data set.
    pub file: Option<String>,
    /// The hash of what the carrier holds, in hexadecimal; `None` if an earlier program labeled the shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_hash: Option<String>,
    /// The labels and the face graph alone, where they were asked for, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub labels_file: Option<String>,
    /// The point sample, where it was asked for, relative to the data set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_file: Option<String>,
    /// The place in its archive of a member that was refused, counted from 1: two of one name are told apart by it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub member: Option<u64>,
    /// Files that the line stands for, where it counts files that are not read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n_skipped: Option<u64>,
    /// SHA-256 of the STEP text, in hexadecimal; `None` if the text could not be read.
    pub sha256: Option<String>,
    /// `#` number of the solid, where solids are the unit.
    pub solid_step_id: Option<u64>,
    /// The solid's name, where it says more than `Part 1`.
    pub product: Option<String>,
    /// `mesh` or `cloud`, for a shape without a B-Rep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// Further solids of the file that are equal to this one, and were not labeled again.
    pub n_equal_solids: usize,
    /// Faces.
    pub n_faces: usize,
    /// Parts, by the predicate alone.
    pub n_parts: usize,
    /// Parts after small ones were absorbed.
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
    /// What was left out on purpose, and which faces are triangles of the file, with its `#` number.
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

    /// A line that says nothing but what became of a shape; the other fields are empty or 0.
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

    /// The line of a shape with this carrier. What a carrier does not know, such as the source and the file, is empty or 0.
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
