//! Cuts a cube whose corners are inside or outside of a surface (Lorensen and Cline, "Marching cubes", 1987).
//!
//! The cases are computed and not listed. On each side of the cube, lines separate the inside corners from the outside corners.
//! If two opposite corners of a side are inside and the other two are not, each of the inside ones is cut off separately. Both
//! cubes at the side use the same rule, so the surface has no gaps. The lines of the six sides form loops, which are divided into
//! triangles.

/// The corners of the cube: bit 0 of the index is x, bit 1 is y, bit 2 is z.
pub(super) const CORNERS: usize = 8;

/// An edge of the cube: its lower corner and its axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) corner: u8,
    pub(super) axis: u8,
}

/// The corners of each side, counterclockwise seen from outside.
const SIDES: [[u8; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

/// The triangles of each of the 256 cases, as triples of edges. Bit i of the case says whether corner i is inside.
pub(super) struct Cases(Vec<Vec<[Edge; 3]>>);

impl Cases {
    pub(super) fn new() -> Self {
        Self(
            (0..1usize << CORNERS)
                .map(|case| triangles(case as u8))
                .collect(),
        )
    }

    pub(super) fn triangles(&self, case: u8) -> &[[Edge; 3]] {
        &self.0[usize::from(case)]
    }
}

/// The edge between two corners.
fn edge(a: u8, b: u8) -> Edge {
    Edge {
        corner: a.min(b),
        axis: (a ^ b).trailing_zeros() as u8,
    }
}

/// The lines on the sides, from edge to edge. Their direction is such that the normals of the triangles point to the outside of
/// the surface.
fn lines(case: u8) -> Vec<[Edge; 2]> {
    let is_inside = |corner: u8| case >> corner & 1 == 1;
    let mut lines = Vec::new();
    for side in SIDES {
        // In a walk around the side, these are an edge that enters the surface and the next edge that leaves it.
        let at = |i: usize| side[i % 4];
        for i in 0..4 {
            if is_inside(at(i)) || !is_inside(at(i + 1)) {
                continue;
            }
            let mut last = i + 1;
            while is_inside(at(last + 1)) {
                last += 1;
            }
            lines.push([edge(at(i), at(i + 1)), edge(at(last), at(last + 1))]);
        }
    }
    lines
}

/// Joins the lines to loops, and divides each loop into a fan.
fn triangles(case: u8) -> Vec<[Edge; 3]> {
    let mut lines = lines(case);
    let mut triangles = Vec::new();
    while let Some([first, mut end]) = lines.pop() {
        let mut corners = vec![first];
        while end != first {
            corners.push(end);
            let Some(next) = lines.iter().position(|line| line[0] == end) else {
                break;
            };
            end = lines.swap_remove(next)[1];
        }
        for pair in corners[1..].windows(2) {
            triangles.push([first, pair[0], pair[1]]);
        }
    }
    triangles
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cut_edge_is_used_and_no_other() {
        let cases = Cases::new();
        for case in 0..=255u8 {
            let mut used = [false; 64];
            for edge in cases.triangles(case).iter().flatten() {
                used[usize::from(edge.corner) * 8 + usize::from(edge.axis)] = true;
            }
            for corner in 0..8u8 {
                for axis in 0..3u8 {
                    let is_lower = corner >> axis & 1 == 0;
                    let is_cut =
                        is_lower && (case >> corner & 1) != (case >> (corner | 1 << axis) & 1);
                    assert_eq!(
                        used[usize::from(corner * 8 + axis)],
                        is_cut,
                        "{case} {corner} {axis}"
                    );
                }
            }
        }
    }

    #[test]
    fn one_corner_is_one_triangle_and_a_slab_is_two() {
        let cases = Cases::new();
        assert_eq!(cases.triangles(0).len() + cases.triangles(255).len(), 0);
        assert_eq!(cases.triangles(1).len(), 1);
        assert_eq!(cases.triangles(0b0000_1111).len(), 2);
        // Two opposite corners of a side are cut off separately.
        assert_eq!(cases.triangles(0b0000_1001).len(), 2);
    }
}
