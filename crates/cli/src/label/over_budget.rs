//! Defines the error of a file that needs more than the settings allow.

/// The file needs more than the settings allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct OverBudget(pub(super) String);

impl std::fmt::Display for OverBudget {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for OverBudget {}

/// The reason for a file that needs more memory than its worker has.
pub(super) const OVER_MEMORY: &str = "the file needs more memory than label.memory_mb allows";

/// The message for a file with more text than the settings allow.
pub(super) fn too_large(max_bytes: u64) -> String {
    format!(
        "the file has more than {} MiB; raise label.max_file_mb to read it",
        max_bytes >> 20
    )
}
