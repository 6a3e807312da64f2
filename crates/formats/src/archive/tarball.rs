//! Reads the members of a tar archive, which may be compressed.

use super::content::CUT_OFF;
use super::{Refusal, Stop, Walk};
use crate::archive::name_text::text_of_name;
use std::cell::Cell;
use std::io::{self, Read};
use std::rc::Rc;

/// The largest size of the headers and long names of one member. It protects against decompression bombs.
const MAX_HEADER_BYTES: u64 = 1 << 20;
/// The largest size of a member that is skipped. It protects against decompression bombs, because skipped bytes must be decoded
/// too.
const MAX_SKIPPED_BYTES: u64 = 1 << 33;

/// Visits every member. Bytes that the visitor does not read are skipped.
pub(super) fn walk(source: impl Read, walk: &mut Walk<'_>) -> Result<(), Stop> {
    let left = Rc::new(Cell::new(MAX_HEADER_BYTES));
    let mut archive = tar::Archive::new(LimitedReader {
        source,
        left: Rc::clone(&left),
    });
    let mut entries = archive.entries().map_err(damage)?;
    loop {
        left.set(MAX_HEADER_BYTES);
        let Some(entry) = entries.next() else {
            return Ok(());
        };
        let mut entry = entry.map_err(damage)?;
        left.set(u64::MAX);
        let name = text_of_name(&entry.path_bytes());
        let (kind, size) = (entry.header().entry_type(), entry.size());
        if kind.is_dir() {
            walk.folder();
        } else if kind.is_symlink() || kind.is_hard_link() {
            walk.refused(name, Refusal::Link)?;
        } else if kind.is_pax_global_extensions() {
            // These are comments of the packing program, not members.
        } else if kind.is_file() || kind.is_contiguous() {
            walk.file(name, &mut entry, Some(size))?;
        } else {
            walk.refused(name, Refusal::Special)?;
        }
        skip_rest(&mut entry)?;
    }
}

/// Reads the rest of a member, so that the next header is not searched inside it.
fn skip_rest(entry: &mut impl Read) -> Result<(), Stop> {
    let n_passed = io::copy(&mut entry.take(MAX_SKIPPED_BYTES), &mut io::sink()).map_err(damage)?;
    if n_passed == MAX_SKIPPED_BYTES {
        return Err(Stop::Damage(
            "a member is too large to be passed over".to_owned(),
        ));
    }
    Ok(())
}

fn damage(error: io::Error) -> Stop {
    Stop::Damage(match error.kind() {
        io::ErrorKind::UnexpectedEof => CUT_OFF.to_owned(),
        _ => error.to_string(),
    })
}

/// A reader that gives at most an allowed number of bytes.
struct LimitedReader<R> {
    source: R,
    left: Rc<Cell<u64>>,
}

impl<R: Read> Read for LimitedReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n_read = self.source.read(buffer)?;
        let left = self.left.get().checked_sub(n_read as u64);
        self.left
            .set(left.ok_or_else(|| io::Error::other("the header of a member has no end"))?);
        Ok(n_read)
    }
}
