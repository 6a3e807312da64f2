//! Defines which channels of an attention head a rotary encoding of positions rotates, by which axis, and with which frequency.
//!
//! The channels of a head are divided among the three axes. Those of an axis form pairs, and pair d of D is rotated by the
//! coordinate times `base`^(−d/D), as in LitePT (Yue et al., arXiv 2512.13689). A channel without a partner does not change.

/// The rotation of the channels of all heads by the position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RotaryAxes {
    pub(crate) n_heads: usize,
    /// Channels of a head.
    pub(crate) head_dim: usize,
    /// The ratio of the frequency of the first pair of an axis to that of a pair after the last one.
    pub(crate) base: f32,
}

/// Two channels of a head that are rotated together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    pub(crate) axis: usize,
    pub(crate) first: usize,
    pub(crate) second: usize,
    /// Radians per unit of the coordinate.
    pub(crate) frequency: f32,
}

impl RotaryAxes {
    /// Channels of all heads.
    pub(crate) fn width(self) -> usize {
        self.n_heads * self.head_dim
    }

    /// The pairs of a head. If the three axes cannot have equally many pairs, the first axes have one more.
    pub(crate) fn pairs(self) -> Vec<Pair> {
        let n_pairs = self.head_dim / 2;
        let mut pairs = Vec::with_capacity(n_pairs);
        for axis in 0..3 {
            let n_own = n_pairs / 3 + usize::from(axis < n_pairs % 3);
            let start = 2 * pairs.len();
            pairs.extend((0..n_own).map(|idx| Pair {
                axis,
                first: start + idx,
                second: start + n_own + idx,
                frequency: self.base.powf(-(idx as f32) / n_own as f32),
            }));
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_channel_with_a_partner_is_in_one_pair() {
        for head_dim in [1, 2, 6, 16, 18, 31] {
            let axes = RotaryAxes {
                n_heads: 2,
                head_dim,
                base: 100.0,
            };
            let mut channels: Vec<usize> = axes
                .pairs()
                .iter()
                .flat_map(|pair| [pair.first, pair.second])
                .collect();
            channels.sort_unstable();
            assert!(channels.iter().copied().eq(0..head_dim / 2 * 2));
        }
    }

    #[test]
    fn eighteen_channels_are_three_pairs_for_each_axis() {
        let axes = RotaryAxes {
            n_heads: 1,
            head_dim: 18,
            base: 100.0,
        };
        let pairs = axes.pairs();
        assert_eq!(
            pairs.iter().map(|pair| pair.axis).collect::<Vec<_>>(),
            [0, 0, 0, 1, 1, 1, 2, 2, 2]
        );
        assert_eq!((pairs[4].first, pairs[4].second), (7, 10));
        assert!((pairs[4].frequency - 0.215_443).abs() < 1e-6);
    }
}
