//! Compares a reading with itself: each face's area by quadrature and by its triangles, and each solid's volume in the same way.
//! A measured file goes in, and counts and findings in words, with `#` numbers, come out.
//!
//! The two areas are computed in different ways. The mesh uses the boundary and the surface only at its vertices. The quadrature
//! uses the surface's stretch and the parameters of the boundary. Only chords can explain a difference.

use crate::MeasuredFile;
use partprobe_carrier::{Face, FaceType, border_sides, distance};
use serde::Serialize;
use std::fmt;

/// A disc whose chords span the angle tolerance loses a fraction of its area. On a face that is also curved, chords may remove
/// this many times as much.
const BY_ANGLE: f64 = 4.0 / 3.0;
/// For any small angle, both areas may differ by this fraction.
const AT_ANY_ANGLE: f64 = 0.003;
/// A strip along the boundary may be missing or additional. Its mean width over the whole boundary is at most this fraction of
/// the chord tolerance, because much of the boundary is straight.
const BY_CHORD: f64 = 0.25;
/// A face that is as narrow as the strip may lose this fraction of its area.
const BY_NARROWNESS: f64 = 0.15;
/// Volumes may differ by this fraction in addition to the effects of `volume_loss` and the chords.
const BY_VOLUME: f64 = 0.01;

/// The numbers of faces and solids that agree with themselves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SelfCount {
    /// Faces with triangles.
    pub n_faces: usize,
    /// Faces whose quadrature and triangles give the same area, within the effect of chords.
    pub n_faces_agreeing: usize,
    /// Solids that are closed in the file.
    pub n_solids: usize,
    /// Solids whose true surfaces and triangles enclose the same volume.
    pub n_solids_agreeing: usize,
}

impl SelfCount {
    /// Adds the faces and solids of another file or group.
    pub fn add(&mut self, other: Self) {
        self.n_faces += other.n_faces;
        self.n_faces_agreeing += other.n_faces_agreeing;
        self.n_solids += other.n_solids;
        self.n_solids_agreeing += other.n_solids_agreeing;
    }

    /// Faces and solids that contradict themselves.
    #[must_use]
    pub fn n_findings(&self) -> usize {
        self.n_faces - self.n_faces_agreeing + self.n_solids - self.n_solids_agreeing
    }
}

/// The quantity of a face or solid that was computed twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Quantity {
    /// The area of a face, in square millimeters.
    Area,
    /// The volume of a solid, in cubic millimeters.
    Volume,
}

/// A face or solid that contradicts itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// Its `#` number.
    pub step_id: u64,
    /// The quantity that contradicts.
    pub what: Quantity,
    /// The type of the face, or `None` for a solid.
    pub face_type: Option<&'static str>,
    /// By a quadrature of the true surfaces.
    pub surface: f64,
    /// Of the triangles.
    pub mesh: f64,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            step_id,
            what,
            face_type,
            surface,
            mesh,
        } = self;
        match what {
            Quantity::Area => {
                let face_type = face_type.unwrap_or("other");
                write!(
                    f,
                    "face #{step_id} ({face_type}) has {surface:.6} mm², its mesh {mesh:.6}"
                )
            }
            Quantity::Volume => write!(
                f,
                "solid #{step_id} encloses {surface:.6} mm³, its mesh {mesh:.6}"
            ),
        }
    }
}

/// A face with both of its areas.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TwoAreas {
    /// By quadrature, in square millimeters.
    area: f64,
    /// Of the triangles.
    mesh_area: f64,
    /// Length of the boundary of the triangles, in millimeters.
    border: f64,
}

/// The fraction of a round face by which its triangles may be smaller, for an angle tolerance in radians: at 0.3 rad a disc loses
/// 1.5 %, and 2 % are allowed.
fn by_angle(angle_rad: f64) -> f64 {
    (BY_ANGLE * (1.0 - angle_rad.sin() / angle_rad)).max(AT_ANY_ANGLE)
}

impl TwoAreas {
    /// Whether the chords explain the difference, for the tolerances of the mesh.
    fn agree(self, chord_mm: f64, angle_rad: f64) -> bool {
        let by_chord = BY_CHORD * chord_mm * self.border;
        let larger = self.area.max(self.mesh_area);
        let allowed = by_angle(angle_rad) * larger + by_chord.min(BY_NARROWNESS * larger);
        (self.area - self.mesh_area).abs() <= allowed
    }
}

/// Compares the areas and the volumes of a file with themselves. `angle_rad` is the angle tolerance of its mesh.
#[must_use]
pub fn self_check(measured: &MeasuredFile, angle_rad: f64) -> (SelfCount, Vec<Finding>) {
    let mut count = SelfCount::default();
    let mut findings = Vec::new();
    let graph = &measured.shape.graph;
    for (face, areas) in graph.faces.iter().zip(two_areas(measured)) {
        let Some(areas) = areas else { continue };
        count.n_faces += 1;
        if areas.agree(measured.shape.chord_mm, angle_rad) {
            count.n_faces_agreeing += 1;
        } else {
            findings.push(Finding {
                step_id: face.step_id,
                what: Quantity::Area,
                face_type: Some(face.face_type.name()),
                surface: areas.area,
                mesh: areas.mesh_area,
            });
        }
    }
    let solids = measured
        .brep
        .solids
        .iter()
        .zip(&measured.solids)
        .enumerate();
    for (index, (solid, of_solid)) in solids.filter(|(_, (_, solid))| solid.closed) {
        let (volume, mesh) = (of_solid.volume, of_solid.mesh.volume);
        count.n_solids += 1;
        if (volume - mesh).abs()
            <= BY_VOLUME * volume.abs().max(mesh.abs()) + slack(measured, index)
        {
            count.n_solids_agreeing += 1;
        } else {
            findings.push(Finding {
                step_id: solid.step_id,
                what: Quantity::Volume,
                face_type: None,
                surface: volume,
                mesh,
            });
        }
    }
    (count, findings)
}

/// The volume that the triangles may cut off a solid: a layer over its curved faces that is half as thick as the chord tolerance.
fn slack(measured: &MeasuredFile, index: usize) -> f64 {
    let is_curved =
        |face: &&Face| face.solid == Some(index as u32) && face.face_type != FaceType::Plane;
    let curved: f64 = measured
        .shape
        .graph
        .faces
        .iter()
        .filter(is_curved)
        .map(|face| face.area)
        .sum();
    0.5 * measured.shape.chord_mm * curved
}

/// Both areas of each face, or `None` for a face without triangles.
fn two_areas(measured: &MeasuredFile) -> Vec<Option<TwoAreas>> {
    let (graph, mesh) = (&measured.shape.graph, &measured.shape.mesh);
    let mut found: Vec<Option<TwoAreas>> = vec![None; graph.faces.len()];
    for (mesh_area, &face) in mesh.triangle_areas().into_iter().zip(&mesh.tri_face) {
        let area = graph.faces[face as usize].area;
        found[face as usize]
            .get_or_insert(TwoAreas {
                area,
                mesh_area: 0.0,
                border: 0.0,
            })
            .mesh_area += mesh_area;
    }
    for [a, b] in border_sides(&mesh.triangles) {
        let length = distance(mesh.vertices[a as usize], mesh.vertices[b as usize]);
        if let Some(areas) = &mut found[mesh.vertex_face[a as usize] as usize] {
            areas.border += length;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[track_caller]
    fn check([area, mesh_area, border]: [f64; 3], [chord_mm, angle_rad]: [f64; 2], expected: bool) {
        assert_eq!(
            TwoAreas {
                area,
                mesh_area,
                border
            }
            .agree(chord_mm, angle_rad),
            expected
        );
    }

    #[test]
    fn chords_explain_what_they_can() {
        // A disc of radius 2 at 0.3 rad, and the same at almost no tolerance.
        check([12.56, 12.36, 12.56], [0.01, 0.3], true);
        check([12.56, 12.36, 12.56], [0.0, 0.3], true);
        // Half of a spline face, the result when its parameters were uneven.
        check([34.69, 50.0, 34.1], [0.028, 0.3], false);
        check([62.5, 50.0, 34.1], [0.028, 0.3], false);
        // A strip narrower than the chord tolerance, and one that is folded.
        check([1.0, 1.15, 200.0], [0.01, 0.3], true);
        check([1.0, 1.4, 200.0], [0.01, 0.3], false);
    }

    #[test]
    fn a_finer_angle_explains_less_and_a_coarser_one_more() {
        let disc = |angle: f64| [PI, PI * angle.sin() / angle, TAU];
        for angle in [0.01, 0.1, 0.3, 0.8, 1.5] {
            check(disc(angle), [0.0, angle], true);
        }
        check(disc(0.3), [0.0, 0.1], false);
        check(disc(0.8), [0.0, 0.3], false);
        check([1.0, 0.9975, 4.0], [0.0, 0.01], true);
        check([1.0, 0.996, 4.0], [0.0, 0.01], false);
    }
}
