//! Compares the two areas of a face, and gives a warning if they disagree.
//!
//! One area is the integral over the surface inside the true boundary. The other is the total area of the triangles. Chords
//! explain a small difference. A large difference means that a boundary crosses itself, or that the surface and the edges in the
//! file do not fit together.

use super::face_mesh::FaceMesh;
use partprobe_shape::distance;

/// The fraction of a face by which its areas may differ.
const MOST_DIFFERENCE: f64 = 0.15;

/// Returns a message about a face if its areas differ by more than 15 %, and by more than a strip along its border that is as
/// wide as the chord tolerance (in millimeters).
///
/// There is also a message if the quadrature gave an impossible area. Then the face has the area of its triangles.
pub(super) fn disagreement(mesh: &FaceMesh, chord_mm: f64) -> Option<String> {
    if let Some(impossible) = mesh.impossible_area {
        return Some(format!(
            "the area of its surface came out as {impossible:.3e} mm², so the area of its triangles, {} mm², stands for it; \
             look at this face before you use either",
            in_figures(mesh.area)
        ));
    }
    let (area, of_triangles) = (mesh.area, mesh.area_of_triangles());
    let difference = (area - of_triangles).abs();
    let is_strong = difference > MOST_DIFFERENCE * area.max(of_triangles)
        && difference > chord_mm * border(mesh);
    is_strong.then(|| {
        format!(
            "its surface has {} mm² inside its boundary, but its triangles have {} mm²; look at this face before you use \
             either",
            in_figures(area),
            in_figures(of_triangles)
        )
    })
}

/// The total length of the sides that only one triangle has, in millimeters.
fn border(mesh: &FaceMesh) -> f64 {
    let sides = mesh
        .triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let mut sides: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    sides.sort_unstable();
    let alone = sides.chunk_by(|a, b| a == b).filter(|run| run.len() == 1);
    alone
        .map(|run| {
            distance(
                mesh.points[run[0][0] as usize],
                mesh.points[run[0][1] as usize],
            )
        })
        .sum()
}

/// An area with four significant digits or decimals, as text.
fn in_figures(area: f64) -> String {
    if (0.001..1e6).contains(&area) {
        format!("{area:.4}")
    } else {
        format!("{area:.3e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of two triangles, 10 mm long. The area of its surface is set to `area`.
    #[track_caller]
    fn check(width: f64, area: f64, chord_mm: f64, expected: bool) {
        let mesh = FaceMesh {
            points: vec![
                [0.0; 3],
                [10.0, 0.0, 0.0],
                [10.0, width, 0.0],
                [0.0, width, 0.0],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            area,
            ..FaceMesh::default()
        };
        assert_eq!(disagreement(&mesh, chord_mm).is_some(), expected);
    }

    #[test]
    fn only_differences_that_chords_do_not_explain_are_reported() {
        check(5.0, 50.0, 0.01, false);
        check(5.0, 44.0, 0.01, false);
        check(5.0, 40.0, 0.01, true);
        check(5.0, 62.5, 0.01, true);
        check(5.0, 1e-9, 0.01, true);
        // The strip along the border is 20.2 mm long.
        check(0.1, 0.7, 0.02, false);
        check(0.1, 0.7, 0.001, true);
    }

    #[test]
    fn an_impossible_area_is_named_even_though_the_areas_are_equal() {
        let mesh = FaceMesh {
            points: vec![[0.0; 3], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            area: 50.0,
            impossible_area: Some(-0.25),
            ..FaceMesh::default()
        };
        let text = disagreement(&mesh, 0.01).unwrap();
        assert!(
            text.contains("-2.500e-1 mm²") && text.contains("50.0000 mm²"),
            "{text}"
        );
        assert_eq!(
            disagreement(
                &FaceMesh {
                    impossible_area: None,
                    ..mesh
                },
                0.01
            ),
            None
        );
    }

    #[test]
    fn both_areas_are_named() {
        let mesh = FaceMesh {
            points: vec![[0.0; 3], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]],
            triangles: vec![[0, 1, 2]],
            area: 34.69,
            ..FaceMesh::default()
        };
        let text = disagreement(&mesh, 0.01).unwrap();
        assert!(
            text.contains("34.6900 mm²") && text.contains("50.0000 mm²"),
            "{text}"
        );
    }
}
