//! Groups shapes that are related: equal types and edge count, the same file, or the same product.

use super::SplitCandidate;
use partprobe_carrier::Partition;
use std::collections::BTreeMap;

/// The groups of related shapes, in the order of their first ids.
pub(super) fn related_groups<'a>(kept: &[&'a SplitCandidate]) -> Vec<Vec<&'a SplitCandidate>> {
    let partition = Partition::from_joined_pairs(kept.len(), ties(kept));
    let mut groups = vec![Vec::new(); partition.n_parts() as usize];
    for (shape, &group) in kept.iter().zip(partition.parts()) {
        groups[group as usize].push(*shape);
    }
    groups
}

/// Pairs of related shapes: each shape with the first one that has the same family, file or product.
fn ties(kept: &[&SplitCandidate]) -> Vec<[u32; 2]> {
    let mut first_with = [BTreeMap::new(), BTreeMap::new(), BTreeMap::new()];
    let mut ties = Vec::new();
    for (index, shape) in (0u32..).zip(kept) {
        let signature = &shape.signature;
        let family = signature
            .relates_family()
            .then(|| format!("{:?}", signature.family()));
        let keys = [
            family,
            Some(shape.source_file.clone()),
            shape.product.clone(),
        ];
        for (first_with, key) in first_with.iter_mut().zip(keys) {
            if let Some(key) = key {
                let first = *first_with.entry(key).or_insert(index);
                ties.push([first, index]);
            }
        }
    }
    ties
}
