//! Meshes the faces of a shell with truck, and measures edges.

use crate::source::TruckShell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use truck_meshalgo::prelude::{
    BoundedCurve, InnerSpace, ParametricCurve, Point3, PolygonMesh, RobustMeshableShape,
};
use truck_stepio::r#in::alias::{Curve3D, Surface};
use truck_topology::compress::{CompressedFace, CompressedShell};

/// The number of chords that approximate an edge when its length and its bounding box are measured.
const N_CHORDS: u32 = 64;
/// truck panics at smaller tolerances.
const LEAST_CHORD: f64 = 2e-6;

/// The mesh of each face, or the reason why it has none.
///
/// All faces are meshed together, so that their triangles fit along shared edges. If that panics, each face is meshed alone.
pub(crate) fn meshes_of(shell: &TruckShell, chord: f64) -> Vec<Result<PolygonMesh, &'static str>> {
    let chord = chord.max(LEAST_CHORD);
    if let Some(meshes) = meshed(shell, chord) {
        return meshes;
    }
    shell
        .faces
        .iter()
        .map(|face| mesh_separately(shell, face, chord))
        .collect()
}

/// The mesh of each face, or `None` if truck panicked.
fn meshed(shell: &TruckShell, chord: f64) -> Option<Vec<Result<PolygonMesh, &'static str>>> {
    let faces = catch_unwind(AssertUnwindSafe(|| shell.robust_triangulation(chord).faces)).ok()?;
    Some(faces.into_iter().map(checked).collect())
}

fn mesh_separately(
    shell: &TruckShell,
    face: &CompressedFace<Surface>,
    chord: f64,
) -> Result<PolygonMesh, &'static str> {
    let alone = CompressedShell {
        vertices: shell.vertices.clone(),
        edges: shell.edges.clone(),
        faces: vec![face.clone()],
    };
    let mesh = meshed(&alone, chord).and_then(|mut faces| faces.pop());
    mesh.unwrap_or(Err("truck panicked"))
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

/// The length of an edge in the file's unit, measured along chords.
pub(crate) fn edge_length(curve: &Curve3D) -> f64 {
    points_along(curve)
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).magnitude())
        .sum()
}

/// The diagonal of the bounding box of all edges, in the file's unit.
pub(crate) fn diagonal<'a>(shells: impl Iterator<Item = &'a TruckShell>) -> f64 {
    let points: Vec<[f64; 3]> = shells
        .flat_map(|shell| {
            shell
                .edges
                .iter()
                .flat_map(|edge| points_along(&edge.curve))
        })
        .map(|p| [p.x, p.y, p.z])
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    partprobe_shape::bounding_diagonal(&points)
}

/// Points at equal steps of the parameter. Returns no points if truck panics.
fn points_along(curve: &Curve3D) -> Vec<Point3> {
    let along = || {
        let (start, end) = curve.range_tuple();
        (0..=N_CHORDS)
            .map(|i| curve.subs(start + (end - start) * f64::from(i) / f64::from(N_CHORDS)))
            .collect()
    };
    catch_unwind(AssertUnwindSafe(along)).unwrap_or_default()
}
