//! Reads and writes NPZ: named arrays in a zip archive that `numpy.load` can open.

use crate::format_version::FORMAT_VERSION;
use crate::numpy::array::{Array, Values};
use crate::numpy::content_hash::{ContentHash, ContentHasher, HASH_MEMBER};
use crate::numpy::members::Members;
use crate::numpy::npy::{array_from_npy, array_to_npy};
use crate::numpy::npy_header::NpyError;
use std::io::{Cursor, Read, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// The member with the version of the format.
const VERSION_MEMBER: &str = "format_version";
/// The largest number of bytes to which all members of an archive together may unpack.
const MAX_UNPACKED_BYTES: u64 = 1 << 32;

/// The compression of the members of an archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Compression {
    /// Not compressed: fast, and NumPy can map them into memory.
    Stored,
    /// Deflated: about a third of the bytes.
    Deflated,
}

/// The reason why bytes are not an archive of arrays.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The archive cannot be opened, or a member cannot be unpacked.
    #[error("not a readable NPZ archive: {0}")]
    Archive(String),
    /// The members unpack to more bytes than any file of partprobe.
    #[error("the archive unpacks to more than {MAX_UNPACKED_BYTES} bytes; it is refused as a bomb")]
    TooLarge,
    /// A member is not an array.
    #[error("member `{name}`: {problem}")]
    Member {
        /// The member's name, without `.npy`.
        name: String,
        /// The error.
        problem: NpyError,
    },
    /// Two members have the same name.
    #[error("member `{0}` is there twice")]
    Twice(String),
    /// A member was changed after the file was written.
    #[error(
        "the file was changed after it was written: its members have the hash {found}, not {stored}; make it again"
    )]
    Changed {
        /// The hash of the present members.
        found: ContentHash,
        /// The hash that is stored in the file.
        stored: ContentHash,
    },
    /// A newer version of partprobe wrote the file.
    #[error(
        "format version {0} is newer than this program, which reads up to {FORMAT_VERSION}; update partprobe"
    )]
    Version(u32),
}

/// The reason why arrays cannot be written as an archive: names that are used twice, or members above the limits of zip.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the archive can't be written: {0}")]
pub struct NpzWriteError(String);

impl From<zip::result::ZipError> for NpzWriteError {
    fn from(error: zip::result::ZipError) -> Self {
        Self(error.to_string())
    }
}

impl From<std::io::Error> for NpzWriteError {
    fn from(error: std::io::Error) -> Self {
        Self(error.to_string())
    }
}

/// The bytes of an archive with these members, in their order, after a member `format_version`.
///
/// Every member has the date 1 January 1980, so equal arrays give equal bytes.
///
/// # Errors
/// If two members have the same name, or the archive would pass the limits of zip.
pub fn arrays_to_npz<N: AsRef<str>>(
    members: &[(N, Array)],
    compression: Compression,
) -> Result<Vec<u8>, NpzWriteError> {
    let mut archive = NpzWriter::new(compression)?;
    for (name, array) in members {
        archive.add(name.as_ref(), array)?;
    }
    archive.finish()
}

/// An archive that is written member by member, so that an array can be dropped before the next one is made.
pub(crate) struct NpzWriter {
    archive: ZipWriter<Cursor<Vec<u8>>>,
    options: SimpleFileOptions,
    hasher: ContentHasher,
}

impl NpzWriter {
    /// An archive with the version of its format.
    pub(crate) fn new(compression: Compression) -> Result<Self, NpzWriteError> {
        let method = match compression {
            Compression::Stored => CompressionMethod::Stored,
            Compression::Deflated => CompressionMethod::Deflated,
        };
        let options = SimpleFileOptions::default()
            .compression_method(method)
            .last_modified_time(DateTime::DEFAULT);
        let archive = ZipWriter::new(Cursor::new(Vec::new()));
        let mut writer = Self {
            archive,
            options,
            hasher: ContentHasher::default(),
        };
        writer.add(VERSION_MEMBER, &Array::scalar(FORMAT_VERSION))?;
        Ok(writer)
    }

    /// Adds a member.
    pub(crate) fn add(&mut self, name: &str, array: &Array) -> Result<(), NpzWriteError> {
        let bytes = array_to_npy(array);
        self.hasher.add(name, &bytes);
        let options = self.options.large_file(u32::try_from(bytes.len()).is_err());
        self.archive.start_file(format!("{name}.npy"), options)?;
        Ok(self.archive.write_all(&bytes)?)
    }

    /// The bytes of the archive with a last member that holds the hash of all others, and this hash.
    pub(crate) fn finish_with_hash(mut self) -> Result<(Vec<u8>, ContentHash), NpzWriteError> {
        let hash = self.hasher.hash();
        self.add(HASH_MEMBER, &Array::vector(hash.to_bytes().to_vec()))?;
        Ok((self.finish()?, hash))
    }

    /// The bytes of the archive.
    pub(crate) fn finish(self) -> Result<Vec<u8>, NpzWriteError> {
        Ok(self.archive.finish()?.into_inner())
    }
}

/// The arrays of an archive, by name.
///
/// Archives of other programs have no `format_version`, but they are also read.
///
/// # Errors
/// If the archive or a member is damaged, a member is not an array, the hash in the archive differs from that of its members, or
/// the version is newer than this program.
pub fn arrays_from_npz(bytes: &[u8]) -> Result<Members, NpzError> {
    hashed_arrays_from_npz(bytes).map(|(members, _)| members)
}

/// The same, with the hash of the members.
pub(crate) fn hashed_arrays_from_npz(bytes: &[u8]) -> Result<(Members, ContentHash), NpzError> {
    let mut hasher = ContentHasher::default();
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(archive_error)?;
    let mut members = Members::default();
    let mut budget = MAX_UNPACKED_BYTES;
    for idx in 0..archive.len() {
        let mut file = archive.by_index(idx).map_err(archive_error)?;
        let name = file
            .name()
            .map_err(archive_error)?
            .trim_end_matches(".npy")
            .to_owned();
        // The declared size is not trusted. Reading always ends at the budget.
        let mut unpacked = Vec::new();
        let n_read = file
            .by_ref()
            .take(budget + 1)
            .read_to_end(&mut unpacked)
            .map_err(|error| NpzError::Archive(error.to_string()))?;
        budget = budget
            .checked_sub(n_read as u64)
            .ok_or(NpzError::TooLarge)?;
        hasher.add(&name, &unpacked);
        let array = array_from_npy(&unpacked).map_err(|problem| NpzError::Member {
            name: name.clone(),
            problem,
        })?;
        if !members.insert(name.clone(), array) {
            return Err(NpzError::Twice(name));
        }
    }
    match members.array(VERSION_MEMBER).map(Array::values) {
        Some(Values::U32(version))
            if version
                .first()
                .is_some_and(|&version| version > FORMAT_VERSION) =>
        {
            Err(NpzError::Version(version[0]))
        }
        _ => {
            let found = hasher.hash();
            ensure_unchanged(&members, found)?;
            Ok((members, found))
        }
    }
}

/// Compares the hash of the members with the stored hash, if there is one.
fn ensure_unchanged(members: &Members, found: ContentHash) -> Result<(), NpzError> {
    let Some(Values::U8(bytes)) = members.array(HASH_MEMBER).map(Array::values) else {
        return Ok(());
    };
    match ContentHash::from_bytes(bytes) {
        Some(stored) if stored != found => Err(NpzError::Changed { found, stored }),
        _ => Ok(()),
    }
}

fn archive_error(error: zip::result::ZipError) -> NpzError {
    NpzError::Archive(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn two_members(compression: Compression) -> Vec<u8> {
        arrays_to_npz(
            &[
                ("a", Array::vector(vec![1i32, 2])),
                ("b", Array::rows(&[[0.5f64, 1.0]])),
            ],
            compression,
        )
        .unwrap()
    }

    #[test]
    fn members_round_trip_and_bytes_are_reproducible() {
        for compression in [Compression::Stored, Compression::Deflated] {
            let bytes = two_members(compression);
            assert_eq!(bytes, two_members(compression));
            let mut members = arrays_from_npz(&bytes).unwrap();
            assert_eq!(
                members.names().collect::<Vec<_>>(),
                ["a", "b", "format_version"]
            );
            assert_eq!(members.vector::<i32>("a"), Ok(vec![1, 2]));
            assert_eq!(members.rows::<f64, 2>("b"), Ok(vec![[0.5, 1.0]]));
        }
    }

    #[test]
    fn damaged_foreign_and_newer_archives_are_refused() {
        assert!(matches!(arrays_from_npz(b""), Err(NpzError::Archive(_))));
        assert!(matches!(
            arrays_from_npz(b"ISO-10303-21;"),
            Err(NpzError::Archive(_))
        ));
        assert!(
            arrays_to_npz(
                &[("a", Array::scalar(1u8)), ("a", Array::scalar(1u8))],
                Compression::Stored
            )
            .is_err()
        );
        let newer = arrays_to_npz(
            &[("version", Array::scalar(FORMAT_VERSION + 1))],
            Compression::Stored,
        )
        .unwrap();
        assert!(arrays_from_npz(&newer).is_ok());
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        archive
            .start_file("format_version.npy", SimpleFileOptions::default())
            .unwrap();
        archive
            .write_all(&array_to_npy(&Array::scalar(FORMAT_VERSION + 1)))
            .unwrap();
        let bytes = archive.finish().unwrap().into_inner();
        assert_eq!(
            arrays_from_npz(&bytes).unwrap_err(),
            NpzError::Version(FORMAT_VERSION + 1)
        );
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        archive
            .start_file("notes.npy", SimpleFileOptions::default())
            .unwrap();
        archive.write_all(b"hello").unwrap();
        let bytes = archive.finish().unwrap().into_inner();
        let expected = NpzError::Member {
            name: "notes".to_owned(),
            problem: NpyError::NotNpy,
        };
        assert_eq!(arrays_from_npz(&bytes).unwrap_err(), expected);
    }

    proptest! {
        #[test]
        fn a_flipped_byte_never_panics(at in 0usize..900, value: u8) {
            let mut bytes = two_members(Compression::Deflated);
            let at = at % bytes.len();
            bytes[at] = value;
            let _ = arrays_from_npz(&bytes);
            let _ = arrays_from_npz(&bytes[..at]);
        }
    }
}
