//! Reverses the meshes of faces whose normals contradict those of their neighbors.
//!
//! Two neighbors must walk along their common edge in opposite directions, or the solid does not close. In a connected set of
//! faces there are two ways to do so. The one that agrees with more of the file's normals, by area, is taken. The direction of
//! an edge is that of the triangles. The loops of the file are used only if a face has no triangles, because the loop of a hole
//! may have the wrong direction while the face beyond it is right.

use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use super::repaired::edges_of;
use super::shell_sides::n_uses;
use crate::model::{Brep, BrepFace, EdgeUse};

/// Two faces that share an edge which no third face uses.
struct Link {
    faces: [u32; 2],
    /// Whether both walk it in the same direction. Then the file reverses one of them.
    is_same_direction: bool,
}

/// Reverses the meshes that do not fit their neighbors.
pub(super) fn agree_with_neighbors(brep: &Brep, meshes: &mut [Result<FaceMesh, FaceMeshError>]) {
    let links = links(brep, meshes);
    if !links.iter().any(|link| link.is_same_direction) {
        return;
    }
    let (component, is_reversed) = walk(meshes.len(), &links);
    let mut agreement = vec![0.0; meshes.len()];
    for ((mesh, &is_reversed), &component) in meshes.iter().zip(&is_reversed).zip(&component) {
        let area = mesh.as_ref().map_or(0.0, |mesh| mesh.area);
        agreement[component as usize] += if is_reversed { -area } else { area };
    }
    for ((mesh, is_reversed), component) in meshes.iter_mut().zip(is_reversed).zip(component) {
        if let Ok(mesh) = mesh
            && is_reversed == (agreement[component as usize] >= 0.0)
        {
            mesh.reverse();
        }
    }
}

/// The pairs of faces at the edges that two faces use once each.
fn links(brep: &Brep, meshes: &[Result<FaceMesh, FaceMeshError>]) -> Vec<Link> {
    let n_uses = n_uses(brep);
    let mut first: Vec<Option<(u32, bool)>> = vec![None; brep.edges.len()];
    let mut links = Vec::new();
    for ((index, face), mesh) in (0..).zip(&brep.faces).zip(meshes) {
        let mut add = |EdgeUse { edge, forward }: EdgeUse| {
            if n_uses.get(edge as usize) != Some(&2) {
                return;
            }
            match first[edge as usize] {
                None => first[edge as usize] = Some((index, forward)),
                Some((other, _)) if other == index => {}
                Some((other, other_forward)) => {
                    links.push(Link {
                        faces: [other, index],
                        is_same_direction: forward == other_forward,
                    });
                }
            }
        };
        match mesh {
            Ok(mesh) => mesh.walks.iter().copied().for_each(&mut add),
            Err(_) => walks_of_loops(face).for_each(&mut add),
        }
    }
    links
}

/// The directions in which the triangles of a face walk its edges if its loops are right.
pub(super) fn walks_of_loops(face: &BrepFace) -> impl Iterator<Item = EdgeUse> + '_ {
    let uses = face.loops.iter().filter_map(edges_of).flatten();
    uses.map(|use_| EdgeUse {
        forward: use_.forward != face.flipped,
        ..*use_
    })
}

/// For each face the first face of its connected component, and whether the face is reversed relative to that one.
fn walk(n_faces: usize, links: &[Link]) -> (Vec<u32>, Vec<bool>) {
    let mut neighbors: Vec<Vec<(u32, bool)>> = vec![Vec::new(); n_faces];
    for &Link {
        faces: [a, b],
        is_same_direction,
    } in links
    {
        neighbors[a as usize].push((b, is_same_direction));
        neighbors[b as usize].push((a, is_same_direction));
    }
    let mut component = vec![u32::MAX; n_faces];
    let mut is_reversed = vec![false; n_faces];
    for start in 0..n_faces as u32 {
        if component[start as usize] != u32::MAX {
            continue;
        }
        component[start as usize] = start;
        let mut open = vec![start];
        while let Some(face) = open.pop() {
            for &(next, is_same_direction) in &neighbors[face as usize] {
                if component[next as usize] == u32::MAX {
                    component[next as usize] = start;
                    is_reversed[next as usize] = is_reversed[face as usize] != is_same_direction;
                    open.push(next);
                }
            }
        }
    }
    (component, is_reversed)
}
