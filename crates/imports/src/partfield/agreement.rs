//! Measures the agreement of two labelings of a mesh, by area.

use partprobe_carrier::Mesh;
use std::collections::BTreeMap;

/// The adjusted Rand index of two labelings of the triangles, each pair of surface elements weighted by its areas (Hubert and
/// Arabie 1985, for infinitely many points).
///
/// It is 1 for equal labelings and about 0 for unrelated ones. Triangles without one of the two labels do not count. Returns
/// `None` if no area counts.
pub(super) fn agreement_by_area(mesh: &Mesh, labels: &[i32], reference: &[i32]) -> Option<f64> {
    let mut both: BTreeMap<(i32, i32), f64> = BTreeMap::new();
    let mut of_label: BTreeMap<i32, f64> = BTreeMap::new();
    let mut of_reference: BTreeMap<i32, f64> = BTreeMap::new();
    let mut total = 0.0;
    let areas = mesh.triangle_areas();
    for (area, (&label, &part)) in areas.into_iter().zip(labels.iter().zip(reference)) {
        if label < 0 || part < 0 {
            continue;
        }
        *both.entry((label, part)).or_default() += area;
        *of_label.entry(label).or_default() += area;
        *of_reference.entry(part).or_default() += area;
        total += area;
    }
    if total <= 0.0 {
        return None;
    }

    let share_of_pairs = |areas: &mut dyn Iterator<Item = &f64>| -> f64 {
        areas.map(|area| (area / total).powi(2)).sum()
    };
    let together = share_of_pairs(&mut both.values());
    let by_label = share_of_pairs(&mut of_label.values());
    let by_reference = share_of_pairs(&mut of_reference.values());
    let expected = by_label * by_reference;
    let largest = 0.5 * (by_label + by_reference);
    // Both labelings have only one label, so they are equal.
    if largest - expected <= f64::EPSILON {
        return Some(1.0);
    }
    Some((together - expected) / (largest - expected))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(labels: [i32; 4], reference: [i32; 4], expected: Option<f64>) {
        // Four triangles of equal area.
        let mesh = Mesh {
            vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            vertex_face: vec![0; 3],
            triangles: vec![[0, 1, 2]; 4],
            tri_face: vec![0; 4],
            vertex_normal: Vec::new(),
        };
        let found = agreement_by_area(&mesh, &labels, &reference);
        assert_eq!(found.is_some(), expected.is_some());
        let difference = found.unwrap_or_default() - expected.unwrap_or_default();
        assert!(difference.abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn equal_labelings_agree_and_a_single_label_is_not_informative() {
        check([0, 0, 1, 1], [5, 5, 2, 2], Some(1.0));
        check([3, 3, 3, 3], [0, 0, 0, 0], Some(1.0));
        check([3, 3, 3, 3], [0, 0, 1, 1], Some(0.0));
        // Together 1/4, expected 1/2 · 1/2, so the agreement is that of chance.
        check([0, 1, 0, 1], [0, 0, 1, 1], Some(0.0));
        // Together 6/16, expected 6/16 · 8/16, at most 7/16.
        check([0, 0, 1, 2], [0, 0, 1, 1], Some(3.0 / 4.0));
        check([0, 0, -1, -1], [-1, -1, 1, 1], None);
    }
}
