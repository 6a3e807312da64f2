//! Tessellates a B-Rep: makes its mesh, and its face graph with angles, lengths and areas.

use crate::bounds::diagonal;
use crate::canonical::recognize_primitives;
use crate::graph::{ShapeFlags, face_graph, graph_with_areas};
use crate::mesh::{AttributeChoice, BrepMesh, MeshSettings, mesh_brep, repaired};
use crate::model::{Brep, LostEntity, Note};
use partprobe_shape::{FaceGraph, Mesh, SurfaceAttributes};

/// How a shape is tessellated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TessellationOptions {
    /// Chord tolerance, as a fraction of the bounding box's diagonal.
    pub chord_fraction: f64,
    /// Angle tolerance, in radians.
    pub angle_rad: f64,
    /// The attributes of the true surfaces that are kept at every vertex.
    pub attributes: AttributeChoice,
    /// Whether to compute the volumes that the solids' true surfaces enclose.
    pub solid_volumes: bool,
    /// The largest fraction of a closed solid's volume that its triangles may cut off or add. The faces that exceed it most are
    /// meshed finer. A value of 0 disables this refinement. The refinement also stops when the mesh has a quarter of
    /// `max_triangles`.
    pub volume_loss: f64,
    /// The largest number of triangles that the mesh may have. Faces beyond it are lost.
    pub max_triangles: u64,
}

impl Default for TessellationOptions {
    /// The default settings: a chord tolerance of 0.002 of the diagonal, an angle of 0.3 rad, 0.8 % of a solid's volume, and at
    /// most 6 million triangles.
    fn default() -> Self {
        Self {
            chord_fraction: 0.002,
            angle_rad: 0.3,
            attributes: AttributeChoice::default(),
            solid_volumes: false,
            volume_loss: 0.008,
            max_triangles: 6_000_000,
        }
    }
}

/// The data of a B-Rep that labeling needs.
#[derive(Clone, Debug)]
pub struct Tessellation {
    /// Faces with their areas, shared edges with their angles and lengths.
    pub graph: FaceGraph,
    /// The tessellation.
    pub mesh: Mesh,
    /// The other surface attributes at its vertices that were requested.
    pub attributes: SurfaceAttributes,
    /// Volume that the true surfaces of each solid enclose, in cubic millimeters, in the order of the solids. The list is empty
    /// unless it was requested. The mesh loses up to `volume_loss` of it.
    pub solid_volumes: Vec<f64>,
    /// The entities that reading and tessellation lost, including faces without triangles.
    pub lost: Vec<LostEntity>,
    /// The notes of reading, and notes about faces whose surface and triangles have different areas.
    pub notes: Vec<Note>,
    /// The counts of irregular edges.
    pub flags: ShapeFlags,
    /// The chord tolerance that was used, in millimeters.
    pub chord_mm: f64,
    /// The diagonal of the bounding box, in millimeters.
    pub diagonal_mm: f64,
    /// Whether faces were lost because the mesh would have had more triangles than the options allow.
    pub is_over_budget: bool,
}

/// Meshes every face and measures the angle and the length of every shared edge.
///
/// The mesh takes nearly all of the time. If only labels are wanted, use [`crate::face_graph`].
#[must_use]
pub fn tessellate(brep: &Brep, options: &TessellationOptions) -> Tessellation {
    let brep = &*repaired(brep);
    let diagonal_mm = diagonal(brep);
    let chord_mm = options.chord_fraction * diagonal_mm;
    let TessellationOptions {
        angle_rad,
        attributes,
        solid_volumes,
        volume_loss,
        max_triangles,
        ..
    } = *options;
    let settings = MeshSettings {
        chord_mm,
        angle_rad,
        attributes,
        solid_volumes,
        volume_loss,
        max_triangles,
    };
    let BrepMesh {
        mesh,
        attributes,
        areas,
        solid_volumes,
        lost: without_triangles,
        notes,
        is_over_budget,
    } = mesh_brep(brep, &settings);
    let (mut graph, flags) = graph_with_areas(brep, &areas);
    recognize_primitives(&mut graph, brep, diagonal_mm);
    let lost = brep.lost.iter().cloned().chain(without_triangles).collect();
    let notes = brep.notes.iter().cloned().chain(notes).collect();
    Tessellation {
        graph,
        mesh,
        attributes,
        solid_volumes,
        lost,
        notes,
        flags,
        chord_mm,
        diagonal_mm,
        is_over_budget,
    }
}

/// The shape without a mesh. It suffices for labels and costs a fraction of a mesh. Areas are NaN.
#[must_use]
pub fn tessellation_without_mesh(brep: &Brep) -> Tessellation {
    let brep = &*repaired(brep);
    let (graph, flags) = face_graph(brep);
    let (lost, notes) = (brep.lost.clone(), brep.notes.clone());
    let (chord_mm, diagonal_mm) = (0.0, diagonal(brep));
    Tessellation {
        graph,
        mesh: Mesh::default(),
        attributes: SurfaceAttributes::default(),
        solid_volumes: Vec::new(),
        lost,
        notes,
        flags,
        chord_mm,
        diagonal_mm,
        is_over_budget: false,
    }
}
