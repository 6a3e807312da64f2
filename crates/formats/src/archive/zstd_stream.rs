//! Reads a zstd stream: packed bytes go in, and plain bytes come out, frame by frame (RFC 8878).
//!
//! Frames that hold no data are skipped, and each checksum is compared. Nothing is packed here.

use ruzstd::decoding::errors::{FrameDecoderError, ReadFrameHeaderError};
use ruzstd::decoding::{BlockDecodingStrategy, FrameDecoder};
use std::io::{self, BufReader, Read};

/// An empty last block and the four bytes of a checksum.
///
/// A decoder keeps the last bytes of an open frame, because later blocks may repeat them. After damage, it gives out these bytes
/// when it reads this end.
const FRAME_END: [u8; 7] = [1, 0, 0, 0, 0, 0, 0];

/// The plain bytes of a zstd stream of one or more frames, as a reader.
///
/// A frame's window may take up to 128 MiB, which is the limit of the `zstd` program too.
///
/// Reading fails if the stream ends inside a frame, if a checksum differs, or if what follows a frame is not zstd. All
/// whole blocks before the damage are given first.
///
/// ```
/// use partprobe_formats::ZstdReader;
/// use std::io::Read;
///
/// // One frame of one raw block, which holds "ok".
/// let packed = [0x28, 0xb5, 0x2f, 0xfd, 0x20, 0x02, 0x11, 0x00, 0x00, b'o', b'k'];
/// let mut text = String::new();
/// ZstdReader::new(&packed[..]).read_to_string(&mut text)?;
/// assert_eq!(text, "ok");
/// # Ok::<(), std::io::Error>(())
/// ```
pub struct ZstdReader<R: Read> {
    source: BufReader<R>,
    frame: FrameDecoder,
    is_inside_frame: bool,
    /// The error that ended the stream early. It is reported after all bytes before it have been given.
    damage: Option<io::Error>,
}

impl<R: Read> ZstdReader<R> {
    /// Wraps a source. Nothing is read yet.
    pub fn new(source: R) -> Self {
        Self {
            source: BufReader::new(source),
            frame: FrameDecoder::new(),
            is_inside_frame: false,
            damage: None,
        }
    }

    /// Reads the header of the next frame that has data. Returns `false` at the end of the stream.
    fn open_next_frame(&mut self) -> io::Result<bool> {
        loop {
            let mut first = [0_u8];
            if self.source.read(&mut first)? == 0 {
                return Ok(false);
            }

            match self.frame.reset((&first[..]).chain(&mut self.source)) {
                Ok(()) => return Ok(true),
                Err(FrameDecoderError::ReadFrameHeaderError(ReadFrameHeaderError::SkipFrame {
                    length,
                    ..
                })) => self.skip(u64::from(length))?,
                Err(error) => return Err(io::Error::other(error)),
            }
        }
    }

    fn skip(&mut self, n_bytes: u64) -> io::Result<()> {
        let n_skipped = io::copy(&mut (&mut self.source).take(n_bytes), &mut io::sink())?;
        if n_skipped < n_bytes {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        Ok(())
    }

    /// Decodes blocks until there are bytes to give out, or until the frame ends normally or by damage.
    fn decode_some(&mut self) -> io::Result<()> {
        let one_block = || BlockDecodingStrategy::UptoBlocks(1);
        while self.frame.can_collect() == 0 && !self.frame.is_finished() {
            let decoded = self.frame.decode_blocks(&mut self.source, one_block());
            if let Err(error) = decoded {
                self.damage = Some(io::Error::other(error));
                self.frame
                    .decode_blocks(&FRAME_END[..], one_block())
                    .map_err(io::Error::other)?;
            }
        }
        Ok(())
    }

    /// Compares a finished frame with its checksum, if it has one.
    fn check_frame(&self) -> io::Result<()> {
        match self.frame.get_checksum_from_data() {
            Some(stated) if self.frame.get_calculated_checksum() != Some(stated) => {
                Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    "a zstd frame's checksum differs",
                ))
            }
            _ => Ok(()),
        }
    }
}

impl<R: Read> Read for ZstdReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        loop {
            if !self.is_inside_frame {
                if !self.open_next_frame()? {
                    return Ok(0);
                }
                self.is_inside_frame = true;
            }

            self.decode_some()?;
            let n_read = self.frame.read(buffer)?;
            if n_read > 0 {
                return Ok(n_read);
            }

            if let Some(damage) = self.damage.take() {
                return Err(damage);
            }
            self.check_frame()?;
            self.is_inside_frame = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Packs with the C library at a level, with or without a checksum after the data.
    fn packed(plain: &[u8], level: i32, has_checksum: bool) -> Vec<u8> {
        let mut encoder = zstd::Encoder::new(Vec::new(), level).unwrap();
        encoder.include_checksum(has_checksum).unwrap();
        io::copy(&mut &plain[..], &mut encoder).unwrap();
        encoder.finish().unwrap()
    }

    fn unpacked(packed: &[u8]) -> io::Result<Vec<u8>> {
        let mut plain = Vec::new();
        ZstdReader::new(packed).read_to_end(&mut plain)?;
        Ok(plain)
    }

    /// Text that repeats itself, as STEP files do.
    fn step_like(n_lines: usize, seed: usize) -> Vec<u8> {
        (0..n_lines)
            .flat_map(|line| {
                let x = (line * 7919 + seed) % 1009;
                format!("#{line}=CARTESIAN_POINT('',({x}.,{}.5,0.));\n", x % 13).into_bytes()
            })
            .collect()
    }

    #[test]
    fn frames_follow_each_other_and_those_without_data_are_skipped() {
        let skippable = [0x50, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 1, 2, 3];
        let empty = packed(b"", 1, true);
        let stream = [
            &skippable[..],
            &packed(b"one", 1, true),
            &empty,
            &skippable,
            &packed(b"two", 19, false),
        ];

        assert_eq!(unpacked(&stream.concat()).unwrap(), b"onetwo");
        assert_eq!(unpacked(&[]).unwrap(), b"");
    }

    #[test]
    fn complete_blocks_before_damage_are_returned() {
        let plain = step_like(20_000, 3);
        let whole = packed(&plain, 3, true);
        let mut given = Vec::new();
        let error = ZstdReader::new(&whole[..whole.len() * 9 / 10]).read_to_end(&mut given);

        assert!(error.is_err());
        assert!(
            given.len() > plain.len() / 2,
            "{} of {}",
            given.len(),
            plain.len()
        );
        assert!(plain.starts_with(&given));
    }

    #[test]
    fn damage_is_an_error() {
        let whole = packed(&step_like(200, 1), 3, true);
        let mut flipped = whole.clone();
        *flipped.last_mut().unwrap() ^= 1;

        let damaged: [&[u8]; 4] = [
            &whole[..whole.len() - 5],
            &whole[..3],
            &flipped,
            &[&whole[..], b"more"].concat(),
        ];
        for stream in damaged {
            assert!(unpacked(stream).is_err());
        }
    }

    /// The C library accepts windows of up to 128 MiB, and so does this reader.
    #[test]
    fn a_long_window_is_read() {
        let mut encoder = zstd::Encoder::new(Vec::new(), 1).unwrap();
        encoder.window_log(27).unwrap();
        encoder.long_distance_matching(true).unwrap();
        let plain = step_like(20_000, 5);
        io::copy(&mut plain.as_slice(), &mut encoder).unwrap();

        assert_eq!(unpacked(&encoder.finish().unwrap()).unwrap(), plain);
    }

    proptest! {
        #[test]
        fn what_the_c_library_packs_is_read(
            level in 1i32..20,
            has_checksum: bool,
            n_lines in 0usize..6_000,
            seed in 0usize..1_000,
            noise in proptest::collection::vec(any::<u8>(), 0..2_000),
        ) {
            let plain = [step_like(n_lines, seed), noise].concat();
            prop_assert_eq!(unpacked(&packed(&plain, level, has_checksum)).unwrap(), plain);
        }
    }
}
