//! truck's table, gone through in the order of `#` numbers: which faces and edges a shell has, and which truck drops.
//!
//! truck's own conversion forgets `#` numbers and leaves out in silence what it cannot convert. Here the same walk is done
//! beside it, so that what it gives can be named and what it leaves out can be told.

use crate::shape::{Lost, LostKind};
use partprobe_shape::FaceType;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use truck_meshalgo::prelude::Point3;
use truck_stepio::r#in::alias::{Curve3D, Surface};
use truck_stepio::r#in::ruststep::ast::Name;
use truck_stepio::r#in::ruststep::tables::{IntoOwned, PlaceHolder};
use truck_stepio::r#in::{FaceSurfaceHolder, ShellHolder, Table};
use truck_topology::compress::CompressedShell;

/// A shell as truck converts it.
pub(crate) type TruckShell = CompressedShell<Point3, Curve3D, Surface>;

/// A face of a shell, with what truck's own structure forgets.
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
    /// As many as `shell` has, in its order.
    pub(crate) faces: Vec<SourceFace>,
    /// The place in `shell.edges` of each `#` number.
    pub(crate) edge_index: BTreeMap<u64, usize>,
    /// The file uses the shell inside out.
    pub(crate) is_flipped: bool,
}

/// The shells, whose order in truck's hash map is left to chance.
pub(crate) fn source_shells(table: &Table, lost: &mut Vec<Lost>) -> Vec<SourceShell> {
    let holders: BTreeMap<u64, &ShellHolder> =
        table.shell.iter().map(|(id, shell)| (*id, shell)).collect();
    let turned = table
        .oriented_shell
        .values()
        .filter(|oriented| !oriented.orientation);
    let turned: Vec<u64> = turned
        .filter_map(|oriented| reference(&oriented.shell_element))
        .collect();
    let mut shells = Vec::new();
    for (&id, holder) in &holders {
        let converted = catch_unwind(AssertUnwindSafe(|| {
            let mut walk = Walk {
                table,
                faces: Vec::new(),
                edge_index: BTreeMap::new(),
                lost: Vec::new(),
            };
            holder
                .cfs_faces
                .iter()
                .for_each(|face| walk.visit(reference(face).unwrap_or(id)));
            walk.checked_shell(holder, turned.contains(&id))
        }));
        let (shell, losses) = converted.unwrap_or((
            Err("truck panicked while it converted it".to_owned()),
            Vec::new(),
        ));
        lost.extend(losses);
        match shell {
            Ok(shell) => shells.push(shell),
            Err(reason) => lost.push(Lost {
                kind: LostKind::Shell,
                step_id: id,
                reason,
            }),
        }
    }
    shells
}

fn reference<T>(place: &PlaceHolder<T>) -> Option<u64> {
    match place {
        PlaceHolder::Ref(Name::Entity(id)) => Some(*id),
        _ => None,
    }
}

/// The walk through the faces of one shell.
struct Walk<'a> {
    table: &'a Table,
    faces: Vec<SourceFace>,
    edge_index: BTreeMap<u64, usize>,
    lost: Vec<Lost>,
}

impl Walk<'_> {
    fn visit(&mut self, step_id: u64) {
        let Some(face) = face_surface(self.table, step_id) else {
            return self.lose(LostKind::Face, step_id, "truck does not know the entity");
        };
        let mut edges = Vec::new();
        for bound in &face.bounds {
            match reference(bound).and_then(|bound| loop_edges(self.table, bound)) {
                Some(found) => edges.extend(found),
                None => self.lose(LostKind::Loop, step_id, "truck knows loops of edges only"),
            }
        }
        if edges.contains(&None) {
            self.lose(
                LostKind::Loop,
                step_id,
                "truck does not know one of its edges",
            );
        }
        let edges: Vec<u64> = edges.into_iter().flatten().collect();
        // truck numbers edges by their first use, also by faces that it then drops.
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
            Err(reason) => self.lose(LostKind::Face, step_id, &reason),
        }
    }

    fn lose(&mut self, kind: LostKind, step_id: u64, reason: &str) {
        self.lost.push(Lost {
            kind,
            step_id,
            reason: reason.to_owned(),
        });
    }

    /// truck's conversion, if it has the faces and edges of the walk; an edge that it lost would shift all others.
    fn checked_shell(
        self,
        holder: &ShellHolder,
        is_flipped: bool,
    ) -> (Result<SourceShell, String>, Vec<Lost>) {
        let Self {
            table,
            faces,
            edge_index,
            lost,
        } = self;
        let shell = match table.to_compressed_shell(holder) {
            Err(error) => Err(one_line(&error)),
            Ok(shell) if shell.edges.len() != edge_index.len() => {
                let n_lost = edge_index.len().saturating_sub(shell.edges.len());
                Err(format!(
                    "truck drops {n_lost} of its edges and takes others for them"
                ))
            }
            Ok(shell) if shell.faces.len() != faces.len() => {
                Err("truck gives other faces than it has".to_owned())
            }
            Ok(shell) => Ok(SourceShell {
                shell,
                faces,
                edge_index,
                is_flipped,
            }),
        };
        (shell, lost)
    }
}

/// The face's own entity, seen through an oriented face.
fn face_surface(table: &Table, id: u64) -> Option<FaceSurfaceHolder> {
    let through = table
        .oriented_face
        .get(&id)
        .map_or(Some(id), |oriented| reference(&oriented.face_element))?;
    table.face_surface.get(&through).cloned()
}

/// The `#` numbers of a bound's edges, none where truck does not know the edge; none at all where it is no edge loop.
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

/// Whether truck can make the face's surface; the same two steps by which it drops a face without a word.
fn check_surface(table: &Table, face: &FaceSurfaceHolder) -> Result<(), String> {
    let owned = face
        .face_geometry
        .clone()
        .into_owned(table)
        .map_err(|error| one_line(&error))?;
    Surface::try_from(&owned)
        .map(|_| ())
        .map_err(|error| one_line(&error))
}

fn one_line(error: &impl ToString) -> String {
    error
        .to_string()
        .lines()
        .next()
        .unwrap_or_default()
        .to_owned()
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
    // What is left are the B-splines; a rational Bézier surface counts among them here.
    classes
        .iter()
        .find(|(is_it, _)| *is_it)
        .map_or(FaceType::Bspline, |(_, class)| *class)
}
