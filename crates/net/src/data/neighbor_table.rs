//! Finds the tokens around each token: the table of a submanifold convolution.
//!
//! Several tokens may share a cell, one per dominant axis of the normals. At each offset, the neighbor of a token is the one with
//! the same axis, or else the one with the lowest index. At offset zero it is always the token itself.

use crate::data::curve::Cell;

/// For each token and each cell of the cube of side 2r + 1 around it: the token in this cell, or `n` if the cell is empty.
///
/// In the order of the offsets, z varies fastest. Cost: `O(n r² log n)`.
///
/// # Shapes
/// - cells and axes: `[token]`
/// - output: `[token, (2r + 1)³]`
pub(crate) fn neighbor_table(cells: &[Cell], axes: &[u8], radius: u32) -> Vec<u32> {
    let empty = cells.len() as u32;
    let side = 2 * radius as usize + 1;
    let index = CellIndex::new(cells, axes);
    let mut table = vec![empty; cells.len() * side.pow(3)];
    for (token, (cell, &axis)) in cells.iter().zip(axes).enumerate() {
        let around = &mut table[token * side.pow(3)..][..side.pow(3)];
        for (column, slots) in around.chunks_exact_mut(side).enumerate() {
            let (dx, dy) = (
                (column / side) as i64 - i64::from(radius),
                (column % side) as i64 - i64::from(radius),
            );
            index.fill_column(*cell, [dx, dy], axis, slots);
        }
    }
    table
}

/// The tokens sorted by cell, so a column of cells along z is consecutive.
struct CellIndex {
    /// Cell as one number, axis, token.
    entries: Vec<(u64, u8, u32)>,
}

impl CellIndex {
    fn new(cells: &[Cell], axes: &[u8]) -> Self {
        let mut entries: Vec<(u64, u8, u32)> = (0..)
            .zip(cells.iter().zip(axes))
            .map(|(token, (cell, &axis))| (packed(cell.map(i64::from)), axis, token))
            .collect();
        entries.sort_unstable();
        Self { entries }
    }

    /// Enters the tokens of the cells whose x and y differ from `cell`'s by `offset`, for z in the range of `slots`.
    fn fill_column(&self, cell: Cell, [dx, dy]: [i64; 2], axis: u8, slots: &mut [u32]) {
        let [x, y, z] = cell.map(i64::from);
        let (x, y, lowest) = (x + dx, y + dy, z - slots.len() as i64 / 2);
        if x < 0 || y < 0 {
            return;
        }
        let first = packed([x, y, lowest.max(0)]);
        let last = packed([x, y, lowest + slots.len() as i64 - 1]);
        let start = self.entries.partition_point(|entry| entry.0 < first);
        let mut filled = u64::MAX;
        for &(key, entry_axis, token) in self.entries[start..]
            .iter()
            .take_while(|entry| entry.0 <= last)
        {
            if key != filled || entry_axis == axis {
                slots[((key - first) as i64 + lowest.max(0) - lowest) as usize] = token;
                filled = key;
            }
        }
    }
}

/// A cell as one number, with z in the lowest bits. Each coordinate has 20 bits, so no sum of offsets overflows.
fn packed([x, y, z]: [i64; 3]) -> u64 {
    (x as u64) << 40 | (y as u64) << 20 | z as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The table by its definition, one cell at a time.
    fn by_definition(cells: &[Cell], axes: &[u8], radius: i64) -> Vec<u32> {
        let around = -radius..=radius;
        let mut table = Vec::new();
        for (cell, axis) in cells.iter().zip(axes) {
            for dx in around.clone() {
                for dy in around.clone() {
                    for dz in around.clone() {
                        let wanted = [
                            i64::from(cell[0]) + dx,
                            i64::from(cell[1]) + dy,
                            i64::from(cell[2]) + dz,
                        ];
                        let here: Vec<usize> = (0..cells.len())
                            .filter(|&t| cells[t].map(i64::from) == wanted)
                            .collect();
                        let own = here.iter().copied().find(|&t| axes[t] == *axis);
                        table.push(own.or(here.first().copied()).unwrap_or(cells.len()) as u32);
                    }
                }
            }
        }
        table
    }

    proptest! {
        #[test]
        fn the_table_follows_its_definition(
            mut voxels in prop::collection::vec((prop::array::uniform3(0u32..4), 0u8..6), 1..40),
            radius in 1u32..3,
        ) {
            voxels.sort_unstable();
            voxels.dedup();
            let (cells, axes): (Vec<Cell>, Vec<u8>) = voxels.into_iter().unzip();
            let table = neighbor_table(&cells, &axes, radius);
            prop_assert_eq!(&table, &by_definition(&cells, &axes, i64::from(radius)));
            let (n, volume) = (cells.len(), table.len() / cells.len());
            prop_assert!((0..n).all(|token| table[token * volume + volume / 2] == token as u32));
        }
    }
}
