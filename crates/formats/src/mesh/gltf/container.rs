//! Finds the JSON and the binary chunk of a glTF file.

use crate::mesh::gltf::error::GltfError;

const MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: &[u8] = b"JSON";
const BINARY_CHUNK: &[u8] = b"BIN\0";

/// The JSON, and the binary chunk if there is one.
///
/// # Errors
/// If the file is binary, and its version is not 2 or a chunk is incomplete.
pub(crate) fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), GltfError> {
    if !bytes.starts_with(MAGIC) {
        return Ok((bytes, None));
    }
    match word(bytes, 4) {
        Some(2) => {}
        Some(version) => return Err(GltfError::Version(version.to_string())),
        None => return Err(GltfError::Chunk(4)),
    }
    let json_at = 12;
    let (json, binary_at) = chunk(bytes, json_at, JSON_CHUNK).ok_or(GltfError::Chunk(json_at))?;
    if binary_at >= bytes.len() {
        return Ok((json, None));
    }
    let (binary, _) = chunk(bytes, binary_at, BINARY_CHUNK).ok_or(GltfError::Chunk(binary_at))?;
    Ok((json, Some(binary)))
}

/// The content of a chunk of this kind, and the position of the next one.
fn chunk<'a>(bytes: &'a [u8], at: usize, kind: &[u8]) -> Option<(&'a [u8], usize)> {
    let length = word(bytes, at)? as usize;
    let start = at + 8;
    let end = start.checked_add(length)?;
    let is_of_kind = bytes.get(at + 4..start)? == kind;
    is_of_kind.then_some((bytes.get(start..end)?, end))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    Some(u32::from_le_bytes(*bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u32, chunks: &[(&[u8], &[u8])]) -> Vec<u8> {
        let mut bytes = [MAGIC, &version.to_le_bytes(), &[0; 4]].concat();
        for (kind, content) in chunks {
            bytes.extend((content.len() as u32).to_le_bytes());
            bytes.extend(*kind);
            bytes.extend(*content);
        }
        bytes
    }

    #[test]
    fn json_alone_or_with_a_binary_chunk() {
        assert_eq!(chunks(b"{}"), Ok((&b"{}"[..], None)));
        let alone = file(2, &[(JSON_CHUNK, b"{}")]);
        assert_eq!(chunks(&alone), Ok((&b"{}"[..], None)));
        let both = file(2, &[(JSON_CHUNK, b"{}"), (BINARY_CHUNK, b"abc")]);
        assert_eq!(chunks(&both), Ok((&b"{}"[..], Some(&b"abc"[..]))));
    }

    #[test]
    fn what_is_cut_off_is_located() {
        let both = file(2, &[(JSON_CHUNK, b"{}"), (BINARY_CHUNK, b"abc")]);
        assert_eq!(chunks(&both[..6]), Err(GltfError::Chunk(4)));
        assert_eq!(chunks(&both[..21]), Err(GltfError::Chunk(12)));
        assert_eq!(chunks(&both[..30]), Err(GltfError::Chunk(22)));
        let wrong = file(2, &[(BINARY_CHUNK, b"{}")]);
        assert_eq!(chunks(&wrong), Err(GltfError::Chunk(12)));
        let old = file(1, &[(JSON_CHUNK, b"{}")]);
        assert_eq!(chunks(&old), Err(GltfError::Version("1".to_owned())));
    }
}
