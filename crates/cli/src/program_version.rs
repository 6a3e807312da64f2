//! Says which program this is: its version, and the commit that it was built from.

use std::sync::LazyLock;

/// The commit that the program was built from, if whoever built it said so in `PARTPROBE_COMMIT`. (The commit of the folder in which it
/// runs may be of any project.)
pub(crate) const COMMIT: Option<&str> = option_env!("PARTPROBE_COMMIT");

/// The version with the commit, as `--version` prints it.
pub(crate) static VERSION: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    match COMMIT {
        Some(commit) => format!("{version} (commit {commit})"),
        None => version.to_owned(),
    }
});
