//! Finds the faces whose triangles change the volume of their solid too much.
//!
//! Chords lie inside a convex surface. At 0.3 rad a pin loses 1.5 % of its volume, but a plate with four holes loses hardly
//! anything: an angle that is fine enough for the pin would triple the triangles of both. So the volume between each face's
//! triangles and its surface is measured, and only the faces that matter most are meshed again.

use super::error::FaceMeshError;
use super::face_mesh::FaceMesh;
use super::shell_sides::{inside_out, shell_volumes};
use super::solids::solid_of;
use crate::model::Brep;

/// The fraction of the volume error of a face that the next finer level removes.
const REMOVED: f64 = 0.5;

/// The difference between a solid's volume and that of its triangles.
#[derive(Clone, Debug, Default)]
struct VolumeError {
    /// Volume of the mesh, or `None` if it is open.
    volume: Option<f64>,
    /// The curved faces, and the volume that the triangles of each cut off. It is positive for a pin and negative for a hole.
    faces: Vec<(usize, f64)>,
}

/// For each face, whether it should be meshed finer because the triangles cut too much off its closed solid or add too much.
pub(super) fn cutting_faces(
    brep: &Brep,
    meshes: &[Result<FaceMesh, FaceMeshError>],
    volume_loss: f64,
) -> Vec<bool> {
    let mut is_cutting = vec![false; meshes.len()];
    for error in volume_errors(brep, meshes) {
        error
            .worst_faces(volume_loss)
            .into_iter()
            .for_each(|face| is_cutting[face] = true);
    }
    is_cutting
}

impl VolumeError {
    /// The faces that cut off most. They are as few as possible: those that must be meshed finer to keep the volume.
    fn worst_faces(mut self, volume_loss: f64) -> Vec<usize> {
        let Some(volume) = self.volume else {
            return Vec::new();
        };
        let most = volume_loss * volume.abs();
        let mut left: f64 = self.faces.iter().map(|(_, cut_off)| cut_off).sum();
        // One side of a thin wall loses what the other side gains, so both sides are refined. The largest error comes first.
        self.faces.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let is_needed = |(_, cut_off): &(usize, f64)| {
            let is_needed = left.abs() > most;
            left -= REMOVED * cut_off;
            is_needed
        };
        self.faces
            .into_iter()
            .take_while(is_needed)
            .map(|(face, _)| face)
            .collect()
    }
}

fn volume_errors(brep: &Brep, meshes: &[Result<FaceMesh, FaceMeshError>]) -> Vec<VolumeError> {
    let mut errors = vec![
        VolumeError {
            volume: Some(0.0),
            ..VolumeError::default()
        };
        brep.solids.len()
    ];
    let volumes = shell_volumes(brep, meshes);
    // Shells are reversed after all faces are meshed. Here they count with their final orientation.
    let hands: Vec<f64> = inside_out(brep, meshes, &volumes)
        .into_iter()
        .map(|is_wrong| if is_wrong { -1.0 } else { 1.0 })
        .collect();
    for ((shell, volume), hand) in brep.shells.iter().zip(volumes).zip(&hands) {
        if let Some(error) = shell.solid.and_then(|solid| errors.get_mut(solid as usize)) {
            error.volume = error
                .volume
                .zip(volume)
                .map(|(sum, volume)| sum + hand * volume);
        }
    }
    for (index, (face, mesh)) in brep.faces.iter().zip(meshes).enumerate() {
        if let (Some(solid), Ok(mesh)) = (solid_of(brep, face), mesh)
            && mesh.cut_off != 0.0
        {
            errors[solid]
                .faces
                .push((index, hands[face.shell as usize] * mesh.cut_off));
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(volume: Option<f64>, cut_off: &[f64], expected: &[usize]) {
        let faces = cut_off.iter().copied().enumerate().collect();
        assert_eq!(VolumeError { volume, faces }.worst_faces(0.008), expected);
    }

    #[test]
    fn no_more_faces_are_meshed_finer_than_must_be() {
        check(Some(100.0), &[0.5, 0.2], &[]);
        check(Some(100.0), &[0.5, 0.4], &[0]);
        check(Some(100.0), &[0.1, 1.0, 0.9], &[1, 2, 0]);
        check(Some(-100.0), &[-0.2, 1.2], &[1]);
        check(None, &[5.0], &[]);
        // A thin wall: the errors of its two sides cancel, so they are refined together.
        check(Some(100.0), &[25.0, -24.0], &[0, 1]);
        check(Some(100.0), &[25.0, -24.5], &[]);
    }
}
