//! Reads the members of a zip archive.
//!
//! The list of its members is at its end. If the list is missing, for example because the archive was cut off, the members are
//! read one after the other from the beginning.

use super::{Refusal, Stop, Walk};
use crate::archive::name_text::text_of_name;
use std::collections::BTreeMap;
use std::io::{BufReader, Read, Seek, SeekFrom};
use zip::ZipArchive;
use zip::read::{ZipFile, read_zipfile_from_stream};

/// Visits every member of the list, or of the stream if there is no list.
pub(super) fn walk(mut source: impl Read + Seek, walk: &mut Walk<'_>) -> Result<(), Stop> {
    let repeated_from = match ZipArchive::new(&mut source) {
        Ok(archive) => archive
            .has_duplicate_names()
            .then(|| archive.central_directory_start()),
        Err(error) => {
            source.seek(SeekFrom::Start(0)).map_err(damage)?;
            walk_stream(source, walk)?;
            return Err(damage(error));
        }
    };
    let repeated = repeated_from
        .map(|start| repeated_names(&mut source, start))
        .transpose()?
        .unwrap_or_default();
    walk_list(ZipArchive::new(source).map_err(damage)?, &repeated, walk)
}

/// The names of the list.
pub(super) fn listed_names(source: impl Read + Seek) -> Option<Vec<String>> {
    let archive = ZipArchive::new(source).ok()?;
    Some(archive.file_names_raw().map(text_of_name).collect())
}

fn walk_list<R: Read + Seek>(
    mut archive: ZipArchive<R>,
    repeated: &Names,
    walk: &mut Walk<'_>,
) -> Result<(), Stop> {
    // Members may overlap, so that a few bytes unpack to far more data than without overlaps.
    if archive
        .has_overlapping_files()
        .is_ok_and(|overlaps| overlaps)
    {
        return Err(Stop::Damage("its members overlap, as in a bomb".to_owned()));
    }
    for idx in 0..archive.len() {
        let raw_name = archive
            .by_index_raw(idx)
            .map_err(damage)?
            .name_raw()
            .to_vec();
        let refusal = repeated
            .get(&raw_name)
            .map(|&n_copies| Refusal::Duplicate(n_copies));
        visit(archive.by_index(idx), &raw_name, refusal, walk)?;
    }
    Ok(())
}

fn walk_stream(mut source: impl Read, walk: &mut Walk<'_>) -> Result<(), Stop> {
    // The caller already knows that the archive is damaged, so the place where the stream ends does not matter.
    while let Ok(Some(file)) = read_zipfile_from_stream(&mut source) {
        let raw_name = file.name_raw().to_vec();
        visit(Ok(file), &raw_name, None, walk)?;
    }
    Ok(())
}

fn visit<R: Read>(
    file: zip::result::ZipResult<ZipFile<'_, R>>,
    raw_name: &[u8],
    refusal: Option<Refusal>,
    walk: &mut Walk<'_>,
) -> Result<(), Stop> {
    let name = text_of_name(raw_name);
    match (file, refusal) {
        (Ok(file), _) if file.is_dir() => {
            walk.folder();
            Ok(())
        }
        (_, Some(refusal)) => walk.refused(name, refusal),
        (Ok(file), None) if file.is_symlink() => walk.refused(name, Refusal::Link),
        (Ok(mut file), None) => one_member(walk.file(name, &mut file, None)),
        (Err(error), None) if is_encryption(&error) => walk.refused(name, Refusal::Encrypted),
        (Err(error), None) => one_member(walk.file(name, &mut Unreadable(error.to_string()), None)),
    }
}

/// Members of a zip are independent: damage in one of them does not affect the others.
fn one_member(visited: Result<(), Stop>) -> Result<(), Stop> {
    match visited {
        Err(Stop::Damage(_)) => Ok(()),
        ended => ended,
    }
}

fn is_encryption(error: &zip::result::ZipError) -> bool {
    use zip::result::ZipError;
    match error {
        ZipError::UnsupportedArchive(text) => {
            *text == ZipError::PASSWORD_REQUIRED || text.contains("ncrypt")
        }
        ZipError::InvalidPassword => true,
        _ => false,
    }
}

/// A member that cannot be opened. Reading it gives the reason.
struct Unreadable(String);

impl Read for Unreadable {
    fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
        Err(std::io::Error::other(self.0.clone()))
    }
}

/// The number of times that each name is in the list.
type Names = BTreeMap<Vec<u8>, usize>;

/// The length of an entry of the list without its texts, and the position of the three lengths of the texts in it.
const ENTRY_BYTES: usize = 46;
const NAME_LENGTH_AT: usize = 28;

/// The names that are more than once in the list. The zip reader keeps one member per name and does not report the others.
fn repeated_names(source: &mut (impl Read + Seek), start: u64) -> Result<Names, Stop> {
    source.seek(SeekFrom::Start(start)).map_err(damage)?;
    let mut source = BufReader::new(source);
    let mut names = Names::new();
    loop {
        let mut entry = [0; ENTRY_BYTES];
        if source.read_exact(&mut entry).is_err() || !entry.starts_with(b"PK\x01\x02") {
            names.retain(|_, &mut n_copies| n_copies > 1);
            return Ok(names);
        }
        let length = |nth: usize| {
            let at = NAME_LENGTH_AT + 2 * nth;
            usize::from(u16::from_le_bytes([entry[at], entry[at + 1]]))
        };
        let mut texts = vec![0; length(0) + length(1) + length(2)];
        source.read_exact(&mut texts).map_err(damage)?;
        texts.truncate(length(0));
        *names.entry(texts).or_default() += 1;
    }
}

fn damage(error: impl std::fmt::Display) -> Stop {
    Stop::Damage(error.to_string())
}
