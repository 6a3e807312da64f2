//! Unpacks STEP text: the bytes of a file go in, and its text comes out.
//!
//! The container is recognized by its content, never by its name. At most a given number of bytes is decoded, so a file that
//! unpacks without end costs no more than any other file.

use super::container::{Container, LOOK_BYTES, decoded};
use super::content::ContentError;
use super::{ArchiveKind, walk_archive};
use crate::archive::step_name::step_stem;
use std::io::{self, Cursor, Read};
use std::ops::ControlFlow;

/// The largest number of nested containers.
const MAX_LAYERS: usize = 4;

/// The reason why a file gives no text.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UnpackError {
    /// There is more text than allowed.
    #[error("the unpacked file has more than {limit} bytes")]
    TooLarge {
        /// The allowed number.
        limit: u64,
    },
    /// The container is damaged or cut off.
    #[error("its {container} container is damaged or cut off: {problem}")]
    Damaged {
        /// The container of the file.
        container: &'static str,
        /// A description of the damage.
        problem: String,
    },
    /// A zip container has no STEP file, or several ones.
    #[error(
        "it is a zip archive with {n_steps} STEP files, not one{}",
        if *n_steps > 1 { "; `partprobe label` reads all of them if the name ends in .zip" } else { "" }
    )]
    NotOne {
        /// The number of STEP files.
        n_steps: usize,
    },
    /// An archive of several files under the name of a single file.
    #[error(
        "it is a {container} archive of files, which `partprobe label` reads if its name ends in {ending}"
    )]
    Archive {
        /// The kind of archive.
        container: &'static str,
        /// The correct ending of this kind.
        ending: &'static str,
    },
    /// There are too many nested containers.
    #[error("it is packed more than {MAX_LAYERS} times; unpack it first")]
    TooDeep,
}

/// Gives the text of a file that may be packed with gzip, zstd, xz, or as the only STEP file of a zip.
///
/// # Errors
/// If the container is damaged, holds several files, or unpacks to more than `limit` bytes.
pub fn unpacked_step(bytes: Vec<u8>, limit: u64) -> Result<Vec<u8>, UnpackError> {
    let mut bytes = bytes;
    for _ in 0..MAX_LAYERS {
        let start = &bytes[..bytes.len().min(LOOK_BYTES)];
        bytes = match Container::of_start(start) {
            None => return Ok(bytes),
            Some(Container::Zip) => only_step_of_zip(&bytes, limit)?,
            Some(Container::Gzip) => gunzipped(&bytes, limit)?,
            Some(stream @ (Container::Zstd | Container::Xz)) => {
                let decoder =
                    decoded(stream, bytes.as_slice()).map_err(|error| damage(stream, &error))?;
                read_up_to(decoder, limit, stream)?
            }
            Some(Container::SevenZip) => {
                return Err(UnpackError::Archive {
                    container: "7z",
                    ending: ".7z",
                });
            }
            Some(Container::Tar) => {
                return Err(UnpackError::Archive {
                    container: "tar",
                    ending: ".tar, .tar.gz or .tar.xz",
                });
            }
        };
    }
    match Container::of_start(&bytes[..bytes.len().min(LOOK_BYTES)]) {
        None => Ok(bytes),
        Some(_) => Err(UnpackError::TooDeep),
    }
}

/// Decodes all members of a gzip file. Padding after them is not damage.
fn gunzipped(bytes: &[u8], limit: u64) -> Result<Vec<u8>, UnpackError> {
    let mut text = Vec::new();
    let mut rest = bytes;
    loop {
        let mut decoder = flate2::bufread::GzDecoder::new(rest);
        let left = limit - text.len() as u64;
        text.append(
            &mut read_up_to(&mut decoder, left, Container::Gzip)
                .map_err(|error| with_limit(error, limit))?,
        );
        rest = decoder.into_inner();
        if Container::of_start(rest) != Some(Container::Gzip) {
            return Ok(text);
        }
    }
}

fn with_limit(error: UnpackError, limit: u64) -> UnpackError {
    match error {
        UnpackError::TooLarge { .. } => UnpackError::TooLarge { limit },
        error => error,
    }
}

fn read_up_to(source: impl Read, limit: u64, container: Container) -> Result<Vec<u8>, UnpackError> {
    let mut bytes = Vec::new();
    source
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| damage(container, &error))?;
    if bytes.len() as u64 > limit {
        Err(UnpackError::TooLarge { limit })
    } else {
        Ok(bytes)
    }
}

fn damage(container: Container, error: &io::Error) -> UnpackError {
    let problem = match error.kind() {
        io::ErrorKind::UnexpectedEof => "it ends too early".to_owned(),
        _ => error.to_string(),
    };
    UnpackError::Damaged {
        container: container.name(),
        problem,
    }
}

/// The STEP file of a zip that has one, or its only file if no name has an ending of STEP.
fn only_step_of_zip(bytes: &[u8], limit: u64) -> Result<Vec<u8>, UnpackError> {
    let names = step_members(bytes)?;
    let [name] = names.as_slice() else {
        return Err(UnpackError::NotOne {
            n_steps: names.len(),
        });
    };
    let mut found = None;
    let walked = walk_archive(ArchiveKind::Zip, Cursor::new(bytes), &mut |member| {
        if member.given_name != *name {
            return ControlFlow::Continue(());
        }
        found = Some(match member.content {
            Ok((_, content)) => content.read(limit).map_err(|error| match error {
                ContentError::TooLarge { limit } => UnpackError::TooLarge { limit },
                ContentError::Damaged(problem) => zip_damage(problem),
            }),
            Err(refusal) => Err(zip_damage(format!(
                "its member {name} cannot be read: {refusal}"
            ))),
        });
        ControlFlow::Break(())
    });
    match (found, walked) {
        (Some(found), _) => found,
        (None, Err(problem)) => Err(zip_damage(problem.problem)),
        (None, Ok(())) => Err(zip_damage("its member is gone".to_owned())),
    }
}

/// The names of the members with an ending of STEP, or of all members if there are none.
fn step_members(bytes: &[u8]) -> Result<Vec<String>, UnpackError> {
    let mut names = Vec::new();
    let walked = walk_archive(ArchiveKind::Zip, Cursor::new(bytes), &mut |member| {
        names.push(member.given_name);
        ControlFlow::Continue(())
    });
    walked.map_err(|damage| zip_damage(damage.problem))?;
    // Programs for macOS put the attributes of a file into a second member.
    names.retain(|name| !name.starts_with("__MACOSX/"));
    let is_step = |name: &String| {
        name.rsplit('/')
            .next()
            .is_some_and(|last| step_stem(last).is_some())
    };
    if names.len() > 1 {
        names.retain(is_step);
    }
    Ok(names)
}

fn zip_damage(problem: String) -> UnpackError {
    UnpackError::Damaged {
        container: Container::Zip.name(),
        problem,
    }
}
