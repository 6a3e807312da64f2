//! Groups faces, or other numbered items, into parts.
//!
//! Pairs that belong together or equal keys go in. The group of each item comes out. Groups are numbered in the order of their
//! lowest members.

/// The part to which each face belongs.
///
/// Invariant: part ids are 0..n_parts, in the order of each part's lowest face index.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Partition {
    parts: Vec<u32>,
    n_parts: u32,
}

impl Partition {
    /// Groups faces that are connected by a chain of the given pairs.
    #[must_use]
    pub fn from_joined_pairs(n_faces: usize, pairs: impl IntoIterator<Item = [u32; 2]>) -> Self {
        let mut roots: Vec<u32> = (0..).take(n_faces).collect();
        for [a, b] in pairs {
            let (a, b) = (find_root(&mut roots, a), find_root(&mut roots, b));
            roots[a.max(b) as usize] = a.min(b);
        }
        let keys: Vec<u32> = (0..)
            .take(n_faces)
            .map(|face| find_root(&mut roots, face))
            .collect();
        Self::from_keys(&keys)
    }

    /// Groups faces with equal keys. There is one key per face.
    #[must_use]
    pub fn from_keys<K: Ord>(keys: &[K]) -> Self {
        let mut ids = std::collections::BTreeMap::new();
        let mut parts = Vec::with_capacity(keys.len());
        for key in keys {
            let next = u32::try_from(ids.len()).unwrap_or(u32::MAX);
            parts.push(*ids.entry(key).or_insert(next));
        }
        let n_parts = u32::try_from(ids.len()).unwrap_or(u32::MAX);
        Self { parts, n_parts }
    }

    /// The part of each face.
    #[must_use]
    pub fn parts(&self) -> &[u32] {
        &self.parts
    }

    /// The number of parts.
    #[must_use]
    pub fn n_parts(&self) -> u32 {
        self.n_parts
    }
}

/// The representative of the face's group. The search halves the path (Tarjan and van Leeuwen, 1984).
fn find_root(roots: &mut [u32], mut face: u32) -> u32 {
    while roots[face as usize] != face {
        let grandparent = roots[roots[face as usize] as usize];
        roots[face as usize] = grandparent;
        face = grandparent;
    }
    face
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_order_of_pairs_does_not_matter(pairs in proptest::collection::vec((0u32..20, 0u32..20), 0..40)) {
            let forward = Partition::from_joined_pairs(20, pairs.iter().map(|&(a, b)| [a, b]));
            let backward = Partition::from_joined_pairs(20, pairs.iter().rev().map(|&(a, b)| [b, a]));
            prop_assert_eq!(&forward, &backward);
            for (a, b) in pairs {
                prop_assert_eq!(forward.parts()[a as usize], forward.parts()[b as usize]);
            }
        }
    }
}
