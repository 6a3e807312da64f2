//! Reads archives as streams of members: an archive's bytes go in, its files come out one after the other, in its order.
//!
//! Nothing is unpacked to disk and nothing is believed: a name that leads outside, a link, an encrypted member and an
//! archive inside the archive are refused by name, a size counts only when the bytes have come, and damage ends
//! what lies behind it and nothing else.

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

/// A file in an archive, at the moment when the archive has come to it.
#[derive(Debug)]
pub struct Member<'a> {
    /// Its place in the archive, from 0; folders and refused members count.
    pub position: u64,
    /// The name as the archive gives it; bytes that are not UTF-8 are escaped by [`crate::text_of_name`].
    pub given_name: String,
    /// The usable name and the bytes, or why the member is refused.
    pub content: Result<(MemberName, Content<'a>), Refusal>,
}

/// Why a member is not read, for any content.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// The name could lead out of the folder that the archive stands for.
    #[error("the name {0}; pack the files again with relative names")]
    UnsafeName(&'static str),
    /// A link names another file instead of holding bytes.
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
    /// Several members have one name, and nothing tells which is meant.
    #[error("{0} members have this name, and which is meant cannot be told")]
    Duplicate(usize),
    /// The member lies behind damage in the stream that holds it.
    #[error("it cannot be reached, since the archive is damaged before it")]
    BehindDamage,
}

/// The archive could not be read to its end; the members before the damage have been visited.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the archive is damaged, cut off or of an unknown kind: {problem}; {n_visited} members were reached"
)]
pub struct ArchiveDamage {
    /// What is wrong.
    pub problem: String,
    /// Members before the damage.
    pub n_visited: u64,
}

/// What happens to each member.
pub type Visit<'v> = &'v mut dyn FnMut(Member<'_>) -> ControlFlow<()>;

/// Visits the members in the order in which the archive holds them, until the visitor breaks off.
///
/// Memory does not grow with the archive, but for a list of names where the archive has one.
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

/// The names of the members, where the archive has a list of them: a tar archive has none.
pub fn listed_names(kind: ArchiveKind, source: impl Read + Seek) -> Option<Vec<String>> {
    match kind {
        ArchiveKind::Zip => zip_file::listed_names(source),
        ArchiveKind::SevenZip => seven_zip::listed_names(source),
        ArchiveKind::Tar | ArchiveKind::TarGz | ArchiveKind::TarZst | ArchiveKind::TarXz => None,
    }
}

/// Why a walk ends early.
enum Stop {
    /// The visitor has had enough.
    Broken,
    /// The archive is damaged.
    Damage(String),
}

/// A walk through an archive: the visitor, and how far it is.
struct Walk<'v> {
    visit: Visit<'v>,
    n_visited: u64,
}

impl Walk<'_> {
    /// Visits a member whose bytes can be had from `bytes`, unless its name is refused.
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

    /// Passes over a folder.
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
