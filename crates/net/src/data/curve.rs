//! Computes space-filling curves on the integer grid: the index of a cell along the Morton and the Hilbert curve.
//!
//! Both curves are hierarchical: `code >> 3` is the code of the cell of twice the size that holds the cell.

use serde::{Deserialize, Serialize};

/// The number of bits of a coordinate in a code. A grid has at most 2^16 cells per side.
pub(crate) const MAX_DEPTH: u32 = 16;

/// A cell of the integer grid.
pub(crate) type Cell = [u32; 3];

/// The ways to serialize a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Curve {
    /// Morton order, x in the highest bit of each triplet.
    Z,
    /// Morton order after x and y are exchanged.
    ZTrans,
    /// Hilbert order.
    Hilbert,
    /// Hilbert order after x and y are exchanged.
    HilbertTrans,
}

impl Curve {
    /// Every curve, in PTv3's order.
    pub const ALL: [Self; 4] = [Self::Z, Self::ZTrans, Self::Hilbert, Self::HilbertTrans];

    /// The name that a config file and Pointcept use.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Z => "z",
            Self::ZTrans => "z-trans",
            Self::Hilbert => "hilbert",
            Self::HilbertTrans => "hilbert-trans",
        }
    }

    /// The index of `cell` along the curve through a grid of 2^`depth` cells per side.
    pub(crate) fn code(self, [x, y, z]: Cell, depth: u32) -> u64 {
        match self {
            Self::Z => interleave([x, y, z]),
            Self::ZTrans => interleave([y, x, z]),
            Self::Hilbert => hilbert([x, y, z], depth),
            Self::HilbertTrans => hilbert([y, x, z], depth),
        }
    }
}

/// The number of bits that the largest of these coordinates needs, at least 1.
pub(crate) fn depth_of(cells: &[Cell]) -> u32 {
    let highest = cells.iter().flatten().max().copied().unwrap_or(0);
    (u32::BITS - highest.leading_zeros()).max(1)
}

/// Interleaves the bits of three coordinates, x first.
fn interleave(cell: Cell) -> u64 {
    (0..MAX_DEPTH).rev().fold(0, |code, bit| {
        let [x, y, z] = cell.map(|coordinate| u64::from(coordinate >> bit & 1));
        code << 3 | x << 2 | y << 1 | z
    })
}

/// Undoes the rotations and reflections of each level from the top, then the Gray code.
///
/// J. Skilling, "Programming the Hilbert curve", AIP Conference Proceedings 707, 2004.
fn hilbert(mut cell: Cell, depth: u32) -> u64 {
    for bit in (1..depth).rev() {
        let (side, below) = (1 << bit, (1 << bit) - 1);
        for axis in 0..3 {
            if cell[axis] & side != 0 {
                cell[0] ^= below;
            } else {
                let swapped = (cell[0] ^ cell[axis]) & below;
                cell[0] ^= swapped;
                cell[axis] ^= swapped;
            }
        }
    }
    cell[1] ^= cell[0];
    cell[2] ^= cell[1];
    let flips = (1..depth)
        .filter(|bit| cell[2] >> bit & 1 != 0)
        .fold(0, |flips, bit| flips ^ ((1u32 << bit) - 1));
    interleave(cell.map(|coordinate| coordinate ^ flips))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(side: u32) -> impl Iterator<Item = Cell> {
        (0..side).flat_map(move |x| (0..side).flat_map(move |y| (0..side).map(move |z| [x, y, z])))
    }

    #[test]
    fn codes_of_a_cube_are_a_permutation() {
        for curve in Curve::ALL {
            let mut codes: Vec<u64> = cells(8).map(|cell| curve.code(cell, 3)).collect();
            codes.sort_unstable();
            assert_eq!(codes, (0..512).collect::<Vec<u64>>(), "{curve:?}");
        }
    }

    #[test]
    fn the_parent_of_a_cell_has_the_shifted_code() {
        for curve in Curve::ALL {
            for cell in cells(8) {
                let parents: Vec<u64> = cells(2)
                    .map(|[x, y, z]| [cell[0] & !1 | x, cell[1] & !1 | y, cell[2] & !1 | z])
                    .map(|sibling| curve.code(sibling, 3) >> 3)
                    .collect();
                assert!(
                    parents.iter().all(|&parent| parent == parents[0]),
                    "{curve:?} {cell:?}"
                );
            }
        }
    }

    #[test]
    fn the_hilbert_curve_walks_from_neighbor_to_neighbor() {
        let mut walk: Vec<(u64, Cell)> = cells(8)
            .map(|cell| (Curve::Hilbert.code(cell, 3), cell))
            .collect();
        walk.sort_unstable();
        for pair in walk.windows(2) {
            let steps: u32 = (0..3)
                .map(|axis| pair[0].1[axis].abs_diff(pair[1].1[axis]))
                .sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }

    #[test]
    fn morton_order_puts_x_highest_and_trans_exchanges_x_and_y() {
        assert_eq!(Curve::Z.code([1, 0, 0], 1), 4);
        assert_eq!(Curve::Z.code([0, 0, 3], 2), 9);
        assert_eq!(Curve::ZTrans.code([1, 0, 0], 1), 2);
        assert_eq!(depth_of(&[[0, 8, 1]]), 4);
        assert_eq!(depth_of(&[]), 1);
    }
}
