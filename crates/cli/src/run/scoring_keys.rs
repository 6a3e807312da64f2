//! Tells the keys of a config that say how backbones are scored from those that decided how they were trained.

/// The keys that say how backbones are scored, and not how they were trained; `compare.` stands for all of its keys.
/// Labels that come from files are told apart by their own hashes, in `split.json`.
const SCORING_KEYS: [&str; 8] = [
    "compare.",
    "endpoints",
    "eval.",
    "expect.",
    // Training never sees this layer.
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
