//! Divides a mesh into small pieces, and labels points by their pieces.
//!
//! A CAD mesh has large triangles where it is flat. If the boundaries of a segmentation may lie inside such triangles, it labels
//! the pieces of the refined mesh. Nothing here decides what the labels are.

use crate::source::PointRule;
use crate::triangle_normal::size_or_one;
use partprobe_carrier::{
    IGNORE, Mesh, Point, REFINE_FRACTION, RefinedMesh, cross, dot, refine, refined_triangle_counts,
    subtract,
};
use std::ops::Range;

/// The mesh is refined less if it would have this many pieces or more.
pub(crate) const MAX_PIECES: u32 = 50_000;

/// The refined mesh, and the range of pieces of each triangle.
#[derive(Clone, Debug)]
pub struct Pieces {
    /// The refined mesh.
    pub fine: Mesh,
    /// The index of the first piece of each triangle of the plain mesh, and the number of pieces at the end.
    pub first_piece: Vec<usize>,
}

impl Pieces {
    /// Pieces with edges of at most 1/32 of the diagonal, or longer ones if there would be too many.
    #[must_use]
    pub fn of(mesh: &Mesh) -> Self {
        let RefinedMesh { mesh: fine, parent } = refine(mesh, longest_edge(mesh));
        let starts = 0..=mesh.triangles.len();
        let first_piece = starts
            .map(|triangle| parent.partition_point(|&of| (of as usize) < triangle))
            .collect();
        Self { fine, first_piece }
    }

    /// The triangles of the mesh itself as pieces.
    #[must_use]
    pub fn whole(mesh: &Mesh) -> Self {
        Self {
            fine: mesh.clone(),
            first_piece: (0..=mesh.triangles.len()).collect(),
        }
    }

    /// The piece that contains the point, or the piece that is nearest to containing it.
    fn piece_at(&self, pieces: Range<usize>, point: Point) -> Option<usize> {
        let inside = |&piece: &usize| least_barycentric(self.fine.corners(piece), point);
        pieces.max_by(|a, b| inside(a).total_cmp(&inside(b)))
    }
}

/// One label per piece. A point has the label of its piece.
#[derive(Clone, Debug)]
pub struct PieceLabels {
    /// The pieces.
    pub pieces: Pieces,
    /// The label of each piece.
    pub labels: Vec<u32>,
}

impl PointRule for PieceLabels {
    fn label(&self, triangle: u32, point: Point) -> i32 {
        let bounds = [triangle as usize, triangle as usize + 1]
            .map(|at| self.pieces.first_piece.get(at).copied());
        let [Some(first), Some(end)] = bounds else {
            return IGNORE;
        };
        let label = |piece: usize| self.labels.get(piece).map(|&label| label as i32);
        self.pieces
            .piece_at(first..end, point)
            .and_then(label)
            .unwrap_or(IGNORE)
    }
}

/// The smallest of the point's three barycentric coordinates. Inside the triangle it is not negative.
fn least_barycentric([a, b, c]: [Point; 3], point: Point) -> f64 {
    let normal = cross(subtract(b, a), subtract(c, a));
    let squared = dot(normal, normal);
    if squared <= 0.0 || !squared.is_finite() {
        return f64::NEG_INFINITY;
    }
    let across = |from: Point, to: Point| {
        dot(normal, cross(subtract(to, from), subtract(point, from))) / squared
    };
    across(a, b).min(across(b, c)).min(across(c, a))
}

/// The longest edge of a piece: 1/32 of the diagonal, or a power of two times that if there were too many pieces.
///
/// Long needles need a longer edge, because each of them would be divided into dozens of pieces. A mesh whose size is not finite
/// is not refined.
fn longest_edge(mesh: &Mesh) -> f64 {
    if !mesh.diagonal().is_finite() {
        return f64::INFINITY;
    }
    let one_part = vec![
        0;
        mesh.tri_face
            .iter()
            .max()
            .map_or(0, |&last| last as usize + 1)
    ];
    let is_too_much = |edge: f64| {
        refined_triangle_counts(mesh, &one_part, edge, MAX_PIECES)
            .iter()
            .any(|&count| MAX_PIECES <= count)
    };

    let size = size_or_one(mesh);
    let mut edge = size * REFINE_FRACTION;
    while edge < size && is_too_much(edge) {
        edge *= 2.0;
    }
    edge
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::tests::mesh_of;

    #[test]
    fn a_mesh_of_needles_is_refined_less() {
        let needle = |n: u32| {
            let angle = f64::from(n) * 1e-4;
            [
                [0.0; 3],
                [angle.cos(), angle.sin(), 0.0],
                [(angle + 1e-4).cos(), (angle + 1e-4).sin(), 0.0],
            ]
        };
        let needles: Vec<[Point; 3]> = (0..4000).map(needle).collect();
        let n_pieces = Pieces::of(&mesh_of(&needles)).fine.triangles.len();
        assert!(
            8000 < n_pieces && n_pieces < MAX_PIECES as usize,
            "{n_pieces}"
        );
    }

    #[test]
    fn each_piece_is_found_at_its_centroid() {
        let pieces = Pieces::of(&mesh_of(&[
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        ]));
        let n_pieces = pieces.fine.triangles.len();
        assert_eq!(pieces.first_piece[2], n_pieces);
        let rule = PieceLabels {
            labels: (0..).take(n_pieces).collect(),
            pieces,
        };
        for triangle in 0..2 {
            let [first, end] = [triangle, triangle + 1].map(|at| rule.pieces.first_piece[at]);
            for piece in first..end {
                let [a, b, c] = rule.pieces.fine.corners(piece);
                let centroid = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
                assert_eq!(rule.label(triangle as u32, centroid), piece as i32);
            }
        }
        assert_eq!(rule.label(2, [0.0; 3]), IGNORE);
    }
}
