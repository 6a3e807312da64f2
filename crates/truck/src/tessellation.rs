//! truck's meshes of a shell's faces, and the sizes that they are made at.

use crate::source::TruckShell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use truck_meshalgo::prelude::{
    BoundedCurve, InnerSpace, ParametricCurve, PolygonMesh, RobustMeshableShape,
};
use truck_stepio::r#in::alias::Curve3D;
use truck_topology::compress::{CompressedFace, CompressedShell};

/// Places along an edge by which its length and its box are measured.
const PLACES: u32 = 64;
/// truck panics at smaller tolerances.
const LEAST_CHORD: f64 = 2e-6;

/// The mesh of each face, or why there is none.
///
/// All faces are meshed at once, so that they meet along their edges; only where that panics each is meshed alone.
pub(crate) fn meshes_of(shell: &TruckShell, chord: f64) -> Vec<Result<PolygonMesh, &'static str>> {
    let chord = chord.max(LEAST_CHORD);
    let meshed = |shell: &TruckShell| {
        catch_unwind(AssertUnwindSafe(|| shell.robust_triangulation(chord).faces))
            .map(|faces| faces.into_iter().map(checked).collect::<Vec<_>>())
    };
    meshed(shell).unwrap_or_else(|_| {
        let alone = |face: &CompressedFace<_>| CompressedShell {
            vertices: shell.vertices.clone(),
            edges: shell.edges.clone(),
            faces: vec![face.clone()],
        };
        let mesh_alone = |face| meshed(&alone(face)).ok().and_then(|mut faces| faces.pop());
        shell
            .faces
            .iter()
            .map(|face| mesh_alone(face).unwrap_or(Err("truck panicked")))
            .collect()
    })
}

fn checked(face: CompressedFace<Option<PolygonMesh>>) -> Result<PolygonMesh, &'static str> {
    let mesh = face.surface.ok_or("truck could not mesh it")?;
    let is_sound = mesh
        .positions()
        .iter()
        .all(|p| p.x.is_finite() && p.y.is_finite() && p.z.is_finite());
    if !is_sound {
        return Err("truck gave points without coordinates");
    }
    if mesh.faces().is_empty() {
        Err("truck gave no triangle")
    } else {
        Ok(mesh)
    }
}

/// The length of an edge by chords, in the file's unit.
pub(crate) fn edge_length(curve: &Curve3D) -> f64 {
    places(curve)
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).magnitude())
        .sum()
}

/// The diagonal of the box around all edges, in the file's unit.
pub(crate) fn diagonal<'a>(shells: impl Iterator<Item = &'a TruckShell>) -> f64 {
    let points: Vec<[f64; 3]> = shells
        .flat_map(|shell| shell.edges.iter().flat_map(|edge| places(&edge.curve)))
        .map(|p| [p.x, p.y, p.z])
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    partprobe_shape::bounding_diagonal(&points)
}

fn places(curve: &Curve3D) -> Vec<truck_meshalgo::prelude::Point3> {
    let along = || {
        let (start, end) = curve.range_tuple();
        (0..=PLACES)
            .map(|i| curve.subs(start + (end - start) * f64::from(i) / f64::from(PLACES)))
            .collect()
    };
    catch_unwind(AssertUnwindSafe(along)).unwrap_or_default()
}
