//! Counts reasons. Those that differ only in numbers are counted as one.

use std::collections::BTreeMap;

/// The number of times that each reason was given. Numbers in which the reasons of one line differ are shown as `…`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ReasonCounts<K> {
    of_form: BTreeMap<(K, String), CommonReason>,
}

impl<K> Default for ReasonCounts<K> {
    fn default() -> Self {
        Self {
            of_form: BTreeMap::new(),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct CommonReason {
    n: u64,
    /// The text that all the reasons have in common.
    reason: String,
    /// The source of the first of them.
    first: String,
}

/// A reason, its count, and its first source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ReasonCount<'a, K> {
    /// The kind by which the reasons are counted, in addition to their text.
    pub(crate) kind: K,
    /// The reason.
    pub(crate) reason: &'a str,
    /// The number of times that it was given.
    pub(crate) n: u64,
    /// The first source for which it was given.
    pub(crate) first: &'a str,
}

impl<K: Copy + Ord> ReasonCounts<K> {
    /// Counts a reason `n` times.
    pub(crate) fn add(&mut self, kind: K, reason: &str, n: u64, source: &str) {
        let new = || CommonReason {
            n: 0,
            reason: reason.to_owned(),
            first: source.to_owned(),
        };
        let counted = self
            .of_form
            .entry((kind, without_numbers(reason)))
            .or_insert_with(new);
        counted.n += n;
        if counted.reason != reason {
            counted.reason = common(&counted.reason, reason);
        }
    }

    /// The total number of given reasons.
    #[must_use]
    pub(crate) fn total(&self) -> u64 {
        self.of_form.values().map(|counted| counted.n).sum()
    }

    /// The reasons, beginning with the most frequent one.
    #[must_use]
    pub(crate) fn ranked(&self) -> Vec<ReasonCount<'_, K>> {
        let mut rows: Vec<_> = self.of_form.iter().collect();
        rows.sort_by_key(|&(form, counted)| (std::cmp::Reverse(counted.n), form));
        rows.into_iter()
            .map(
                |((kind, _), CommonReason { n, reason, first })| ReasonCount {
                    kind: *kind,
                    reason,
                    n: *n,
                    first,
                },
            )
            .collect()
    }
}

/// The reason with `…` instead of each number.
fn without_numbers(reason: &str) -> String {
    pieces(reason)
        .into_iter()
        .map(|piece| if is_number(piece) { "…" } else { piece })
        .collect()
}

/// The common text of two reasons of the same form. Numbers in which they differ become `…`.
fn common(a: &str, b: &str) -> String {
    pieces(a)
        .into_iter()
        .zip(pieces(b))
        .map(|(a, b)| if a == b { a } else { "…" })
        .collect()
}

/// A text that is divided into numbers and the parts between them. A `…` counts as a number.
fn pieces(text: &str) -> Vec<&str> {
    let is_digit = |c: char| c.is_ascii_digit() || c == '…';
    let mut pieces = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let is_in_number = is_digit(first);
        let end = rest
            .find(|c| is_digit(c) != is_in_number)
            .unwrap_or(rest.len());
        pieces.push(&rest[..end]);
        rest = &rest[end..];
    }
    pieces
}

fn is_number(piece: &str) -> bool {
    piece.starts_with(|c: char| c.is_ascii_digit() || c == '…')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(reasons: &[&str], expected: &[(&str, u64)]) {
        let mut counts = ReasonCounts::default();
        reasons
            .iter()
            .for_each(|reason| counts.add((), reason, 1, "a"));
        let found: Vec<(&str, u64)> = counts
            .ranked()
            .iter()
            .map(|row| (row.reason, row.n))
            .collect();
        assert_eq!(found, expected);
        assert_eq!(counts.total(), reasons.len() as u64);
    }

    #[test]
    fn only_numbers_that_differ_are_folded() {
        check(&["no ISO-10303-21"], &[("no ISO-10303-21", 1)]);
        check(&["no ISO-10303-21"; 3], &[("no ISO-10303-21", 3)]);
        check(
            &["#12 is empty, not 3", "#9 is empty, not 3", "b"],
            &[("#… is empty, not 3", 2), ("b", 1)],
        );
        check(&["1-2", "1-3", "4-2"], &[("…-…", 3)]);
    }
}
