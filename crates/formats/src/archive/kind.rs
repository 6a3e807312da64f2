//! Recognizes archives by their names.

use crate::archive::step_name::without_ending;

/// A kind of archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArchiveKind {
    /// `.zip`.
    Zip,
    /// `.tar`.
    Tar,
    /// `.tar.gz`, `.tgz`.
    TarGz,
    /// `.tar.zst`, `.tzst`.
    TarZst,
    /// `.tar.xz`, `.txz`.
    TarXz,
    /// `.7z`.
    SevenZip,
}

const ENDINGS: [(&str, ArchiveKind); 9] = [
    (".zip", ArchiveKind::Zip),
    (".tar", ArchiveKind::Tar),
    (".tar.gz", ArchiveKind::TarGz),
    (".tgz", ArchiveKind::TarGz),
    (".tar.zst", ArchiveKind::TarZst),
    (".tzst", ArchiveKind::TarZst),
    (".tar.xz", ArchiveKind::TarXz),
    (".txz", ArchiveKind::TarXz),
    (".7z", ArchiveKind::SevenZip),
];

impl ArchiveKind {
    /// The kind of archive by the ending of a file name in upper or lower case, and the name without that ending.
    #[must_use]
    pub fn of_name(name: &str) -> Option<(Self, &str)> {
        ENDINGS
            .iter()
            .find_map(|&(ending, kind)| Some((kind, without_ending(name, ending)?)))
    }

    /// The most common ending of this kind, with its dot.
    #[must_use]
    pub fn ending(self) -> &'static str {
        let of_kind = ENDINGS.iter().find(|(_, kind)| *kind == self);
        of_kind.map_or("", |(ending, _)| ending)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_decide_the_kind() {
        assert_eq!(
            ArchiveKind::of_name("abc_0000.7z"),
            Some((ArchiveKind::SevenZip, "abc_0000"))
        );
        assert_eq!(
            ArchiveKind::of_name("a.txz"),
            Some((ArchiveKind::TarXz, "a"))
        );
        assert_eq!(
            ArchiveKind::of_name("a.b.TAR.gz"),
            Some((ArchiveKind::TarGz, "a.b"))
        );
        for name in ["a.step", "zip", ".zip", "a.gz", "ä"] {
            assert_eq!(ArchiveKind::of_name(name), None, "{name}");
        }
    }
}
