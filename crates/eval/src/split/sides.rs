//! Distributes groups of shapes over the three sides.

use super::SplitCandidate;
use partprobe_carrier::keyed_rng;
use rand::Rng as _;

/// The index of a side: 0 train, 1 valid, 2 test.
pub(super) type Side = usize;

/// A group of related shapes.
type Group<'a> = Vec<&'a SplitCandidate>;

/// The side of each group, so that each side gets about as many shapes as its target.
pub(super) fn place_groups(
    mut groups: Vec<Group<'_>>,
    targets: [f64; 3],
    seed: u64,
) -> Vec<(Side, Group<'_>)> {
    shuffle(&mut groups, seed);
    sort_large_groups_first(&mut groups, targets);

    let n_groups = groups.len();
    let mut sides = Sides {
        targets,
        lacking: targets,
        is_empty: targets.map(|target| target > 0.0),
    };
    let mut placed = Vec::with_capacity(n_groups);
    for (index, group) in groups.into_iter().enumerate() {
        let Some(side) = sides.next_side(n_groups - index) else {
            break;
        };
        sides.lacking[side] -= group.len() as f64;
        sides.is_empty[side] = false;
        placed.push((side, group));
    }
    placed
}

/// Moves groups to the front that are larger than half the smallest side. A large group that came late would overfill
/// a side.
fn sort_large_groups_first(groups: &mut [Group<'_>], targets: [f64; 3]) {
    let smallest = targets
        .into_iter()
        .filter(|&target| target > 0.0)
        .fold(f64::INFINITY, f64::min);
    groups.sort_by_key(|group| {
        let is_large = 2.0 * group.len() as f64 > smallest.max(2.0);
        std::cmp::Reverse(if is_large { group.len() } else { 0 })
    });
}

/// The state of the distribution.
struct Sides {
    /// The number of shapes that each side should get.
    targets: [f64; 3],
    /// The number of shapes that each side still lacks; negative if it has too many.
    lacking: [f64; 3],
    /// Whether a side with a positive target has no group yet.
    is_empty: [bool; 3],
}

impl Sides {
    /// The side that lacks most, the first of equals; an empty side if there are no more groups left than empty sides.
    fn next_side(&self, n_groups_left: usize) -> Option<Side> {
        let n_empty = self.is_empty.iter().filter(|&&empty| empty).count();
        let must_fill = n_groups_left <= n_empty;
        let mut best: Option<Side> = None;
        for side in 0..3 {
            let may_take = self.targets[side] > 0.0 && (self.is_empty[side] || !must_fill);
            let lacks_more = best.is_none_or(|best| self.lacking[best] < self.lacking[side]);
            if may_take && lacks_more {
                best = Some(side);
            }
        }
        best
    }
}

/// Puts the groups in a random order that depends on the seed alone (Fisher and Yates).
fn shuffle<T>(groups: &mut [T], seed: u64) {
    let mut rng = keyed_rng(seed, &["split"]);
    for last in (1..groups.len()).rev() {
        let other = (u128::from(rng.next_u64()) * (last as u128 + 1)) >> 64;
        groups.swap(last, other as usize);
    }
}
