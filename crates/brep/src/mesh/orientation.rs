//! Which way the faces' meshes are turned: the faces' normals say it, but where they contradict the boundaries,
//! neighbours would walk their common edge in the same direction, and the solid would not close.
//!
//! Faces are turned so that each edge between two of them is walked in both directions. Of the two ways to do so in
//! a connected set of faces the one that agrees with more of the normals, by area, is taken. Last, a closed shell of
//! a solid is turned as a whole where it lies inside out: the first encloses material, the others enclose voids,
//! whatever their flags say.

use super::face_mesh::FaceMesh;
use super::layout::Obstacle;
use crate::model::{Brep, Loop};
use carrier::{Point, cross, dot, subtract};

/// Two faces that share an edge which no third face uses.
struct Link {
    faces: [u32; 2],
    /// They walk it in the same direction: the file turns one of them over.
    is_same_direction: bool,
}

/// Turns the meshes that don't fit their neighbours, and the shells that lie inside out.
pub(crate) fn orient(brep: &Brep, meshes: &mut [Result<FaceMesh, Obstacle>]) {
    agree_with_neighbors(brep, meshes);
    turn_shells(brep, meshes);
}

/// Turns the closed shells of solids that lie inside out.
fn turn_shells(brep: &Brep, meshes: &mut [Result<FaceMesh, Obstacle>]) {
    let volumes = shell_volumes(brep, meshes);
    let mut has_outside = vec![false; brep.solids.len()];
    let mut is_wrong = vec![false; brep.shells.len()];
    for ((shell, volume), is_wrong) in brep.shells.iter().zip(volumes).zip(&mut is_wrong) {
        let Some(has_outside) = shell.solid.and_then(|solid| has_outside.get_mut(solid as usize)) else { continue };
        let is_void = std::mem::replace(has_outside, true);
        *is_wrong = volume.is_some_and(|volume| if is_void { volume > 0.0 } else { volume < 0.0 });
    }
    for (face, mesh) in brep.faces.iter().zip(meshes) {
        if let (Ok(mesh), Some(true)) = (mesh, is_wrong.get(face.shell as usize)) {
            mesh.turn();
        }
    }
}

/// The volume that the mesh of each shell encloses; none where the shell is open.
pub(super) fn shell_volumes(brep: &Brep, meshes: &[Result<FaceMesh, Obstacle>]) -> Vec<Option<f64>> {
    let mut volumes = vec![Some(0.0); brep.shells.len()];
    let mut origins: Vec<Option<Point>> = vec![None; brep.shells.len()];
    let is_free: Vec<bool> = n_uses(brep).into_iter().map(|n| n == 1).collect();
    for (face, mesh) in brep.faces.iter().zip(meshes) {
        let shell = face.shell as usize;
        let (Some(volume), Some(origin)) = (volumes.get_mut(shell), origins.get_mut(shell)) else { continue };
        let has_free_edge = face.loops.iter().any(|bound| match bound {
            Loop::Edges(uses) => uses.iter().any(|use_| is_free.get(use_.edge as usize) != Some(&false)),
            Loop::Vertex(_) => false,
        });
        *volume = match (*volume, mesh) {
            (Some(volume), Ok(mesh)) if !has_free_edge => {
                let origin = *origin.get_or_insert(mesh.points.first().copied().unwrap_or_default());
                Some(volume + volume_from(origin, mesh))
            }
            _ => None,
        };
    }
    volumes
}

fn volume_from(origin: Point, mesh: &FaceMesh) -> f64 {
    let cone = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| subtract(mesh.points[corner as usize], origin));
        dot(a, cross(b, c)) / 6.0
    };
    mesh.triangles.iter().map(cone).sum()
}

/// How often the faces use each edge.
fn n_uses(brep: &Brep) -> Vec<u8> {
    let mut n_uses = vec![0_u8; brep.edges.len()];
    let bounds = brep.faces.iter().flat_map(|face| &face.loops);
    for use_ in bounds.filter_map(|bound| if let Loop::Edges(uses) = bound { Some(uses) } else { None }).flatten() {
        if let Some(n) = n_uses.get_mut(use_.edge as usize) {
            *n = n.saturating_add(1);
        }
    }
    n_uses
}

/// Turns the meshes that don't fit their neighbours.
fn agree_with_neighbors(brep: &Brep, meshes: &mut [Result<FaceMesh, Obstacle>]) {
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
    let n_uses = n_uses(brep);
    let mut first: Vec<Option<(u32, bool)>> = vec![None; brep.edges.len()];
    let mut links = Vec::new();
    for (index, face) in (0..).zip(&brep.faces) {
        for bound in &face.loops {
            let Loop::Edges(uses) = bound else { continue };
            for use_ in uses.iter().filter(|use_| n_uses.get(use_.edge as usize) == Some(&2)) {
                let forward = use_.forward != face.flipped;
                match first[use_.edge as usize] {
                    None => first[use_.edge as usize] = Some((index, forward)),
                    Some((other, _)) if other == index => {}
                    Some((other, other_forward)) => {
                        links.push(Link { faces: [other, index], is_same_direction: forward == other_forward });
                    }
                }
            }
        }
    }
    links
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
