//! Reports on a mesh or a point cloud, which has neither faces of a B-Rep nor edges with angles.

use crate::counted::counted;
use partprobe_carrier::{Carrier, Point, ShapeKind, bounding_box};
use serde::Serialize;
use std::fmt;

/// The largest number of labels in a list. Longer lists end with the number of labels that are left out.
const MAX_ROWS: usize = 60;

/// The report of a shape without a B-Rep. Lengths are in the unit of its file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct GivenReport {
    /// `mesh` or `cloud`.
    kind: &'static str,
    /// Triangles of a mesh, or points of a cloud.
    n_elements: usize,
    /// The area of a mesh, or `None` for a cloud.
    area: Option<f64>,
    bounding_box: Option<[Point; 2]>,
    labels: Vec<LabelReport>,
    /// Triangles or points without a label.
    n_unlabeled: usize,
    notes: Vec<String>,
}

/// One label.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct LabelReport {
    /// The label in the carrier, counted from 0.
    label: i32,
    /// Its number or name in the file.
    name: Option<String>,
    /// The number of triangles or points with the label.
    n_elements: usize,
    /// The area of the label. It is 0 in a cloud.
    area: f64,
}

impl GivenReport {
    /// The report of a carrier without a B-Rep.
    pub(super) fn new(carrier: &Carrier) -> Self {
        let mesh = carrier.mesh();
        let faces = &carrier.graph().faces;
        let mut counts = vec![0; faces.len()];
        for &face in &mesh.tri_face {
            counts[face as usize] += 1;
        }
        let rows = carrier.part_of_face().iter().zip(faces).zip(&counts);
        let report = |((&label, face), &n_elements): ((&i32, &partprobe_carrier::Face), &usize)| {
            LabelReport {
                label,
                name: face.name.clone(),
                n_elements,
                area: face.area,
            }
        };
        let (labels, unlabeled): (Vec<_>, Vec<_>) =
            rows.map(report).partition(|row| row.label >= 0);
        let is_cloud = carrier.kind() == ShapeKind::Cloud;
        Self {
            kind: carrier.kind().name(),
            n_elements: mesh.triangles.len(),
            area: (!is_cloud).then(|| mesh.triangle_areas().iter().sum()),
            bounding_box: bounding_box(&mesh.vertices),
            labels,
            n_unlabeled: unlabeled.iter().map(|row| row.n_elements).sum(),
            notes: carrier.meta().notes.clone(),
        }
    }
}

impl fmt::Display for GivenReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [one, several] = match self.area {
            Some(_) => ["triangle", "triangles"],
            None => ["point", "points"],
        };
        writeln!(
            f,
            "{} of {} with {}, {} without a label",
            self.kind,
            counted(self.n_elements, one, several),
            counted(self.labels.len(), "label", "labels"),
            self.n_unlabeled
        )?;
        writeln!(f, "units: those of the file; each counts as one millimeter")?;
        if let Some(area) = self.area {
            writeln!(f, "area: {area:.6}")?;
        }
        if let Some([low, high]) = self.bounding_box {
            let numbers = |point: Point| point.map(|x| format!("{x:.6}")).join(" ");
            writeln!(f, "bounding box: {} to {}", numbers(low), numbers(high))?;
        }
        for row in self.labels.iter().take(MAX_ROWS) {
            let name = row.name.as_ref();
            let name = name.map_or_else(String::new, |name| format!(" (`{name}` in the file)"));
            let n_elements = counted(row.n_elements, one, several);
            writeln!(f, "label {}{name}: {n_elements}", row.label)?;
        }
        if self.labels.len() > MAX_ROWS {
            writeln!(f, "and {} more labels", self.labels.len() - MAX_ROWS)?;
        }
        write!(f, "notes: {}", self.notes.join("; "))
    }
}
