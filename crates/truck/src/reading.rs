//! Reads a text with truck: shells with their meshes, edges and dihedral angles. Lengths are in millimeters.

use crate::dihedral::dihedral_deg;
use crate::dropped_entity::{DroppedEntity, DroppedKind};
use crate::rewriting::rewritten;
use crate::source::{SourceFace, SourceShell, source_shells};
use crate::tessellation::{diagonal, edge_length, meshes_of};
use crate::truck_shape::{TruckError, TruckSettings, TruckShape};
use partprobe_shape::{Edge, Face, FaceGraph, Mesh, triangle_area};
use std::collections::{BTreeMap, BTreeSet};
use std::panic::catch_unwind;
use truck_meshalgo::prelude::PolygonMesh;
use truck_stepio::r#in::Table;

pub(crate) fn shape_of(text: &str, settings: &TruckSettings) -> Result<TruckShape, TruckError> {
    let text = rewritten(text, settings.rad_per_unit);
    let table = catch_unwind(|| Table::from_step(&text)).map_err(|_| TruckError::Panicked)?;
    let table = table.ok_or(TruckError::Unreadable)?;

    let mut lost = Vec::new();
    let shells = source_shells(&table, &mut lost);
    let diagonal = diagonal(shells.iter().map(|source| &source.shell));
    let chord = settings.chord_fraction * diagonal;
    let mut builder = Builder {
        settings: *settings,
        graph: FaceGraph::default(),
        mesh: Mesh::default(),
        lost,
    };
    for (index, source) in (0..).zip(&shells) {
        builder.add(index, source, chord);
    }
    let Builder {
        mut graph,
        mesh,
        lost,
        ..
    } = builder;
    if graph.faces.is_empty() {
        return Err(TruckError::NoFace);
    }
    graph.edges.sort_by_key(|edge| edge.faces);
    let mm = settings.mm_per_unit;
    Ok(TruckShape {
        graph,
        mesh,
        lost,
        chord_mm: chord * mm,
        diagonal_mm: diagonal * mm,
    })
}

/// Collects the faces, edges and triangles of all shells.
struct Builder {
    settings: TruckSettings,
    graph: FaceGraph,
    mesh: Mesh,
    lost: Vec<DroppedEntity>,
}

impl Builder {
    fn add(&mut self, index: u32, source: &SourceShell, chord: f64) {
        let first = self.graph.faces.len() as u32;
        let meshes = meshes_of(&source.shell, chord);
        for ((face, source_face), mesh) in source.shell.faces.iter().zip(&source.faces).zip(meshes)
        {
            let is_reversed = face.orientation == source.is_flipped;
            let area = match mesh {
                Ok(mesh) => self.append(&mesh, is_reversed),
                Err(reason) => {
                    let reason = format!("no triangles: {reason}");
                    self.lost.push(DroppedEntity {
                        kind: DroppedKind::Face,
                        step_id: source_face.step_id,
                        reason,
                    });
                    0.0
                }
            };
            self.graph.faces.push(graph_face(source_face, index, area));
        }
        self.add_edges(first, source);
    }

    /// Adds the triangles of a face. Returns their area.
    fn append(&mut self, polygons: &PolygonMesh, is_reversed: bool) -> f64 {
        let face = self.graph.faces.len() as u32;
        let first = self.mesh.vertices.len() as u32;
        let mm = self.settings.mm_per_unit;
        let positions = polygons.positions();
        self.mesh
            .vertices
            .extend(positions.iter().map(|p| [p.x * mm, p.y * mm, p.z * mm]));
        self.mesh
            .vertex_face
            .extend(std::iter::repeat_n(face, positions.len()));

        let mut area = 0.0;
        for triangle in polygons.faces().triangle_iter() {
            let [a, b, c] = triangle.map(|corner| first + corner.pos as u32);
            self.mesh
                .triangles
                .push(if is_reversed { [a, c, b] } else { [a, b, c] });
            self.mesh.tri_face.push(face);
            area += triangle_area([a, b, c].map(|corner| self.mesh.vertices[corner as usize]));
        }
        area
    }

    /// Adds the pairs of faces that use the same edge. A seam belongs to one face only, so it adds no pair. A
    /// non-manifold edge adds every pair of its faces.
    fn add_edges(&mut self, first: u32, source: &SourceShell) {
        let mut users: BTreeMap<u64, BTreeSet<u32>> = BTreeMap::new();
        for (face, source_face) in (0u32..).zip(&source.faces) {
            for &edge in &source_face.edges {
                users.entry(edge).or_default().insert(face);
            }
        }
        for (edge, faces) in users {
            let curve = &source.shell.edges[source.edge_index[&edge]].curve;
            let length = edge_length(curve) * self.settings.mm_per_unit;
            for (&a, &b) in faces
                .iter()
                .flat_map(|a| faces.range(a + 1..).map(move |b| (a, b)))
            {
                let pair = [a, b].map(|face| &source.shell.faces[face as usize]);
                let phi = dihedral_deg(curve, pair).unwrap_or(f64::NAN);
                self.graph.edges.push(Edge {
                    faces: [first + a, first + b],
                    phi,
                    length,
                });
            }
        }
    }
}

fn graph_face(source: &SourceFace, shell: u32, area: f64) -> Face {
    Face {
        shell,
        name: Some(source.name.clone()).filter(|name| !name.is_empty()),
        ..Face::new(source.step_id, source.face_type, area)
    }
}
