//! Indexes the references of a file in both directions, without recursion.

use crate::part21::{Exchange, references_in};
use std::collections::BTreeSet;

/// The references of a file, by the positions of their instances in it.
pub(super) struct References {
    /// `(from, to)`, sorted.
    there: Vec<(u32, u32)>,
    /// `(to, from)`, sorted.
    back: Vec<(u32, u32)>,
}

impl References {
    /// Reads every instance once.
    pub(super) fn of(exchange: &Exchange<'_>) -> Self {
        let mut there = Vec::new();
        for (from, &record) in (0..).zip(exchange.records()) {
            let to = references_in(exchange.written(record)).filter_map(|id| exchange.slot(id));
            there.extend(to.map(|to| (from, to as u32)));
        }
        there.sort_unstable();
        there.dedup();
        let mut back: Vec<(u32, u32)> = there.iter().map(|&(from, to)| (to, from)).collect();
        back.sort_unstable();
        Self { there, back }
    }

    /// The instances to which an instance refers.
    pub(super) fn from(&self, slot: usize) -> impl Iterator<Item = usize> + '_ {
        group(&self.there, slot)
    }

    /// The instances that refer to an instance.
    pub(super) fn users(&self, slot: usize) -> impl Iterator<Item = usize> + '_ {
        group(&self.back, slot)
    }

    /// The given instances and all instances to which they refer directly or indirectly, in ascending order.
    pub(super) fn closure(&self, starts: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut open: Vec<usize> = starts.into_iter().collect();
        let mut met: BTreeSet<usize> = open.iter().copied().collect();
        while let Some(slot) = open.pop() {
            open.extend(self.from(slot).filter(|&next| met.insert(next)));
        }
        met.into_iter().collect()
    }

    /// The direct and indirect users of an instance, nearest first, and in ascending order at the same distance. The search does
    /// not continue beyond a user for which `stops` returns true. Such a user is included, but the instance itself is not.
    pub(super) fn all_users(&self, slot: usize, stops: impl Fn(usize) -> bool) -> Vec<usize> {
        let mut met = BTreeSet::from([slot]);
        let mut found = Vec::new();
        let mut level = vec![slot];
        while !level.is_empty() {
            let users = level
                .iter()
                .flat_map(|&slot| self.users(slot))
                .filter(|&user| met.insert(user));
            let mut next: Vec<usize> = users.collect();
            next.sort_unstable();
            found.extend_from_slice(&next);
            next.retain(|&user| !stops(user));
            level = next;
        }
        found
    }
}

/// The second members of the pairs that begin with `first`.
fn group(pairs: &[(u32, u32)], first: usize) -> impl Iterator<Item = usize> + '_ {
    let begin = pairs.partition_point(|pair| (pair.0 as usize) < first);
    pairs[begin..]
        .iter()
        .take_while(move |pair| pair.0 as usize == first)
        .map(|pair| pair.1 as usize)
}
