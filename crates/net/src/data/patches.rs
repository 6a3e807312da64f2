//! Divides tokens into the patches of serialized attention, as in PTv3 (Wu et al., CVPR 2024).

/// The tokens of a level along a curve, divided into runs of equal length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Patches {
    /// Number of tokens in a patch.
    pub(crate) size: usize,
    /// The tokens patch by patch: `[patch, size]`. The last patch is filled up with the last tokens of the previous patch.
    pub(crate) order: Vec<u32>,
    /// The index in `order` of each token's own entry, which is not a repetition: `[token]`.
    pub(crate) position: Vec<u32>,
}

impl Patches {
    /// The tokens of each patch, and those of them that are not repetitions. Only the last patch has repetitions.
    #[inline(always)]
    pub(crate) fn iter(&self) -> impl Iterator<Item = (&[u32], &[u32])> {
        let n = self.position.len();
        self.order.chunks_exact(self.size.max(1)).enumerate().map(
            #[inline(always)]
            move |(patch, tokens)| (tokens, &tokens[..self.size.min(n - patch * self.size)]),
        )
    }

    /// Divides a serialized level into patches of `size` tokens. If there are fewer tokens, they make one smaller patch.
    pub(crate) fn new(serialized: &[u32], size: usize) -> Self {
        let n = serialized.len();
        let size = size.min(n).max(1);
        let mut order = serialized.to_vec();
        // The padding of PTv3: the empty end of the last patch repeats the end of the previous patch.
        order.extend((n..n.div_ceil(size) * size).map(|idx| serialized[idx - size]));
        let mut position = vec![0; n];
        for (idx, &token) in (0..).zip(serialized) {
            position[token as usize] = idx;
        }
        Self {
            size,
            order,
            position,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_hold_each_token_once_as_itself_and_repeat_the_patch_before() {
        let serialized: Vec<u32> = (0..10).rev().collect();
        let patches = Patches::new(&serialized, 4);
        assert_eq!(patches.order, [9, 8, 7, 6, 5, 4, 3, 2, 1, 0, 3, 2]);
        assert_eq!(patches.position, [9, 8, 7, 6, 5, 4, 3, 2, 1, 0]);
        let short = Patches::new(&serialized, 128);
        assert_eq!((short.size, short.order.len()), (10, 10));
        assert_eq!(Patches::new(&serialized, 5).order.len(), 10);
    }
}
