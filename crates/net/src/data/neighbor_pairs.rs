//! Converts a dense table of neighbors to the pairs of tokens at each offset of a convolution.
//!
//! The tokens are divided into short ranges, and the pairs of a range are sorted by offset into runs. So the rows that a run
//! reads and writes stay in the processor's cache.

/// Number of tokens of a range.
const STRETCH: usize = 512;

/// The occupied cells around all tokens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NeighborPairs {
    n_offsets: usize,
    /// The end of each run of pairs, range by range and offset by offset.
    ends: Vec<u32>,
    tokens: Vec<u32>,
    neighbors: Vec<u32>,
}

impl NeighborPairs {
    /// The pairs of a dense table. An entry for an empty cell is the number of tokens.
    ///
    /// # Shapes
    /// - table: `[token, n_offsets]`
    pub(crate) fn new(table: &[u32], n_offsets: usize) -> Self {
        let n = table.len() / n_offsets.max(1);
        let n_pairs = table.iter().filter(|&&entry| (entry as usize) < n).count();
        let mut pairs = Self {
            n_offsets,
            ends: Vec::with_capacity(n.div_ceil(STRETCH) * n_offsets),
            tokens: Vec::with_capacity(n_pairs),
            neighbors: Vec::with_capacity(n_pairs),
        };
        for (stretch, rows) in table.chunks(STRETCH * n_offsets.max(1)).enumerate() {
            for offset in 0..n_offsets {
                for (token, row) in (stretch * STRETCH..).zip(rows.chunks_exact(n_offsets)) {
                    if (row[offset] as usize) < n {
                        pairs.tokens.push(token as u32);
                        pairs.neighbors.push(row[offset]);
                    }
                }
                pairs.ends.push(pairs.tokens.len() as u32);
            }
        }
        pairs
    }

    /// The pairs of several shapes, each with its number of tokens. The tokens of the first shape come first.
    pub(crate) fn joined(shapes: &[(&Self, usize)]) -> Self {
        let n_offsets = shapes.first().map_or(0, |shape| shape.0.n_offsets);
        let mut joined = Self {
            n_offsets,
            ends: Vec::new(),
            tokens: Vec::new(),
            neighbors: Vec::new(),
        };
        let mut first = 0;
        for (pairs, n_tokens) in shapes {
            let n_before = joined.tokens.len() as u32;
            joined
                .ends
                .extend(pairs.ends.iter().map(|end| end + n_before));
            joined
                .tokens
                .extend(pairs.tokens.iter().map(|token| token + first));
            joined
                .neighbors
                .extend(pairs.neighbors.iter().map(|token| token + first));
            first += *n_tokens as u32;
        }
        joined
    }

    /// The number of cells around a token, including its own.
    pub(crate) fn n_offsets(&self) -> usize {
        self.n_offsets
    }

    /// The dense table from which the pairs were made.
    ///
    /// # Shapes
    /// - output: `[token, n_offsets]`
    pub(crate) fn to_table(&self, n_tokens: usize) -> Vec<u32> {
        let mut table = vec![n_tokens as u32; n_tokens * self.n_offsets];
        for (offset, tokens, neighbors) in self.runs() {
            for (&token, &neighbor) in tokens.iter().zip(neighbors) {
                table[token as usize * self.n_offsets + offset] = neighbor;
            }
        }
        table
    }

    /// The offset of each run, its tokens, and the neighbor of each of them. No token occurs twice in a run.
    #[inline(always)]
    pub(crate) fn runs(&self) -> impl Iterator<Item = (usize, &[u32], &[u32])> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).enumerate().map(
            #[inline(always)]
            |(run, (start, &end))| {
                let range = start as usize..end as usize;
                (
                    run % self.n_offsets,
                    &self.tokens[range.clone()],
                    &self.neighbors[range],
                )
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_occupied_cell_is_one_pair_of_its_offset() {
        let (n, n_offsets) = (1300, 5);
        let table: Vec<u32> = (0..n * n_offsets)
            .map(|slot| (slot * 37 % (n + 400)).min(n) as u32)
            .collect();
        let pairs = NeighborPairs::new(&table, n_offsets);
        assert_eq!(pairs.to_table(n), table);
        assert_eq!(
            pairs.tokens.len(),
            table.iter().filter(|&&entry| entry < n as u32).count()
        );
    }

    #[test]
    fn shapes_one_behind_the_other_keep_their_pairs() {
        let table = |n: u32| {
            (0..n * 3)
                .map(|slot| (slot * 5 % (n + 2)).min(n))
                .collect::<Vec<u32>>()
        };
        let (small, large) = (
            NeighborPairs::new(&table(4), 3),
            NeighborPairs::new(&table(700), 3),
        );
        let joined = NeighborPairs::joined(&[(&small, 4), (&large, 700)]).to_table(704);
        let of_small = table(4)
            .into_iter()
            .map(|token| if token == 4 { 704 } else { token });
        let of_large = table(700).into_iter().map(|token| token + 4);
        assert_eq!(joined, of_small.chain(of_large).collect::<Vec<_>>());
    }

    #[test]
    fn no_tokens_have_no_pairs() {
        assert_eq!(NeighborPairs::new(&[], 27).runs().count(), 0);
    }
}
