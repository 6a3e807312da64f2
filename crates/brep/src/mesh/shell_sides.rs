//! Reverses the shells of each solid so that the outermost ones enclose material, those directly inside them enclose voids,
//! those inside the voids enclose material again, and so on.
//!
//! The triangles decide which shell is inside which other one. Neither the order of the shells in the file nor their flags
//! are used. Volumes are sums of signed tetrahedra (the divergence theorem).

use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use super::nesting::{Enclosure, depths};
use super::repaired::edges_of;
use crate::model::Brep;
use partprobe_shape::{Point, cross, dot, subtract};

/// Reverses the closed shells of solids that are inside out.
pub(super) fn reverse_shells(brep: &Brep, meshes: &mut [Result<FaceMesh, FaceMeshError>]) {
    let is_wrong = inside_out(brep, meshes, &shell_volumes(brep, meshes));
    for (face, mesh) in brep.faces.iter().zip(meshes) {
        if let (Ok(mesh), Some(true)) = (mesh, is_wrong.get(face.shell as usize)) {
            mesh.reverse();
        }
    }
}

/// For each shell, whether it is inside out. `volumes` is the result of [`shell_volumes`].
///
/// Open shells, and those of surface models, stay as they are.
pub(super) fn inside_out(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
    volumes: &[Option<f64>],
) -> Vec<bool> {
    let is_void = voids(brep, meshes, volumes);
    let shells = brep.shells.iter().zip(volumes).zip(is_void);
    shells
        .map(|((shell, volume), is_void)| {
            let is_inside_out = |volume: f64| if is_void { volume > 0.0 } else { volume < 0.0 };
            shell.solid.is_some() && volume.is_some_and(is_inside_out)
        })
        .collect()
}

/// For each shell, whether it encloses a void.
fn voids(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
    volumes: &[Option<f64>],
) -> Vec<bool> {
    let mut is_void = vec![false; brep.shells.len()];
    let mut shells_of: Vec<Vec<usize>> = vec![Vec::new(); brep.solids.len()];
    for (index, shell) in brep.shells.iter().enumerate() {
        if let Some(shells) = shell
            .solid
            .and_then(|solid| shells_of.get_mut(solid as usize))
        {
            shells.push(index);
        }
    }
    // Nearly every solid has one shell, which encloses material.
    shells_of.retain(|shells| shells.len() > 1);
    if shells_of.is_empty() {
        return is_void;
    }
    let mut triangles = triangles_of_shells(brep, meshes, &shells_of.concat());
    for shells in shells_of {
        let enclosure =
            |&shell: &usize| Enclosure::new(std::mem::take(&mut triangles[shell]), volumes[shell]);
        let surfaces: Vec<Enclosure> = shells.iter().map(enclosure).collect();
        for (shell, depth) in shells.into_iter().zip(depths(&surfaces)) {
            is_void[shell] = depth % 2 == 1;
        }
    }
    is_void
}

/// The triangles of the given shells. The lists of the other shells are empty.
fn triangles_of_shells(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
    shells: &[usize],
) -> Vec<Vec<[Point; 3]>> {
    let mut is_wanted = vec![false; brep.shells.len()];
    shells.iter().for_each(|&shell| is_wanted[shell] = true);
    let mut triangles = vec![Vec::new(); brep.shells.len()];
    for (face, mesh) in brep.faces.iter().zip(meshes) {
        let shell = face.shell as usize;
        if let (Ok(mesh), Some(true)) = (mesh, is_wanted.get(shell)) {
            let corners = mesh
                .triangles
                .iter()
                .map(|corners| corners.map(|corner| mesh.points[corner as usize]));
            triangles[shell].extend(corners);
        }
    }
    triangles
}

/// The volume that the mesh of each shell encloses, or `None` if the shell is open.
pub(super) fn shell_volumes(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
) -> Vec<Option<f64>> {
    let mut volumes = vec![Some(0.0); brep.shells.len()];
    let mut origins: Vec<Option<Point>> = vec![None; brep.shells.len()];
    let is_free: Vec<bool> = n_uses(brep).into_iter().map(|n| n == 1).collect();
    for (face, mesh) in brep.faces.iter().zip(meshes) {
        let shell = face.shell as usize;
        let (Some(volume), Some(origin)) = (volumes.get_mut(shell), origins.get_mut(shell)) else {
            continue;
        };
        let mut uses = face.loops.iter().filter_map(edges_of).flatten();
        let has_free_edge = uses.any(|use_| is_free.get(use_.edge as usize) != Some(&false));
        *volume = match (*volume, mesh) {
            (Some(volume), Ok(mesh)) if !has_free_edge => {
                let origin =
                    *origin.get_or_insert(mesh.points.first().copied().unwrap_or_default());
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
pub(super) fn n_uses(brep: &Brep) -> Vec<u8> {
    let mut n_uses = vec![0_u8; brep.edges.len()];
    for use_ in brep
        .faces
        .iter()
        .flat_map(|face| &face.loops)
        .filter_map(edges_of)
        .flatten()
    {
        if let Some(n) = n_uses.get_mut(use_.edge as usize) {
            *n = n.saturating_add(1);
        }
    }
    n_uses
}
