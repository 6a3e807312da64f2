//! Marks settings that the user gave by a special flag, so that a message about such a setting names the flag.

use std::fmt::Display;

/// Separates the assignment from the flag. Neither of them contains this character.
const MARK: char = '\u{1f}';

/// The override `assignment`, which the user wrote as `flag`.
pub(crate) fn by_flag(flag: &str, assignment: impl Display) -> String {
    format!("{assignment}{MARK}{flag}")
}

/// An override without its flag.
pub(super) fn without_flag(assignment: &str) -> &str {
    assignment
        .split_once(MARK)
        .map_or(assignment, |(assignment, _)| assignment)
}

/// The key of an override, such as `label.theta_deg`.
#[cfg(feature = "train")]
pub(crate) fn key_of(assignment: &str) -> &str {
    let assignment = without_flag(assignment);
    assignment
        .split_once('=')
        .map_or(assignment, |(key, _)| key)
        .trim()
}

/// Whether an override gives a value to a key, or to a key below it.
#[cfg(feature = "train")]
pub(crate) fn is_set(overrides: &[String], key: &str) -> bool {
    let names = |set: &String| {
        let rest = key_of(set).strip_prefix(key);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    overrides.iter().any(names)
}

/// An override as the user wrote it: the name of the flag, or `--set` with the assignment.
pub(crate) fn as_written(assignment: &str) -> String {
    match assignment.split_once(MARK) {
        Some((_, flag)) => flag.to_owned(),
        None => format!("--set {assignment}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_override_is_named_as_the_user_wrote_it() {
        let by_flag = by_flag("--layers", "label.layers=[]");
        assert_eq!(as_written(&by_flag), "--layers");
        assert_eq!(without_flag(&by_flag), "label.layers=[]");
        assert_eq!(as_written("a.b=1"), "--set a.b=1");
        assert_eq!(without_flag("a.b=1"), "a.b=1");
        #[cfg(feature = "train")]
        for (set, key) in [(by_flag.as_str(), "label.layers"), (" a.b = c=1", "a.b")] {
            assert_eq!(key_of(set), key);
        }
        #[cfg(feature = "train")]
        for (set, expected) in [("a.b=1", true), ("a.b.c=1", true), ("a.bc=1", false)] {
            assert_eq!(is_set(&[set.to_owned()], "a.b"), expected, "{set}");
        }
    }
}
