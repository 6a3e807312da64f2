//! Describes what the mesh of a face loses: its triangles, the true position of its boundary, or detail.

use super::adaptive::MOST_TRIANGLES;
use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use super::off_surface::{off_surface, straight_off_surface};
use super::unwrap::Off;
use crate::model::{Brep, BrepFace};
use std::fmt::Display;

/// If a face has too many triangles to be meshed finer, it is named if the area of its triangles differs from its own by more
/// than this fraction.
const BUDGET_LOSS: f64 = 0.02;

/// Describes what is lost of a face: all its triangles, the true position of its boundary, or detail that a budget left out.
/// Returns `None` if nothing is lost.
pub(super) fn lost_description(
    brep: &Brep,
    face: &BrepFace,
    mesh: &Result<FaceMesh, FaceMeshError>,
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
        Err(error) => Some(no_triangles(error, off())),
    }
}

/// The message about a face whose triangles would exceed the budget of the mesh.
pub(super) fn beyond_max_triangles(brep: &Brep, face: &BrepFace, size: f64) -> String {
    let off = off_surface(brep, face, size).map(|off| off.message());
    no_triangles(
        "the triangle budget is used up; raise it or the tolerances",
        off,
    )
}

fn no_triangles(reason: impl Display, off: Option<String>) -> String {
    match off {
        Some(off) => format!("no triangles: {reason}; {off}"),
        None => format!("no triangles: {reason}"),
    }
}

/// The message about a face that may not have more triangles although much of its area is missing.
fn beyond_budget(mesh: &FaceMesh) -> Option<String> {
    let missing = mesh.area - mesh.area_of_triangles();
    let is_short =
        mesh.triangles.len() >= MOST_TRIANGLES && missing.abs() > BUDGET_LOSS * mesh.area;
    is_short.then(|| {
        let (percent, n, most) = (100.0 * missing / mesh.area, mesh.triangles.len(), MOST_TRIANGLES);
        format!(
            "its {n} triangles have {:.1} % {} area than its surface, and a face of {most} is meshed no finer; lower the \
             tolerances",
            percent.abs(),
            if percent > 0.0 { "less" } else { "more" }
        )
    })
}
