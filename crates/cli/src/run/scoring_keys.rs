//! Tells the keys of a config that say how backbones are scored from those that decided how they were trained.

/// The keys that influence the scoring of backbones, and not their training. `compare.` means all of its keys. Labels from files are
/// distinguished by their own hashes, in `split.json`.
const SCORING_KEYS: [&str; 8] = [
    "compare.",
    "endpoints",
    "eval.",
    "expect.",
    // The training does not use this layer.
    "net.refine",
    "sources.",
    "tokens.test_poses",
    "tokens.test_tokens",
];

/// Whether a key says how backbones are scored, so that `eval` may change it.
pub(crate) fn is_scoring(key: &str) -> bool {
    SCORING_KEYS.iter().any(|scoring| key.starts_with(scoring))
        || key == "expect"
        || key == "sources"
}
