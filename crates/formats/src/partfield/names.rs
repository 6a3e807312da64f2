//! Chooses names that PartField's scripts do not change: without `.` and `_`, at which the scripts cut names.

use partprobe_carrier::sha256_hex;
use std::collections::BTreeMap;

/// Names that the inference script skips.
const SKIPPED_NAMES: [&str; 2] = ["car", "complex-car"];

/// Longer names are cut, so that `part_feat_<uid>_0_batch.npy` is a file name on any system.
const MAX_CHARS: usize = 120;

/// The number of hash digits that distinguish equal names.
const HASH_DIGITS: usize = 8;

/// The name of each shape in PartField's files, in the order of the ids.
///
/// A name consists of ASCII letters, digits and `-`. It is the id itself if that is possible. If two ids give the same name, in
/// upper or lower case, or the name is one that PartField skips, digits of the id's hash are appended. A name does not depend on
/// the order of the ids.
#[must_use]
pub fn partfield_names(ids: &[&str]) -> Vec<String> {
    let names: Vec<String> = ids.iter().map(|id| plain_name(id)).collect();
    let mut n_of_name: BTreeMap<String, usize> = BTreeMap::new();
    for name in &names {
        *n_of_name.entry(name.to_lowercase()).or_default() += 1;
    }

    let unique = |(name, id): (String, &&str)| {
        let lower = name.to_lowercase();
        let is_unique = n_of_name.get(&lower) == Some(&1);
        let is_kept = !lower.is_empty() && !SKIPPED_NAMES.contains(&lower.as_str());
        let is_whole = name.len() <= MAX_CHARS;
        if is_unique && is_kept && is_whole {
            return name;
        }
        let hash = sha256_hex(id.as_bytes());
        let start = &name[..name.len().min(MAX_CHARS)];
        format!("{start}-{}", &hash[..HASH_DIGITS])
    };
    names.into_iter().zip(ids).map(unique).collect()
}

/// The id with one `-` instead of each sequence of characters that a name cannot have.
fn plain_name(id: &str) -> String {
    let words = id.split(|c: char| !c.is_ascii_alphanumeric() && c != '-');
    words
        .filter(|word| !word.is_empty())
        .collect::<Vec<_>>()
        .join("-")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(ids: &[&str], expected: &[&str]) {
        assert_eq!(partfield_names(ids), expected);
    }

    #[test]
    fn names_are_ids_where_that_is_possible() {
        check(&["bolt", "M8-nut"], &["bolt", "M8-nut"]);
        check(&["fusion__a.v2_0__s3"], &["fusion-a-v2-0-s3"]);
    }

    #[test]
    fn digits_distinguish_equal_names_in_any_order() {
        let names = partfield_names(&["a_b", "A.b", "c"]);
        check(&["c", "A.b", "a_b"], &["c", &names[1], &names[0]]);
        assert!(names[0].starts_with("a-b-") && names[1].starts_with("A-b-"));
        assert_ne!(names[0].to_lowercase(), names[1].to_lowercase());
    }

    #[test]
    fn names_that_cannot_be_used_get_digits() {
        let long = "x".repeat(300);
        for id in ["car", "complex_car", "螺栓", long.as_str()] {
            let name = &partfield_names(&[id])[0];
            assert!(
                name.len() <= MAX_CHARS + 1 + HASH_DIGITS && name.len() > HASH_DIGITS,
                "{name}"
            );
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-'));
            assert!(!SKIPPED_NAMES.contains(&name.as_str()));
        }
    }
}
