//! Gives the version of the program, and the commit from which it was built.

use std::sync::LazyLock;

/// The commit from which the program was built, if the build script knows it. (The commit of the folder in which it runs may belong
/// to any project.)
pub(crate) const COMMIT: Option<&str> = option_env!("PARTPROBE_COMMIT");

/// The commit as the footers of tables name it. A program without one names its version.
pub(crate) fn commit_or_version() -> String {
    COMMIT.map_or_else(
        || format!("unknown (version {})", env!("CARGO_PKG_VERSION")),
        str::to_owned,
    )
}

/// The version with the commit, which `--version` prints.
pub(crate) static VERSION: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    match COMMIT {
        Some(commit) => format!("{version} (commit {commit})"),
        None => version.to_owned(),
    }
});
