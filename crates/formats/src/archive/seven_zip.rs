//! Reads the members of a 7z archive.
//!
//! Members share solid blocks, which are decoded from their beginning. Members after damage in a block cannot be decoded, and
//! each of them is refused with its name. Other blocks are still read.

use super::{Refusal, Stop, Walk};
use sevenz_rust2::{Archive, ArchiveEntry, BlockDecoder, Error, Password};
use std::io::{self, Read, Seek};

/// Larger dictionaries are refused. The largest setting of common packers uses a fraction of this size.
const MAX_DICTIONARY_KIB: usize = 512 << 10;
/// Windows attributes have the Unix mode in their upper half.
const UNIX_MODE_SHIFT: u32 = 16;
const UNIX_TYPE: u32 = 0o170_000;
const UNIX_LINK: u32 = 0o120_000;
/// The Windows attribute of links and mount points.
const REPARSE_POINT: u32 = 0x400;

/// Visits every member, block by block, and then the empty ones.
pub(super) fn walk(mut source: impl Read + Seek, walk: &mut Walk<'_>) -> Result<(), Stop> {
    let archive = open(&mut source).map_err(|error| Stop::Damage(problem(&error)))?;
    let mut damage = None;
    for block in 0..archive.blocks.len() {
        match walk_block(&archive, block, &mut source, walk) {
            Err(Stop::Damage(problem)) => damage = damage.or(Some(problem)),
            ended => ended?,
        }
    }
    for (idx, entry) in archive.files.iter().enumerate() {
        if archive
            .stream_map
            .file_block_index
            .get(idx)
            .is_none_or(Option::is_none)
        {
            visit(entry, &mut io::empty(), walk)?;
        }
    }
    damage.map_or(Ok(()), |problem| Err(Stop::Damage(problem)))
}

/// The names of all members that are files.
pub(super) fn listed_names(mut source: impl Read + Seek) -> Option<Vec<String>> {
    let archive = open(&mut source).ok()?;
    Some(
        archive
            .files
            .iter()
            .filter(|entry| !entry.is_directory())
            .map(|entry| entry.name().to_owned())
            .collect(),
    )
}

fn open(source: &mut (impl Read + Seek)) -> Result<Archive, Error> {
    Archive::read_with_memory_limit(source, &Password::empty(), MAX_DICTIONARY_KIB)
}

fn walk_block<R: Read + Seek>(
    archive: &Archive,
    block: usize,
    source: &mut R,
    walk: &mut Walk<'_>,
) -> Result<(), Stop> {
    let map = &archive.stream_map;
    let password = Password::empty();
    let decoder = BlockDecoder::new_with_memory_limit(
        1,
        MAX_DICTIONARY_KIB,
        block,
        archive,
        &password,
        source,
    );
    let n_entries = decoder.entry_count();
    let first = map
        .file_block_index
        .iter()
        .position(|&of_file| of_file == Some(block))
        .unwrap_or(0);
    if archive.is_file_encrypted(first) {
        return refuse_rest(&decoder.entries()[..n_entries], &Refusal::Encrypted, walk);
    }
    let entries = decoder.entries().to_vec();
    let mut n_shown = 0;
    let mut stop = None;
    let decoded = decoder.for_each_entries(&mut |entry, bytes| {
        n_shown += 1;
        stop = visit(entry, bytes, walk).err();
        Ok(stop.is_none())
    });
    match (stop, decoded) {
        (Some(Stop::Broken), _) => Err(Stop::Broken),
        (Some(Stop::Damage(problem)), _) => {
            refuse_rest(&entries[n_shown..], &Refusal::BehindDamage, walk)?;
            Err(Stop::Damage(problem))
        }
        (None, Err(error)) => {
            refuse_rest(&entries[n_shown..], &Refusal::BehindDamage, walk)?;
            Err(Stop::Damage(problem(&error)))
        }
        (None, Ok(_)) => Ok(()),
    }
}

fn visit(entry: &ArchiveEntry, bytes: &mut dyn Read, walk: &mut Walk<'_>) -> Result<(), Stop> {
    if entry.is_directory() {
        walk.folder();
        Ok(())
    } else if is_link(entry) || entry.is_anti_item() {
        walk.refused(entry.name().to_owned(), Refusal::Link)
    } else {
        walk.file(entry.name().to_owned(), bytes, Some(entry.size()))
    }
}

fn is_link(entry: &ArchiveEntry) -> bool {
    let attributes = entry.windows_attributes();
    (attributes >> UNIX_MODE_SHIFT) & UNIX_TYPE == UNIX_LINK || attributes & REPARSE_POINT != 0
}

/// Refuses all members that were not visited.
fn refuse_rest(
    entries: &[ArchiveEntry],
    refusal: &Refusal,
    walk: &mut Walk<'_>,
) -> Result<(), Stop> {
    entries
        .iter()
        .filter(|entry| !entry.is_directory())
        .try_for_each(|entry| walk.refused(entry.name().to_owned(), refusal.clone()))
}

/// A description of the error, which does not depend on the way in which the error was reported.
fn problem(error: &Error) -> String {
    match error {
        Error::Io(error, _) | Error::MaybeBadPassword(error) => error.to_string(),
        Error::Other(text) | Error::Unsupported(text) => text.to_string(),
        Error::UnsupportedCompressionMethod(method) => {
            format!("its compression {method} is not supported")
        }
        Error::PasswordRequired => {
            "its list of files is encrypted; unpack it with its password first".to_owned()
        }
        Error::BadSignature(_) => "it does not begin as 7z archives do".to_owned(),
        Error::MaxMemLimited { .. } => {
            format!("its dictionary is larger than {MAX_DICTIONARY_KIB} KiB")
        }
        error => error.to_string(),
    }
}
