//! Finds where the labels of a mesh change: the sides between triangles with different labels.

use partprobe_carrier::{Point, WeldedMesh, distance};

/// A straight piece of a border between two labels, from one end to the other, in millimeters.
pub type Border = [Point; 2];

/// Finds the sides at which two triangles with different labels meet, in the order of the sides' vertices.
///
/// `labels` has one label per triangle. A triangle with a negative label has no border, because its label is unknown. A side with
/// more than two triangles is a border if any two of their labels differ, and is listed once.
#[must_use]
pub fn label_borders(mesh: &WeldedMesh, labels: &[i32]) -> Vec<Border> {
    let mut sides: Vec<([u32; 2], i32)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (&[a, b, c], &label) in mesh.triangles.iter().zip(labels) {
        if label < 0 {
            continue;
        }
        let around = [[a, b], [b, c], [c, a]];
        sides.extend(around.map(|[from, to]| ([from.min(to), from.max(to)], label)));
    }
    sides.sort_unstable();

    let is_border = |around: &&[([u32; 2], i32)]| around[0].1 != around[around.len() - 1].1;
    let ends =
        |around: &[([u32; 2], i32)]| around[0].0.map(|vertex| mesh.vertices[vertex as usize]);
    sides
        .chunk_by(|a, b| a.0 == b.0)
        .filter(is_border)
        .map(ends)
        .filter(|[from, to]| from != to)
        .collect()
}

/// The total length of borders, in millimeters.
#[must_use]
pub fn length_of_borders(borders: &[Border]) -> f64 {
    borders.iter().map(|&[from, to]| distance(from, to)).sum()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A row of unit squares, two triangles each, from x = 0 along the x axis.
    pub(in crate::agreement) fn row_of_squares(n: u32) -> WeldedMesh {
        let corner = |i: u32| [[f64::from(i), 0.0, 0.0], [f64::from(i), 1.0, 0.0]];
        let square = |i: u32| {
            [
                [2 * i, 2 * i + 2, 2 * i + 1],
                [2 * i + 1, 2 * i + 2, 2 * i + 3],
            ]
        };
        WeldedMesh {
            vertices: (0..=n).flat_map(corner).collect(),
            triangles: (0..n).flat_map(square).collect(),
        }
    }

    #[track_caller]
    fn check(label_of_square: &[i32], expected_x: &[f64]) {
        let mesh = row_of_squares(label_of_square.len() as u32);
        let labels: Vec<i32> = label_of_square
            .iter()
            .flat_map(|&label| [label; 2])
            .collect();
        let borders = label_borders(&mesh, &labels);
        let found: Vec<f64> = borders.iter().map(|[from, _]| from[0]).collect();
        assert_eq!(found, expected_x, "{label_of_square:?}");
        assert!((length_of_borders(&borders) - expected_x.len() as f64).abs() < 1e-12);
    }

    #[test]
    fn borders_are_where_labels_change() {
        check(&[3, 3, 3], &[]);
        check(&[0, 0, 1, 0], &[2.0, 3.0]);
        check(&[0, -1, 1], &[]);
        check(&[], &[]);
    }

    #[test]
    fn a_side_of_three_triangles_is_a_border_once() {
        let mut mesh = row_of_squares(1);
        mesh.vertices.push([0.0, 0.0, 1.0]);
        mesh.triangles.push([1, 2, 4]);
        assert_eq!(label_borders(&mesh, &[0, 0, 1]).len(), 1);
        assert_eq!(label_borders(&mesh, &[0, 1, 2]).len(), 1);
        assert_eq!(label_borders(&mesh, &[0, 0, -1]).len(), 0);
    }
}
