//! Finds the solid of each face, and a point near each solid from which volumes are measured.

use crate::model::{Brep, BrepFace, Loop};
use partprobe_shape::Point;

/// The solid that a face belongs to. Returns `None` if it belongs to none.
pub(super) fn solid_of(brep: &Brep, face: &BrepFace) -> Option<usize> {
    let solid = brep.shells.get(face.shell as usize)?.solid? as usize;
    (solid < brep.solids.len()).then_some(solid)
}

/// A point near each solid: a vertex of its first face that has one.
pub(super) fn solid_origins(brep: &Brep) -> Vec<Point> {
    let mut origins: Vec<Option<Point>> = vec![None; brep.solids.len()];
    for face in &brep.faces {
        let Some(solid) = solid_of(brep, face) else {
            continue;
        };
        let vertex = face.loops.iter().find_map(|bound| match bound {
            Loop::Edges(uses) => Some(brep.edges.get(uses.first()?.edge as usize)?.start),
            Loop::Vertex(vertex) => Some(*vertex),
        });
        let point = vertex
            .and_then(|vertex| brep.vertices.get(vertex as usize))
            .map(|vertex| vertex.point);
        origins[solid] = origins[solid].or(point);
    }
    origins
        .into_iter()
        .map(|origin| origin.unwrap_or_default())
        .collect()
}
