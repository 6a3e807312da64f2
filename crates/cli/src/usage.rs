//! Errors of the caller: what was asked for cannot be meant.

/// A mistake in the arguments or the config; the program ends with 2 instead of 1.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UsageError(pub String);

impl std::fmt::Display for UsageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for UsageError {}

/// Turns any error into one of the caller.
pub fn as_usage_error(error: anyhow::Error) -> anyhow::Error {
    UsageError(format!("{error:#}")).into()
}
