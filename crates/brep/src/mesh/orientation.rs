//! Which way the faces' meshes are turned: the faces' normals say it, but where they contradict the boundaries,
//! neighbours would walk their common edge in the same direction, and the solid would not close.
//!
//! Faces are turned so that each edge between two of them is walked in both directions. Of the two ways to do so in
//! a connected set of faces the one that agrees with more of the normals, by area, is taken.

use super::face_mesh::FaceMesh;
use super::layout::Obstacle;
use crate::model::{Brep, Loop};

/// Two faces that share an edge which no third face uses.
struct Link {
    faces: [u32; 2],
    /// They walk it in the same direction: the file turns one of them over.
    is_same_direction: bool,
}

/// Turns the meshes that don't fit their neighbours.
pub(crate) fn orient(brep: &Brep, meshes: &mut [Result<FaceMesh, Obstacle>]) {
    let contradicts = |mesh: &Result<FaceMesh, Obstacle>| mesh.as_ref().is_ok_and(|mesh| mesh.is_against_boundary);
    let links = links(brep);
    if !meshes.iter().any(contradicts) && !links.iter().any(|link| link.is_same_direction) {
        return;
    }
    let (component, is_turned) = walk(meshes.len(), &links);
    // Whether the boundary, once its face is turned for its neighbours' sake, speaks against the normal.
    let against: Vec<bool> = meshes.iter().zip(&is_turned).map(|(mesh, turned)| contradicts(mesh) != *turned).collect();
    let mut agreement = vec![0.0; meshes.len()];
    for ((mesh, &against), &component) in meshes.iter().zip(&against).zip(&component) {
        let area = mesh.as_ref().map_or(0.0, |mesh| mesh.area);
        agreement[component as usize] += if against { -area } else { area };
    }
    for ((mesh, against), component) in meshes.iter_mut().zip(against).zip(component) {
        if let Ok(mesh) = mesh
            && against == (agreement[component as usize] >= 0.0)
        {
            mesh.turn();
        }
    }
}

/// The pairs of faces at the edges that two faces use once each.
fn links(brep: &Brep) -> Vec<Link> {
    let mut first: Vec<Option<(u32, bool)>> = vec![None; brep.edges.len()];
    let mut second = first.clone();
    let mut n_uses = vec![0_u8; brep.edges.len()];
    for (index, face) in (0..).zip(&brep.faces) {
        for bound in &face.loops {
            let Loop::Edges(uses) = bound else { continue };
            for use_ in uses {
                let edge = use_.edge as usize;
                let walk = Some((index, use_.forward != face.flipped));
                match n_uses.get(edge) {
                    Some(0) => first[edge] = walk,
                    Some(1) => second[edge] = walk,
                    _ => {}
                }
                if let Some(n) = n_uses.get_mut(edge) {
                    *n = n.saturating_add(1);
                }
            }
        }
    }
    let used_twice = first.into_iter().zip(second).zip(n_uses).filter(|(_, n)| *n == 2);
    let walks = used_twice.filter_map(|((a, b), _)| a.zip(b)).filter(|((a, _), (b, _))| a != b);
    walks
        .map(|((a, a_forward), (b, b_forward))| Link { faces: [a, b], is_same_direction: a_forward == b_forward })
        .collect()
}

/// The connected component of each face, by its first face, and whether it is turned against that one.
fn walk(n_faces: usize, links: &[Link]) -> (Vec<u32>, Vec<bool>) {
    let mut neighbors: Vec<Vec<(u32, bool)>> = vec![Vec::new(); n_faces];
    for &Link { faces: [a, b], is_same_direction } in links {
        neighbors[a as usize].push((b, is_same_direction));
        neighbors[b as usize].push((a, is_same_direction));
    }
    let mut component = vec![u32::MAX; n_faces];
    let mut is_turned = vec![false; n_faces];
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
                    is_turned[next as usize] = is_turned[face as usize] != is_same_direction;
                    open.push(next);
                }
            }
        }
    }
    (component, is_turned)
}
