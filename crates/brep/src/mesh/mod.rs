//! Tessellation: a B-Rep and tolerances in, a triangle mesh, the faces' areas and the faces without triangles out.
//!
//! Each edge is divided once and both its faces take the same points, so that the meshes of closed solids close.
//! Nothing here moves a vertex, sews a gap or asks the clock; work is bounded by numbers of triangles and rounds.

mod attributes;
mod boundary;
mod chart;
mod chords;
mod closed_surface;
mod closing;
mod columns;
mod contacts;
mod cut_off;
mod divisions;
mod edge_points;
mod edge_walks;
mod face_mesh;
mod facets;
mod flat;
mod layout;
mod near_chords;
mod nesting;
mod off_surface;
mod orientation;
mod plain;
mod plain_face;
mod poles;
mod quadrature;
mod rounds;
mod shell_sides;
mod sphere_axis;
mod steps;
mod strips;
mod surface_fit;
#[cfg(test)]
mod tests;
mod triangulation;
mod two_areas;
mod unwrap;
mod volume;
mod walks;

use crate::bounds::diagonal;
use crate::model::{Brep, BrepFace, Loop, Loss, LossKind, Note};
use crate::shape::AttributeChoice;
use face_mesh::FaceMesh;
use layout::Obstacle;
use off_surface::{off_surface, straight_off_surface};
use partprobe_shape::{Mesh, Point, SurfaceAttributes, bounding_diagonal};
use unwrap::Off;

pub(crate) use attributes::{outward_curvature, rows_of};
pub(crate) use walks::mended;

/// How finely a shape is meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshSettings {
    /// Largest distance between an edge and its chord, in millimeters.
    pub(crate) chord_mm: f64,
    /// Largest angle between neighboring chords, in radians.
    pub(crate) angle_rad: f64,
    /// What is wanted of the surfaces at the vertices.
    pub(crate) attributes: AttributeChoice,
    /// Whether the solids' volumes are wanted.
    pub(crate) solid_volumes: bool,
    /// The part of a closed solid's volume that triangles may cut off or add; 0 for any.
    pub(crate) volume_loss: f64,
    /// Faces that would bring the mesh above this number of triangles are lost.
    pub(crate) max_triangles: u64,
}

/// The mesh of a shape.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tessellation {
    /// Triangles, in face order.
    pub(crate) mesh: Mesh,
    /// What else was asked for at its vertices.
    pub(crate) attributes: SurfaceAttributes,
    /// Area of each face's trimmed surface in square millimeters; 0 where it was lost.
    pub(crate) areas: Vec<f64>,
    /// Volume that each solid's surfaces enclose, in cubic millimeters; empty unless it was asked for.
    pub(crate) solid_volumes: Vec<f64>,
    /// Faces without triangles.
    pub(crate) lost: Vec<Loss>,
    /// Faces whose triangles and surface have different areas, and are not lost.
    pub(crate) notes: Vec<Note>,
    /// Whether a face was lost because the triangle budget was used up.
    pub(crate) is_over_budget: bool,
}

/// A face whose triangles are too many to be meshed finer is named if they lack or add this part of its area.
const BUDGET_LOSS: f64 = 0.02;

/// Meshes every face of a shape.
pub(crate) fn tessellate(brep: &Brep, settings: &MeshSettings) -> Tessellation {
    let mut result = Tessellation::default();
    let origins = if settings.solid_volumes {
        solid_origins(brep)
    } else {
        Vec::new()
    };
    let size = shape_size(brep);
    let mut faces = rounds::face_meshes(brep, settings, size, &origins);
    orientation::agree_with_neighbors(brep, &mut faces);
    shell_sides::turn_shells(brep, &mut faces);
    chords::divide_shared_chords(&mut faces);
    result.solid_volumes = vec![0.0; origins.len()];
    for (index, (face, mesh)) in brep.faces.iter().zip(faces).enumerate() {
        if let (Ok(mesh), Some(solid)) = (
            &mesh,
            solid_of(brep, face).filter(|_| settings.solid_volumes),
        ) {
            result.solid_volumes[solid] += mesh.volume;
        }
        let room = settings
            .max_triangles
            .saturating_sub(result.mesh.triangles.len() as u64);
        let mesh = mesh.and_then(|mesh| {
            let fits = mesh.triangles.len() as u64 <= room;
            result.is_over_budget |= !fits;
            if fits {
                Ok(mesh)
            } else {
                Err("the triangle budget is used up; raise it or the tolerances")
            }
        });
        if let Some(reason) = loss(brep, face, &mesh, size) {
            result.lost.push(Loss {
                kind: LossKind::Face,
                step_id: face.step_id,
                reason,
            });
        } else if let Some(text) = mesh
            .as_ref()
            .ok()
            .and_then(|mesh| two_areas::disagreement(mesh, settings.chord_mm))
        {
            result.notes.push(Note {
                step_id: face.step_id,
                text,
            });
        }
        match mesh {
            Ok(mesh) => append(&mut result, index as u32, mesh),
            Err(_) => result.areas.push(0.0),
        }
    }
    result
}

/// What is lost of a face: all its triangles, the true place of its boundary, or what a budget left out.
fn loss(
    brep: &Brep,
    face: &BrepFace,
    mesh: &Result<FaceMesh, Obstacle>,
    size: f64,
) -> Option<String> {
    let off = || off_surface(brep, face, size).map(|off| off.message());
    match mesh {
        Ok(FaceMesh {
            is_flattened: true, ..
        }) => off().map(|off| format!("{off}; the triangles lie in the plane of its boundary")),
        Ok(FaceMesh {
            off_surface: Some(Off::Moved),
            ..
        }) => off().map(|off| {
            format!("{off}; there the triangles end at the nearest places of the surface")
        }),
        Ok(FaceMesh {
            off_surface: Some(Off::Kept),
            ..
        }) => off().map(|off| format!("{off}; the triangles reach out to it")),
        Ok(mesh) => beyond_budget(mesh).or_else(|| {
            let off = straight_off_surface(brep, face, size)?;
            Some(format!(
                "{}; the triangles keep the straight edge",
                off.message()
            ))
        }),
        Err(obstacle) => {
            let off = off().map(|off| format!("; {off}")).unwrap_or_default();
            Some(format!("no triangles: {obstacle}{off}"))
        }
    }
}

/// What the triangles of a face lack that may not have more of them, if that is much.
fn beyond_budget(mesh: &FaceMesh) -> Option<String> {
    let missing = mesh.area - mesh.area_of_triangles();
    let is_short =
        mesh.triangles.len() >= rounds::MOST_TRIANGLES && missing.abs() > BUDGET_LOSS * mesh.area;
    is_short.then(|| {
        let (percent, n, most) = (100.0 * missing / mesh.area, mesh.triangles.len(), rounds::MOST_TRIANGLES);
        format!(
            "its {n} triangles have {:.1} % {} area than its surface, and a face of {most} is meshed no finer; lower the \
             tolerances",
            percent.abs(),
            if percent > 0.0 { "less" } else { "more" }
        )
    })
}

/// The solid that a face belongs to.
fn solid_of(brep: &Brep, face: &BrepFace) -> Option<usize> {
    let solid = brep.shells.get(face.shell as usize)?.solid? as usize;
    (solid < brep.solids.len()).then_some(solid)
}

/// A place near each solid: a vertex of its first face that has one.
fn solid_origins(brep: &Brep) -> Vec<Point> {
    let mut origins: Vec<Option<Point>> = vec![None; brep.solids.len()];
    for face in &brep.faces {
        let Some(solid) = solid_of(brep, face) else {
            continue;
        };
        let vertex = face.loops.iter().find_map(|bound| match bound {
            Loop::Edges(uses) => Some(brep.edges.get(uses.first()?.edge as usize)?.start),
            Loop::Vertex(vertex) => Some(*vertex),
        });
        let place = vertex
            .and_then(|vertex| brep.vertices.get(vertex as usize))
            .map(|vertex| vertex.point);
        origins[solid] = origins[solid].or(place);
    }
    origins
        .into_iter()
        .map(|origin| origin.unwrap_or_default())
        .collect()
}

/// The extent of the vertices, and only where there are too few of them a closer look.
fn shape_size(brep: &Brep) -> f64 {
    let places: Vec<Point> = brep.vertices.iter().map(|vertex| vertex.point).collect();
    let by_vertices = bounding_diagonal(&places);
    if places.len() > 2 && by_vertices > 0.0 {
        by_vertices
    } else {
        diagonal(brep)
    }
}

fn append(result: &mut Tessellation, face: u32, mesh: FaceMesh) {
    let first = result.mesh.vertices.len() as u32;
    result
        .mesh
        .vertex_face
        .extend(std::iter::repeat_n(face, mesh.points.len()));
    result
        .mesh
        .tri_face
        .extend(std::iter::repeat_n(face, mesh.triangles.len()));
    result.mesh.vertices.extend(mesh.points);
    result.mesh.vertex_normal.extend(mesh.normals);
    result.attributes.extend(mesh.attributes);
    result.mesh.triangles.extend(
        mesh.triangles
            .iter()
            .map(|corners| corners.map(|corner| first + corner)),
    );
    result.areas.push(mesh.area);
}
