//! Sends length-prefixed blocks of bytes through a pipe between this process and its workers.

use anyhow::{Context, Result, ensure};
use std::io::{Read, Write};

/// The largest length of a block. A larger length means that something else wrote to the pipe.
const MAX_FRAME_BYTES: u64 = 1 << 33;

/// A block up to this length is written together with its length, and memory for this length is allocated before a block is read.
const SHORT_BYTES: usize = 1 << 16;

/// Writes one block.
pub(super) fn write_frame(pipe: &mut impl Write, bytes: &[u8]) -> Result<()> {
    let length = (bytes.len() as u64).to_le_bytes();
    if bytes.len() <= SHORT_BYTES {
        pipe.write_all(&[&length, bytes].concat())?;
    } else {
        pipe.write_all(&length)?;
        pipe.write_all(bytes)?;
    }
    Ok(pipe.flush()?)
}

/// Reads one block. Returns `None` if the pipe ends before a block begins.
pub(super) fn read_frame(pipe: &mut impl Read) -> Result<Option<Vec<u8>>> {
    let mut start = Vec::with_capacity(9);
    pipe.by_ref().take(8).read_to_end(&mut start)?;
    if start.is_empty() {
        return Ok(None);
    }
    let length = u64::from_le_bytes(
        *start
            .first_chunk()
            .context("the pipe ends inside a length")?,
    );
    ensure!(
        length <= MAX_FRAME_BYTES,
        "the pipe announces {length} bytes"
    );
    // Only a limited amount of memory is allocated, because the announced bytes may never come.
    let mut bytes = Vec::with_capacity((length as usize).min(SHORT_BYTES) + 1);
    pipe.by_ref().take(length).read_to_end(&mut bytes)?;
    ensure!(bytes.len() as u64 == length, "the pipe ends inside a block");
    Ok(Some(bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_round_trip_and_broken_pipes_are_detected() {
        let mut pipe = Vec::new();
        write_frame(&mut pipe, b"one").unwrap();
        write_frame(&mut pipe, b"").unwrap();
        let mut reader = pipe.as_slice();
        assert_eq!(
            read_frame(&mut reader).unwrap().as_deref(),
            Some(&b"one"[..])
        );
        assert_eq!(read_frame(&mut reader).unwrap().as_deref(), Some(&b""[..]));
        assert_eq!(read_frame(&mut reader).unwrap(), None);
        assert!(read_frame(&mut &pipe[..5]).is_err());
        assert!(read_frame(&mut &pipe[..9]).is_err());
        assert!(read_frame(&mut &[255u8; 8][..]).is_err());
    }
}
