//! Which faces cut too much off their solids: meshes in, a flag for each face out.
//!
//! Chords run inside of what is round. At 0.3 rad a pin loses 1.5 % of its volume, a plate with four holes hardly anything:
//! an angle fine enough for the pin would triple the triangles of both. So what the triangles of each face leave between
//! them and the surface is measured, and only the faces that make a solid lose too much are meshed again.

use super::face_mesh::FaceMesh;
use super::layout::Obstacle;
use super::shell_sides::{inside_out, shell_volumes};
use super::solid_of;
use crate::model::Brep;

/// The part of what a face cuts off that the next finer level no longer does.
const MENDED: f64 = 0.5;

/// What the triangles of one solid do to its volume.
#[derive(Clone, Debug, Default)]
struct Loss {
    /// Volume of the mesh; none where it is open.
    volume: Option<f64>,
    /// The curved faces and what each cuts off; pins lose, holes win.
    faces: Vec<(usize, f64)>,
}

/// For each face whether it should be meshed finer, because the triangles cut too much off its closed solid or add too much.
pub(super) fn cutting_faces(
    brep: &Brep,
    meshes: &[Result<FaceMesh, Obstacle>],
    volume_loss: f64,
) -> Vec<bool> {
    let mut is_cutting = vec![false; meshes.len()];
    for loss in losses(brep, meshes) {
        loss.worst_faces(volume_loss)
            .into_iter()
            .for_each(|face| is_cutting[face] = true);
    }
    is_cutting
}

impl Loss {
    /// The faces that cut off most, as few of them as must be meshed finer to keep the volume.
    fn worst_faces(mut self, volume_loss: f64) -> Vec<usize> {
        let Some(volume) = self.volume else {
            return Vec::new();
        };
        let most = volume_loss * volume.abs();
        let mut left: f64 = self.faces.iter().map(|(_, cut_off)| cut_off).sum();
        // Of a thin wall one side loses what the other wins; largest first, they are mended in turns.
        self.faces.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
        let is_needed = |(_, cut_off): &(usize, f64)| {
            let is_needed = left.abs() > most;
            left -= MENDED * cut_off;
            is_needed
        };
        self.faces
            .into_iter()
            .take_while(is_needed)
            .map(|(face, _)| face)
            .collect()
    }
}

fn losses(brep: &Brep, meshes: &[Result<FaceMesh, Obstacle>]) -> Vec<Loss> {
    let mut losses = vec![
        Loss {
            volume: Some(0.0),
            ..Loss::default()
        };
        brep.solids.len()
    ];
    let volumes = shell_volumes(brep, meshes);
    // Shells are turned when all is meshed; here they count as they will be.
    let hands: Vec<f64> = inside_out(brep, meshes, &volumes)
        .into_iter()
        .map(|is_wrong| if is_wrong { -1.0 } else { 1.0 })
        .collect();
    for ((shell, volume), hand) in brep.shells.iter().zip(volumes).zip(&hands) {
        if let Some(loss) = shell.solid.and_then(|solid| losses.get_mut(solid as usize)) {
            loss.volume = loss
                .volume
                .zip(volume)
                .map(|(sum, volume)| sum + hand * volume);
        }
    }
    for (index, (face, mesh)) in brep.faces.iter().zip(meshes).enumerate() {
        if let (Some(solid), Ok(mesh)) = (solid_of(brep, face), mesh)
            && mesh.cut_off != 0.0
        {
            losses[solid]
                .faces
                .push((index, hands[face.shell as usize] * mesh.cut_off));
        }
    }
    losses
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(volume: Option<f64>, cut_off: &[f64], expected: &[usize]) {
        let faces = cut_off.iter().copied().enumerate().collect();
        assert_eq!(Loss { volume, faces }.worst_faces(0.008), expected);
    }

    #[test]
    fn no_more_faces_are_meshed_finer_than_must_be() {
        check(Some(100.0), &[0.5, 0.2], &[]);
        check(Some(100.0), &[0.5, 0.4], &[0]);
        check(Some(100.0), &[0.1, 1.0, 0.9], &[1, 2, 0]);
        check(Some(-100.0), &[-0.2, 1.2], &[1]);
        check(None, &[5.0], &[]);
        // A thin wall: one side alone would spoil what the two balance.
        check(Some(100.0), &[25.0, -24.0], &[0, 1]);
        check(Some(100.0), &[25.0, -24.5], &[]);
    }
}
