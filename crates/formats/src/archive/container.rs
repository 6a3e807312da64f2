//! Recognizes the container of a file by its first bytes.

use super::{ArchiveKind, ZstdReader};
use std::io::{self, Read};

/// The number of bytes that identify every container. The mark of a tar archive is the last one, at byte 257.
pub(super) const LOOK_BYTES: usize = 512;

/// Larger dictionaries of xz are refused, like those of 7z.
const MAX_DICTIONARY_KIB: u32 = 512 << 10;

/// The container of a file, by its first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Container {
    Gzip,
    Zstd,
    Xz,
    Zip,
    SevenZip,
    Tar,
}

impl Container {
    /// The container of a file that begins like this.
    pub(super) fn of_start(start: &[u8]) -> Option<Self> {
        const MARKS: [(usize, &[u8], Container); 8] = [
            (0, b"\x1f\x8b", Container::Gzip),
            (0, b"\x28\xb5\x2f\xfd", Container::Zstd),
            (0, b"\xfd7zXZ\0", Container::Xz),
            (0, b"PK\x03\x04", Container::Zip),
            (0, b"PK\x05\x06", Container::Zip),
            (0, b"PK\x07\x08", Container::Zip),
            (0, b"7z\xbc\xaf\x27\x1c", Container::SevenZip),
            (257, b"ustar", Container::Tar),
        ];
        let has =
            |at: usize, mark: &[u8]| start.get(at..).is_some_and(|rest| rest.starts_with(mark));
        MARKS
            .iter()
            .find(|(at, mark, _)| has(*at, mark))
            .map(|&(.., container)| container)
    }

    /// Its name in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
            Self::Xz => "xz",
            Self::Zip => "zip",
            Self::SevenZip => "7z",
            Self::Tar => "tar",
        }
    }
}

/// The kind of a file by its content. Its name does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Packing {
    /// It is an archive of this kind.
    Archive(ArchiveKind),
    /// It is one file in gzip, zstd or xz.
    OneFile,
    /// It is not in a known container.
    Nothing,
}

impl Packing {
    /// Looks at the beginning of a file, and of what is packed in it.
    ///
    /// # Errors
    /// If the file cannot be read. Damage after its first bytes is not an error here.
    pub fn of_content(mut source: impl Read) -> io::Result<Self> {
        let start = start_of(&mut source)?;
        Ok(match Container::of_start(&start) {
            Some(Container::Zip) => Self::Archive(ArchiveKind::Zip),
            Some(Container::SevenZip) => Self::Archive(ArchiveKind::SevenZip),
            Some(Container::Tar) => Self::Archive(ArchiveKind::Tar),
            Some(stream @ (Container::Gzip | Container::Zstd | Container::Xz)) => {
                let packed_tar = match stream {
                    Container::Gzip => ArchiveKind::TarGz,
                    Container::Zstd => ArchiveKind::TarZst,
                    _ => ArchiveKind::TarXz,
                };
                let inner = decoded(stream, (&start[..]).chain(source))
                    .and_then(|mut inner| start_of(&mut inner));
                let is_tar =
                    inner.is_ok_and(|start| Container::of_start(&start) == Some(Container::Tar));
                if is_tar {
                    Self::Archive(packed_tar)
                } else {
                    Self::OneFile
                }
            }
            None => Self::Nothing,
        })
    }
}

/// The first bytes of a source.
fn start_of(source: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut start = Vec::with_capacity(LOOK_BYTES);
    source.take(LOOK_BYTES as u64).read_to_end(&mut start)?;
    Ok(start)
}

/// The content of a stream. Archives of several files are not streams, and are not decoded.
pub(super) fn decoded<'a>(
    container: Container,
    source: impl Read + 'a,
) -> io::Result<Box<dyn Read + 'a>> {
    Ok(match container {
        Container::Gzip => Box::new(flate2::read::MultiGzDecoder::new(source)),
        Container::Zstd => Box::new(ZstdReader::new(source)),
        Container::Xz => Box::new(lzma_rust2::XzReader::new_mem_limit(
            source,
            true,
            MAX_DICTIONARY_KIB,
        )),
        Container::Zip | Container::SevenZip | Container::Tar => Box::new(source),
    })
}
