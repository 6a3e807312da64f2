//! Names members such that their paths are inside the folder of the archive, even if a name in the archive leads outside.

use super::{ArchiveKind, Refusal};

/// The relative path of a member: plain names, none of which leads out of the folder.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MemberName(Vec<String>);

impl MemberName {
    /// The name of a member from the name in its archive. Components `.` are left out.
    pub(super) fn of(given: &str) -> Result<Self, Refusal> {
        if given.chars().any(char::is_control) {
            return Err(Refusal::UnsafeName("holds control characters"));
        }
        if given.contains('\\') {
            return Err(Refusal::UnsafeName("holds a backslash"));
        }
        if given.starts_with('/') || is_drive(given) {
            return Err(Refusal::UnsafeName("is absolute"));
        }
        let components: Vec<&str> = given
            .split('/')
            .filter(|part| !part.is_empty() && *part != ".")
            .collect();
        if components.contains(&"..") {
            return Err(Refusal::UnsafeName("leads out of the archive"));
        }
        let Some(last) = components.last() else {
            return Err(Refusal::UnsafeName("is empty"));
        };
        if ArchiveKind::of_name(last).is_some() {
            return Err(Refusal::Nested);
        }
        Ok(Self(components.into_iter().map(str::to_owned).collect()))
    }

    /// Folders and file name, in this order. There is at least one component.
    #[must_use]
    pub fn components(&self) -> &[String] {
        &self.0
    }
}

/// Whether a name is a drive such as `C:`.
fn is_drive(name: &str) -> bool {
    matches!(name.as_bytes(), [letter, b':', ..] if letter.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(given: &str, expected: Result<&str, &str>) {
        let name = MemberName::of(given).map(|name| name.components().join("/"));
        assert_eq!(
            name.as_deref().map_err(ToString::to_string),
            expected.map_err(str::to_owned),
            "{given}"
        );
    }

    #[test]
    fn names_stay_below_the_archive() {
        check("a/b.step", Ok("a/b.step"));
        check("./a//b..step", Ok("a/b..step"));
        let refused =
            |what: &str| format!("the name {what}; pack the files again with relative names");
        check("../a.step", Err(&refused("leads out of the archive")));
        check("a/../../b.step", Err(&refused("leads out of the archive")));
        check("/etc/a.step", Err(&refused("is absolute")));
        check("C:/a.step", Err(&refused("is absolute")));
        check("a\\b.step", Err(&refused("holds a backslash")));
        check("a\0.step", Err(&refused("holds control characters")));
        check("./", Err(&refused("is empty")));
        check(
            "in/side.7z",
            Err("it is an archive inside an archive; unpack the outer one first"),
        );
    }
}
