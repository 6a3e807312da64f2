//! Reads archives as streams of members: the bytes of an archive go in, and its files come out one after the other, in its order.
//!
//! Nothing is unpacked to disk, and nothing in an archive is trusted. Names that lead outside, links, encrypted members and
//! archives inside the archive are refused, each with its name. Declared sizes are not used before the bytes are read. After
//! damage, only the members that depend on the damaged bytes are lost.

mod container;
mod content;
mod kind;
mod member_name;
pub(crate) mod name_text;
mod packed_step;
mod seven_zip;
pub(crate) mod step_name;
mod tarball;
#[cfg(test)]
mod tests;
mod zip_file;
mod zstd_stream;

pub use container::Packing;
pub use content::{Content, ContentError};
pub use kind::ArchiveKind;
pub use member_name::MemberName;
pub use packed_step::{UnpackError, unpacked_step};
pub use zstd_stream::ZstdReader;

use container::{Container, decoded};
use std::io::{Read, Seek};
use std::ops::ControlFlow;

/// A file in an archive, while the archive is being read at this file.
#[derive(Debug)]
pub struct Member<'a> {
    /// Its position in the archive, counted from 0. Folders and refused members count.
    pub position: u64,
    /// The name in the archive. Bytes that are not UTF-8 are escaped by [`crate::text_of_name`].
    pub given_name: String,
    /// The usable name and the bytes, or the reason why the member is refused.
    pub content: Result<(MemberName, Content<'a>), Refusal>,
}

/// The reason why a member is not read, independent of its content.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The name could lead out of the folder of the archive.
    #[error("the name {0}; pack the files again with relative names")]
    UnsafeName(&'static str),
    /// A link, which names another file and has no bytes.
    #[error("it is a link; pack the file that it leads to")]
    Link,
    /// A device, a pipe, or a file with holes.
    #[error("it is not a plain file")]
    Special,
    /// The bytes need a password.
    #[error("it is encrypted; unpack the archive with its password first")]
    Encrypted,
    /// Archives are not opened inside archives.
    #[error("it is an archive inside an archive; unpack the outer one first")]
    Nested,
    /// Several members have the same name, so it is not known which one is meant.
    #[error("{0} members have this name, so it is not clear which one is meant")]
    Duplicate(usize),
    /// The member is after damage in its stream.
    #[error("it cannot be reached, since the archive is damaged before it")]
    BehindDamage,
}

/// The archive could not be read to its end. The members before the damage have been visited.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the archive is damaged, cut off or of an unknown kind: {problem}; {n_visited} members were reached"
)]
pub struct ArchiveDamage {
    /// A description of the damage.
    pub problem: String,
    /// The number of members before the damage.
    pub n_visited: u64,
}

/// The function that is called for each member.
pub type Visit<'v> = &'v mut dyn FnMut(Member<'_>) -> ControlFlow<()>;

/// Visits the members in the order of the archive, until the visitor breaks.
///
/// Memory does not grow with the size of the archive, except for the list of names if the archive has one.
///
/// # Errors
/// If the archive is damaged or cut off.
pub fn walk_archive(
    kind: ArchiveKind,
    source: impl Read + Seek,
    visit: Visit<'_>,
) -> Result<(), ArchiveDamage> {
    let mut walk = Walk {
        visit,
        n_visited: 0,
    };
    let walked = match kind {
        ArchiveKind::Zip => zip_file::walk(source, &mut walk),
        ArchiveKind::Tar => tarball::walk(source, &mut walk),
        ArchiveKind::TarGz => walk_packed_tar(Container::Gzip, source, &mut walk),
        ArchiveKind::TarZst => walk_packed_tar(Container::Zstd, source, &mut walk),
        ArchiveKind::TarXz => walk_packed_tar(Container::Xz, source, &mut walk),
        ArchiveKind::SevenZip => seven_zip::walk(source, &mut walk),
    };
    match walked {
        Ok(()) | Err(Stop::Broken) => Ok(()),
        Err(Stop::Damage(problem)) => Err(ArchiveDamage {
            problem,
            n_visited: walk.n_visited,
        }),
    }
}

fn walk_packed_tar(
    container: Container,
    source: impl Read,
    walk: &mut Walk<'_>,
) -> Result<(), Stop> {
    let unpacked = decoded(container, source).map_err(|error| Stop::Damage(error.to_string()))?;
    tarball::walk(unpacked, walk)
}

/// The names of the members. Returns `None` if the archive has no list of them, such as a tar archive.
pub fn listed_names(kind: ArchiveKind, source: impl Read + Seek) -> Option<Vec<String>> {
    match kind {
        ArchiveKind::Zip => zip_file::listed_names(source),
        ArchiveKind::SevenZip => seven_zip::listed_names(source),
        ArchiveKind::Tar | ArchiveKind::TarGz | ArchiveKind::TarZst | ArchiveKind::TarXz => None,
    }
}

/// The reason why a walk ends early.
enum Stop {
    /// The visitor has broken off.
    Broken,
    /// The archive is damaged.
    Damage(String),
}

/// A walk through an archive: the visitor and the current position.
struct Walk<'v> {
    visit: Visit<'v>,
    n_visited: u64,
}

impl Walk<'_> {
    /// Visits a member with these bytes, unless its name is refused.
    fn file(
        &mut self,
        given_name: String,
        bytes: &mut dyn Read,
        size: Option<u64>,
    ) -> Result<(), Stop> {
        let name = match MemberName::of(&given_name) {
            Ok(name) => name,
            Err(refusal) => return self.refused(given_name, refusal),
        };
        let mut damage = None;
        let content = Content::new(bytes, size, &mut damage);
        let ended = self.show(given_name, Ok((name, content)));
        match damage {
            Some(problem) => Err(Stop::Damage(problem)),
            None => ended,
        }
    }

    /// Visits a member that is refused.
    fn refused(&mut self, given_name: String, refusal: Refusal) -> Result<(), Stop> {
        self.show(given_name, Err(refusal))
    }

    /// Skips a folder.
    fn folder(&mut self) {
        self.n_visited += 1;
    }

    fn show(
        &mut self,
        given_name: String,
        content: Result<(MemberName, Content<'_>), Refusal>,
    ) -> Result<(), Stop> {
        let position = self.n_visited;
        self.n_visited += 1;
        match (self.visit)(Member {
            position,
            given_name,
            content,
        }) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Stop::Broken),
        }
    }
}
