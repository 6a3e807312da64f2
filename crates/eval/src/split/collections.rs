//! Groups shapes by their collection: the file or the repository from which they came.

use super::SplitCandidate;
use crate::KBin;
use std::collections::BTreeMap;

/// A number of shapes per K bin.
pub(super) type CountOfBin = [f64; KBin::ALL.len()];

/// The shapes of one collection. They stay on one side of a split.
#[derive(Clone, Debug)]
pub(super) struct Collection<'a> {
    /// Its shapes, in the order of their ids.
    pub(super) shapes: Vec<&'a SplitCandidate>,
}

impl Collection<'_> {
    /// The number of its shapes in each K bin.
    pub(super) fn count_of_bin(&self) -> CountOfBin {
        count_of_bin(&self.shapes)
    }
}

/// The number of shapes in each K bin.
pub(super) fn count_of_bin(shapes: &[&SplitCandidate]) -> CountOfBin {
    let mut counts = CountOfBin::default();
    for shape in shapes {
        counts[KBin::of(shape.n_parts) as usize] += 1.0;
    }
    counts
}

/// The collections of these shapes, in the order of their first ids.
pub(super) fn collections<'a>(sorted: &[&'a SplitCandidate]) -> Vec<Collection<'a>> {
    let mut position_of: BTreeMap<&str, usize> = BTreeMap::new();
    let mut collections: Vec<Collection<'a>> = Vec::new();
    for &shape in sorted {
        let next = collections.len();
        let position = *position_of.entry(&shape.collection).or_insert(next);
        if position == next {
            collections.push(Collection { shapes: Vec::new() });
        }
        collections[position].shapes.push(shape);
    }
    collections
}
