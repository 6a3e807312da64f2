//! Merges random neighbors of STEP-Parts: `step-merged-<K>` and `step-merged-share-<PERCENT>`.
//!
//! Every boundary that remains is a true one, but some true boundaries are missing.

use crate::degraded::{shuffle, step_parts};
use crate::factory::SourceFactory;
use crate::source::SourceLabels;
use partprobe_carrier::{Carrier, FaceGraph, Partition, Rng, ShapeKind, keyed_rng};

/// The parts of a smaller K are unions of those of a larger one.
pub(crate) const STEP_MERGED: SourceFactory = SourceFactory::numbered_rule(
    "step-merged-<K>",
    "step-parts with random neighbors merged, at most K labels",
    1..=1000,
    |carrier, n_max, seed| Ok(merged_to(carrier, n_max, seed)),
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// The same with a fraction instead of a number, so that shapes with many and with few parts have the same dose. 0 keeps all
/// parts, and 100 keeps one.
///
/// With n parts, PERCENT of the n - 1 possible merges are done, rounded to the nearest number.
pub(crate) const STEP_MERGED_SHARE: SourceFactory = SourceFactory::numbered_rule(
    "step-merged-share-<PERCENT>",
    "step-parts with random neighbors merged, PERCENT of all possible merges",
    0..=100,
    |carrier, percent, seed| {
        let parts = step_parts(carrier);
        let n_left = n_left(parts.n_parts(), percent);
        let merged = merged_parts(carrier, &parts, n_left, seed);
        Ok(SourceLabels::on_partition(carrier.mesh(), &merged))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// The STEP-Parts after neighbors were merged until at most `n_max` are left.
pub(crate) fn merged_to(carrier: &Carrier, n_max: u32, seed: u64) -> SourceLabels {
    let parts = step_parts(carrier);
    let merged = merged_parts(carrier, &parts, n_max, seed);
    SourceLabels::on_partition(carrier.mesh(), &merged)
}

/// The number of parts after a fraction of the possible merges.
fn n_left(n_parts: u32, percent: u32) -> u32 {
    let possible = u64::from(n_parts.saturating_sub(1));
    let n_merges = (possible * u64::from(percent) + 50) / 100;
    n_parts - n_merges as u32
}

/// Both sources merge in the same order, so equal numbers of parts give equal parts.
fn merged_parts(carrier: &Carrier, parts: &Partition, n_max: u32, seed: u64) -> Partition {
    let mut rng = keyed_rng(seed, &["step-merged", &carrier.meta().id]);
    merged(carrier.graph(), parts, n_max, &mut rng)
}

/// Joins neighbors in a random order. Parts without a common edge are joined after all neighbors.
fn merged(graph: &FaceGraph, parts: &Partition, n_max: u32, rng: &mut Rng) -> Partition {
    let mut neighbors: Vec<[u32; 2]> = graph
        .boundary_lengths(parts.parts())
        .iter()
        .map(|&(a, b, _)| [a, b])
        .collect();
    shuffle(&mut neighbors, rng);
    let mut all: Vec<u32> = (0..parts.n_parts()).collect();
    shuffle(&mut all, rng);
    neighbors.extend(all.windows(2).map(|pair| [pair[0], pair[1]]));

    let mut group: Vec<u32> = (0..parts.n_parts()).collect();
    let mut n_groups = parts.n_parts();
    for pair in neighbors {
        if n_groups <= n_max {
            break;
        }
        let [a, b] = pair.map(|part| root(&mut group, part));
        if a != b {
            group[a.max(b) as usize] = a.min(b);
            n_groups -= 1;
        }
    }

    let keys: Vec<u32> = parts
        .parts()
        .iter()
        .map(|&part| root(&mut group, part))
        .collect();
    Partition::from_keys(&keys)
}

/// The lowest part of the group. The search halves the path.
fn root(group: &mut [u32], mut part: u32) -> u32 {
    while group[part as usize] != part {
        let next = group[group[part as usize] as usize];
        group[part as usize] = next;
        part = next;
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registry::tests::plain_face;
    use partprobe_carrier::Edge;

    /// A chain of faces, and one separate face.
    #[track_caller]
    fn check(n_max: u32, n_expected: u32) {
        let edge = |n: u32| Edge {
            faces: [n, n + 1],
            phi: 90.0,
            length: 1.0,
        };
        let graph = FaceGraph {
            faces: vec![plain_face(); 7],
            edges: (0..5).map(edge).collect(),
        };
        let parts = Partition::from_joined_pairs(7, []);

        for seed in 0..20 {
            let found = merged(&graph, &parts, n_max, &mut keyed_rng(seed, &["test"]));
            assert_eq!(found.n_parts(), n_expected);
            if n_max >= 2 {
                // The face without neighbors is not merged as long as others can be merged.
                assert_eq!(
                    found
                        .parts()
                        .iter()
                        .filter(|&&part| part == found.parts()[6])
                        .count(),
                    1
                );
            }
            // Parts are numbered by their lowest face: along the chain, numbers fall only if a part has a gap.
            assert!(found.parts()[..6].is_sorted(), "{:?}", found.parts());
        }
    }

    #[test]
    fn a_share_leaves_between_all_parts_and_one() {
        let check = |n_parts: u32, percent: u32, expected: u32| {
            assert_eq!(n_left(n_parts, percent), expected, "{n_parts} at {percent}");
        };
        check(0, 50, 0);
        check(1, 100, 1);
        check(11, 0, 11);
        check(11, 25, 8);
        check(11, 50, 6);
        check(11, 100, 1);
    }

    #[test]
    fn neighbors_are_merged_before_others() {
        check(1000, 7);
        check(7, 7);
        check(6, 6);
        check(2, 2);
        check(1, 1);
    }
}
