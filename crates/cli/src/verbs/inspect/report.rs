//! Makes the JSON object that describes a file.

use super::surface::SurfaceReport;
use partprobe_carrier::{Color, Edge, Face, Point, bounding_box};
use partprobe_verify::{MeasuredFile, MeasuredSolid};
use serde::Serialize;

/// The output of `inspect --json`. Field names are the keys.
#[derive(Clone, Debug, Serialize)]
pub(super) struct InspectReport {
    format_version: u32,
    pub(super) faces: Vec<FaceReport>,
    pub(super) edges: Vec<EdgeReport>,
    pub(super) n_parts: u32,
    pub(super) lost: Vec<LossReport>,
    pub(super) notes: Vec<NoteReport>,
    pub(super) units: UnitsReport,
    pub(super) mesh: MeshReport,
    pub(super) timings: Timings,
}

/// A face. Parts are numbered in the order of the list.
#[derive(Clone, Debug, Serialize)]
pub(super) struct FaceReport {
    pub(super) step_id: u64,
    #[serde(rename = "type")]
    pub(super) face_type: &'static str,
    pub(super) area: f64,
    pub(super) part: u32,
    pub(super) shell: u32,
    pub(super) solid: Option<u32>,
    pub(super) name: Option<String>,
    pub(super) color: Option<String>,
    /// Its dimensions, or `null` for types that have none.
    pub(super) surface: Option<SurfaceReport>,
}

/// A shared edge, by the `#` numbers of its faces. φ is in degrees, or null if it is undefined.
#[derive(Clone, Debug, Serialize)]
pub(super) struct EdgeReport {
    pub(super) faces: [u64; 2],
    pub(super) phi: Option<f64>,
    pub(super) length: f64,
}

/// An entity of the file that is missing in the answer.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LossReport {
    pub(super) kind: String,
    pub(super) step_id: u64,
    pub(super) reason: String,
}

/// A note about the file that is not about a lost entity.
#[derive(Clone, Debug, Serialize)]
pub(super) struct NoteReport {
    pub(super) step_id: u64,
    pub(super) text: String,
}

/// The units of the file. Everything else in the report is in millimeters and degrees.
#[derive(Clone, Debug, Serialize)]
pub(super) struct UnitsReport {
    pub(super) length: String,
    pub(super) mm_per_unit: f64,
    pub(super) angle: String,
    pub(super) rad_per_unit: f64,
}

/// The tessellation.
#[derive(Clone, Debug, Serialize)]
pub(super) struct MeshReport {
    pub(super) triangles: usize,
    /// The lower and upper corner of the box around all vertices, or `null` without a mesh.
    pub(super) bounding_box: Option<[Point; 2]>,
    pub(super) solids: Vec<SolidReport>,
}

/// One solid: whether it is closed in the file, the volume that its true surfaces enclose, and the same for its mesh.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SolidReport {
    pub(super) step_id: u64,
    pub(super) name: Option<String>,
    pub(super) closed: bool,
    pub(super) volume: f64,
    /// The area of its faces.
    pub(super) area: f64,
    /// The center of mass of its mesh, for a uniform density, or `null` if the mesh is not watertight.
    pub(super) centroid: Option<Point>,
    pub(super) mesh_volume: f64,
    pub(super) watertight: bool,
    pub(super) manifold: bool,
}

/// Wall-clock seconds.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Timings {
    pub(super) read_s: f64,
    pub(super) shape_s: f64,
}

impl InspectReport {
    /// The report of a measured file.
    pub(super) fn new(measured: &MeasuredFile, timings: Timings) -> Self {
        let (brep, shape) = (&measured.brep, &measured.shape);
        let faces = &shape.graph.faces;
        let loss = |loss: &partprobe_brep::LostEntity| LossReport {
            kind: loss.kind.to_string(),
            step_id: loss.step_id,
            reason: loss.reason.clone(),
        };
        let note = |note: &partprobe_brep::Note| NoteReport {
            step_id: note.step_id,
            text: note.text.clone(),
        };
        Self {
            format_version: partprobe_formats::FORMAT_VERSION,
            faces: face_reports(measured),
            edges: shape
                .graph
                .edges
                .iter()
                .map(|edge| edge_report(edge, faces))
                .collect(),
            n_parts: measured.partition.n_parts(),
            lost: shape.lost.iter().map(loss).collect(),
            notes: shape.notes.iter().map(note).collect(),
            units: UnitsReport {
                length: brep.units.length.clone(),
                mm_per_unit: brep.units.mm_per_unit,
                angle: brep.units.angle.clone(),
                rad_per_unit: brep.units.rad_per_unit,
            },
            mesh: MeshReport {
                triangles: shape.mesh.triangles.len(),
                bounding_box: bounding_box(&shape.mesh.vertices),
                solids: solid_reports(measured),
            },
            timings,
        }
    }
}

fn face_reports(measured: &MeasuredFile) -> Vec<FaceReport> {
    // The graph has the faces of the B-Rep in their order. Their numbers would not distinguish them: the faces of a CSG primitive
    // share the number of their solid.
    let faces = measured.shape.graph.faces.iter().zip(&measured.brep.faces);
    faces
        .zip(measured.partition.parts())
        .map(|((face, brep_face), &part)| {
            face_report(face, part, SurfaceReport::of(&brep_face.surface))
        })
        .collect()
}

fn solid_reports(measured: &MeasuredFile) -> Vec<SolidReport> {
    let mut areas = vec![0.0; measured.solids.len()];
    for face in &measured.shape.graph.faces {
        if let Some(area) = face.solid.and_then(|solid| areas.get_mut(solid as usize)) {
            *area += face.area;
        }
    }
    let solids = measured.brep.solids.iter().zip(&measured.solids).zip(areas);
    solids
        .map(|((solid, measured), area)| solid_report(solid, measured, area))
        .collect()
}

fn face_report(face: &Face, part: u32, surface: Option<SurfaceReport>) -> FaceReport {
    FaceReport {
        step_id: face.step_id,
        face_type: face.face_type.name(),
        area: face.area,
        part,
        shell: face.shell,
        solid: face.solid,
        name: face.name.clone(),
        color: face.color.map(|Color(rgba)| format!("#{rgba:08x}")),
        surface,
    }
}

fn edge_report(edge: &Edge, faces: &[Face]) -> EdgeReport {
    let step_ids = edge.faces.map(|face| faces[face as usize].step_id);
    EdgeReport {
        faces: step_ids,
        phi: Some(edge.phi).filter(|phi| phi.is_finite()),
        length: edge.length,
    }
}

fn solid_report(solid: &partprobe_brep::Solid, measured: &MeasuredSolid, area: f64) -> SolidReport {
    SolidReport {
        step_id: solid.step_id,
        name: solid.name.clone(),
        closed: measured.closed,
        volume: measured.volume,
        area,
        centroid: measured.mesh.centroid,
        mesh_volume: measured.mesh.volume,
        watertight: measured.mesh.watertight,
        manifold: measured.mesh.manifold,
    }
}
