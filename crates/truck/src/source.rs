//! Walks through truck's table in the order of `#` numbers. Finds the faces and edges of each shell, and those that truck
//! drops.
//!
//! truck's own conversion forgets `#` numbers and does not report what it cannot convert. This module
//! repeats truck's walk, so that the faces get their `#` numbers and the dropped entities are named.

use crate::dropped_entity::{DroppedEntity, DroppedKind};
use partprobe_shape::FaceType;
use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use truck_meshalgo::prelude::Point3;
use truck_stepio::r#in::alias::{Curve3D, Surface};
use truck_stepio::r#in::ruststep::ast::Name;
use truck_stepio::r#in::ruststep::tables::{IntoOwned, PlaceHolder};
use truck_stepio::r#in::{FaceSurfaceHolder, ShellHolder, Table};
use truck_topology::compress::CompressedShell;

/// A shell as truck converts it.
pub(crate) type TruckShell = CompressedShell<Point3, Curve3D, Surface>;

/// Data of a face that truck's own structure does not keep.
pub(crate) struct SourceFace {
    pub(crate) step_id: u64,
    pub(crate) face_type: FaceType,
    pub(crate) name: String,
    /// `#` numbers of its edges.
    pub(crate) edges: Vec<u64>,
}

/// A shell whose faces and edges are known by their `#` numbers.
pub(crate) struct SourceShell {
    pub(crate) shell: TruckShell,
    /// One per face of `shell`, in its order.
    pub(crate) faces: Vec<SourceFace>,
    /// The index in `shell.edges` of each `#` number.
    pub(crate) edge_index: BTreeMap<u64, usize>,
    /// Whether the file uses the shell inside out.
    pub(crate) is_flipped: bool,
}

/// The reason why truck drops a shell or a face.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
enum ConversionError {
    #[error("truck panicked while it converted it")]
    Panicked,
    /// The first line of truck's own message.
    #[error("{0}")]
    Refused(String),
    #[error("truck drops {n_lost} of its edges and takes others for them")]
    Edges { n_lost: usize },
    #[error("truck gives other faces than it has")]
    Faces,
}

impl ConversionError {
    fn refused(error: &impl ToString) -> Self {
        let message = error.to_string();
        Self::Refused(message.lines().next().unwrap_or_default().to_owned())
    }
}

/// Returns the shells in the order of their `#` numbers, since their order in truck's hash map is random.
pub(crate) fn source_shells(table: &Table, lost: &mut Vec<DroppedEntity>) -> Vec<SourceShell> {
    let holders: BTreeMap<u64, &ShellHolder> =
        table.shell.iter().map(|(id, shell)| (*id, shell)).collect();
    let flipped = flipped_shells(table);
    let mut shells = Vec::new();
    for (&id, holder) in &holders {
        let is_flipped = flipped.contains(&id);
        // truck's conversion panics on some files.
        let converted = catch_unwind(AssertUnwindSafe(|| {
            let walk = Walk::through(table, holder, id);
            walk.checked_shell(holder, is_flipped)
        }));
        let (shell, lost_in_shell) =
            converted.unwrap_or((Err(ConversionError::Panicked), Vec::new()));
        lost.extend(lost_in_shell);
        match shell {
            Ok(shell) => shells.push(shell),
            Err(error) => lost.push(DroppedEntity {
                kind: DroppedKind::Shell,
                step_id: id,
                reason: error.to_string(),
            }),
        }
    }
    shells
}

/// The `#` numbers of the shells that the file uses inside out.
fn flipped_shells(table: &Table) -> BTreeSet<u64> {
    table
        .oriented_shell
        .values()
        .filter(|oriented| !oriented.orientation)
        .filter_map(|oriented| reference(&oriented.shell_element))
        .collect()
}

fn reference<T>(holder: &PlaceHolder<T>) -> Option<u64> {
    match holder {
        PlaceHolder::Ref(Name::Entity(id)) => Some(*id),
        _ => None,
    }
}

/// The walk through the faces of one shell.
struct Walk<'a> {
    table: &'a Table,
    faces: Vec<SourceFace>,
    edge_index: BTreeMap<u64, usize>,
    lost: Vec<DroppedEntity>,
}

impl<'a> Walk<'a> {
    /// Visits the faces of a shell in their order.
    fn through(table: &'a Table, shell: &ShellHolder, shell_id: u64) -> Self {
        let mut walk = Self {
            table,
            faces: Vec::new(),
            edge_index: BTreeMap::new(),
            lost: Vec::new(),
        };
        for face in &shell.cfs_faces {
            walk.visit(reference(face).unwrap_or(shell_id));
        }
        walk
    }

    fn visit(&mut self, step_id: u64) {
        let Some(face) = face_surface(self.table, step_id) else {
            return self.lose(DroppedKind::Face, step_id, "truck does not know the entity");
        };
        let edges = self.edges_of(&face, step_id);
        // truck numbers the edges in the order of their first use. Faces that it drops later count, too.
        for &edge in &edges {
            let next = self.edge_index.len();
            self.edge_index.entry(edge).or_insert(next);
        }
        match check_surface(self.table, &face) {
            Ok(()) => {
                let face_type = face_type(self.table, &face);
                self.faces.push(SourceFace {
                    step_id,
                    face_type,
                    name: face.label,
                    edges,
                });
            }
            Err(error) => self.lose(DroppedKind::Face, step_id, &error.to_string()),
        }
    }

    /// The `#` numbers of the edges of a face. Loops and edges that truck does not know are lost.
    fn edges_of(&mut self, face: &FaceSurfaceHolder, step_id: u64) -> Vec<u64> {
        let mut edges = Vec::new();
        for bound in &face.bounds {
            match reference(bound).and_then(|bound| loop_edges(self.table, bound)) {
                Some(found) => edges.extend(found),
                None => self.lose(
                    DroppedKind::Loop,
                    step_id,
                    "truck knows loops of edges only",
                ),
            }
        }
        if edges.contains(&None) {
            let reason = "truck does not know one of its edges";
            self.lose(DroppedKind::Loop, step_id, reason);
        }
        edges.into_iter().flatten().collect()
    }

    fn lose(&mut self, kind: DroppedKind, step_id: u64, reason: &str) {
        self.lost.push(DroppedEntity {
            kind,
            step_id,
            reason: reason.to_owned(),
        });
    }

    /// Returns truck's conversion if it has the same numbers of faces and edges as the walk. A missing edge would shift
    /// the indices of all later edges.
    fn checked_shell(
        self,
        holder: &ShellHolder,
        is_flipped: bool,
    ) -> (Result<SourceShell, ConversionError>, Vec<DroppedEntity>) {
        let shell = match self.table.to_compressed_shell(holder) {
            Ok(shell) => self.check(&shell).map(|()| SourceShell {
                shell,
                faces: self.faces,
                edge_index: self.edge_index,
                is_flipped,
            }),
            Err(error) => Err(ConversionError::refused(&error)),
        };
        (shell, self.lost)
    }

    fn check(&self, shell: &TruckShell) -> Result<(), ConversionError> {
        let n_edges = self.edge_index.len();
        if shell.edges.len() != n_edges {
            return Err(ConversionError::Edges {
                n_lost: n_edges.saturating_sub(shell.edges.len()),
            });
        }
        if shell.faces.len() != self.faces.len() {
            return Err(ConversionError::Faces);
        }
        Ok(())
    }
}

/// The entity of the face itself, also if an oriented face refers to it.
fn face_surface(table: &Table, id: u64) -> Option<FaceSurfaceHolder> {
    let through = table
        .oriented_face
        .get(&id)
        .map_or(Some(id), |oriented| reference(&oriented.face_element))?;
    table.face_surface.get(&through).cloned()
}

/// The `#` numbers of the edges of a bound; `None` for an edge that truck does not know. Returns `None` if the bound is
/// not an edge loop.
fn loop_edges(table: &Table, bound: u64) -> Option<Vec<Option<u64>>> {
    let edge_loop = table
        .edge_loop
        .get(&reference(&table.face_bound.get(&bound)?.bound)?)?;
    let edge_of = |id: u64| match table.oriented_edge.get(&id) {
        Some(oriented) => {
            reference(&oriented.edge_element).filter(|edge| table.edge_curve.contains_key(edge))
        }
        None => table.edge_curve.contains_key(&id).then_some(id),
    };
    Some(
        edge_loop
            .edge_list
            .iter()
            .map(|edge| reference(edge).and_then(edge_of))
            .collect(),
    )
}

/// Checks whether truck can make the surface of the face. truck does the same two steps and drops the face without a
/// message if one of them fails.
fn check_surface(table: &Table, face: &FaceSurfaceHolder) -> Result<(), ConversionError> {
    let geometry = face.face_geometry.clone();
    let owned = geometry
        .into_owned(table)
        .map_err(|error| ConversionError::refused(&error))?;
    Surface::try_from(&owned).map_err(|error| ConversionError::refused(&error))?;
    Ok(())
}

fn face_type(table: &Table, face: &FaceSurfaceHolder) -> FaceType {
    let Some(id) = reference(&face.face_geometry) else {
        return FaceType::Other;
    };
    let classes = [
        (table.plane.contains_key(&id), FaceType::Plane),
        (
            table.cylindrical_surface.contains_key(&id),
            FaceType::Cylinder,
        ),
        (table.conical_surface.contains_key(&id), FaceType::Cone),
        (table.spherical_surface.contains_key(&id), FaceType::Sphere),
        (table.toroidal_surface.contains_key(&id), FaceType::Torus),
        (table.bezier_surface.contains_key(&id), FaceType::Bezier),
        (
            table.surface_of_revolution.contains_key(&id),
            FaceType::Revolution,
        ),
        (
            table.surface_of_linear_extrusion.contains_key(&id),
            FaceType::Extrusion,
        ),
    ];
    // The remaining surfaces are B-splines, including rational Bézier surfaces.
    classes
        .iter()
        .find(|(is_it, _)| *is_it)
        .map_or(FaceType::Bspline, |(_, class)| *class)
}
