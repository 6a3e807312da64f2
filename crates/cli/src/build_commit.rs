//! Names the commit that the program was built from.

/// The commit, if whoever built the program said so. (That of the folder in which it runs may be of any project, and would make
/// the results depend on the folder.)
pub(crate) const COMMIT: Option<&str> = option_env!("PARTPROBE_COMMIT");
