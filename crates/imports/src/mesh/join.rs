//! Finds the triangles of the carrier that labels belong to.

use crate::import::{JoinProblem, JoinReport, JoinedLabels};
use crate::nearest_label::NearestLabel;
use crate::position::ensure_same_position;
use partprobe_carrier::{Carrier, IGNORE, Labels, Mesh};
use partprobe_sources::{Origin, SourceLabels};
use partprobe_transfer::{
    Limits, NearestSurface, Surface, TransferError, TriangleMatch, match_triangles,
};
use std::sync::Arc;

/// The key by which labels are joined to triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JoinBy {
    /// `index` if the labels have no mesh of their own, otherwise `triangle` if every triangle is found, and otherwise
    /// `nn-surface`.
    Auto,
    /// The labels are those of the carrier's triangles, in their order.
    Index,
    /// Triangles with the same corners.
    Triangle,
    /// The nearest triangle whose normal agrees, for each point.
    NearestSurface,
}

/// The settings of a join.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Joining {
    pub(crate) by: JoinBy,
    /// The largest distance of equal corners, as a fraction of the diagonal.
    pub(crate) tolerance: f64,
    /// The largest distance of the nearest triangle, as a fraction of the diagonal.
    pub(crate) max_distance: f64,
    /// The largest angle between normals.
    pub(crate) max_angle_deg: f64,
}

/// If the corners of two boxes are farther apart than this fraction of the diagonal, the boxes do not belong to the same shape in
/// the same position.
pub(super) const MAX_BOX_OFFSET: f64 = 0.02;

impl Joining {
    /// Joins labels to a carrier. `mesh` has the labeled triangles, if they are not those of the carrier.
    ///
    /// # Errors
    /// If the labels do not fit the mesh, or the mesh does not fit the carrier.
    pub(crate) fn join(
        &self,
        carrier: &Carrier,
        labels: &[i32],
        mesh: Option<&Mesh>,
        entries: Vec<String>,
        content_hash: String,
    ) -> Result<JoinedLabels, JoinProblem> {
        let joined = match (mesh, self.by) {
            (None, JoinBy::Auto | JoinBy::Index) => by_index(carrier, labels)?,
            (None, _) => {
                return Err(JoinProblem::Refused(
                    "the labels have no mesh of their own; give it with the key `meshes`"
                        .to_owned(),
                ));
            }
            (Some(mesh), by) => self.by_mesh(carrier, labels, mesh, by)?,
        };

        with_report(joined, entries, content_hash)
    }

    fn by_mesh(
        &self,
        carrier: &Carrier,
        labels: &[i32],
        mesh: &Mesh,
        by: JoinBy,
    ) -> Result<JoinedMesh, JoinProblem> {
        if labels.len() != mesh.triangles.len() {
            return Err(JoinProblem::Refused(format!(
                "there are {} labels, and their mesh has {} triangles",
                labels.len(),
                mesh.triangles.len()
            )));
        }
        let diagonal = carrier.meta().diagonal_mm;
        if by == JoinBy::Index {
            return by_index(carrier, labels);
        }
        ensure_same_position(
            &carrier.mesh().vertices,
            &mesh.vertices,
            MAX_BOX_OFFSET * diagonal,
        )?;
        let [own, other] = [surface(carrier.mesh())?, surface(mesh)?];
        if by != JoinBy::NearestSurface {
            let matched = match_triangles(other, own, self.tolerance * diagonal);
            let is_whole = matched.source_of.iter().all(Option::is_some);
            if by == JoinBy::Triangle || is_whole {
                return by_triangle(labels, &matched);
            }
        }

        let limits = Limits {
            max_distance: self.max_distance * diagonal,
            max_angle_deg: Some(self.max_angle_deg),
        };
        let normals = (0..carrier.mesh().triangles.len()).map(|triangle| own.normal(triangle));
        let rule = NearestLabel {
            nearest: NearestSurface::new(other),
            labels: labels.to_vec(),
            normals: normals.collect(),
            limits,
        };
        Ok(JoinedMesh {
            by: "nn-surface",
            labels: SourceLabels::on_points(carrier.mesh(), Arc::new(rule)),
            unused: Vec::new(),
        })
    }
}

/// Labels on a carrier, before they are counted.
pub(crate) struct JoinedMesh {
    /// The key by which they were joined.
    pub(crate) by: &'static str,
    pub(crate) labels: SourceLabels,
    /// The names of labels that are not used.
    pub(crate) unused: Vec<String>,
}

/// The labels with a report of the matches. `entries` names their files, and `content_hash` is the hash of their bytes.
///
/// # Errors
/// If no triangle of the carrier has a label.
pub(crate) fn with_report(
    joined: JoinedMesh,
    entries: Vec<String>,
    content_hash: String,
) -> Result<JoinedLabels, JoinProblem> {
    let of_triangle = joined.labels.of_triangles().of_triangle();
    let unlabeled = (0..)
        .zip(of_triangle)
        .filter(|&(_, &label)| label == IGNORE);
    let report = JoinReport {
        entries,
        by: joined.by.to_owned(),
        items: "triangles",
        n_items: of_triangle.len(),
        n_matched: of_triangle.iter().filter(|&&label| label != IGNORE).count(),
        unlabeled: unlabeled
            .map(|(triangle, _): (u32, _)| format!("triangle {triangle}"))
            .collect(),
        unused: joined.unused,
        n_separate: 0,
    };
    if report.n_matched == 0 {
        return Err(JoinProblem::Refused(format!(
            "no triangle gets a label by {}",
            report.by
        )));
    }
    let origin = Origin {
        content_hash,
        join: report.to_string(),
    };
    Ok(JoinedLabels {
        labels: joined.labels.with_origin(origin),
        report,
    })
}

fn surface(mesh: &Mesh) -> Result<Surface<'_>, JoinProblem> {
    Surface::of_mesh(mesh).map_err(|error: TransferError| JoinProblem::Refused(error.to_string()))
}

fn by_index(carrier: &Carrier, labels: &[i32]) -> Result<JoinedMesh, JoinProblem> {
    let n_triangles = carrier.mesh().triangles.len();
    if labels.len() != n_triangles {
        return Err(JoinProblem::Refused(format!(
            "there are {} labels, and the carrier has {n_triangles} triangles; give the mesh that the labels belong to with \
             the key `meshes`",
            labels.len()
        )));
    }
    Ok(JoinedMesh {
        by: "index",
        labels: SourceLabels::on_plain(Labels::compacted(labels)),
        unused: Vec::new(),
    })
}

fn by_triangle(labels: &[i32], matched: &TriangleMatch) -> Result<JoinedMesh, JoinProblem> {
    let label_of = |source: u32| labels[source as usize];
    for (triangle, sources) in &matched.several {
        let first = label_of(sources[0]);
        if sources.iter().any(|&source| label_of(source) != first) {
            return Err(JoinProblem::Refused(format!(
                "several triangles of the mesh have the corners of triangle {triangle}, and their labels differ"
            )));
        }
    }
    let of_triangle = |source: &Option<u32>| source.map_or(IGNORE, label_of);
    let found: Vec<i32> = matched.source_of.iter().map(of_triangle).collect();
    let unused = match matched.n_unused {
        0 => Vec::new(),
        n_unused => vec![format!("{n_unused} triangles of the mesh")],
    };
    Ok(JoinedMesh {
        by: "triangle",
        labels: SourceLabels::on_plain(Labels::compacted(&found)),
        unused,
    })
}
