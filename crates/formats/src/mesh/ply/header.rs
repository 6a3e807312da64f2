//! Reads the header of a PLY file: its encoding, and its elements with their properties.

use crate::mesh::foreign::MeshFileError;

/// The text up to `end_header`, and the bytes after it.
pub(crate) fn split_header(bytes: &[u8]) -> Result<(String, &[u8]), MeshFileError> {
    const END: &[u8] = b"end_header";
    let is_ply = bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r");
    let at = bytes
        .windows(END.len())
        .position(|window| window == END)
        .filter(|_| is_ply);
    let at = at.ok_or(MeshFileError::Kind("a PLY file"))?;
    let after = &bytes[at + END.len()..];
    let line_end = after
        .iter()
        .position(|&byte| byte == b'\n')
        .ok_or(MeshFileError::Truncated)?;
    Ok((
        String::from_utf8_lossy(&bytes[..at]).into_owned(),
        &after[line_end + 1..],
    ))
}

/// The encoding of numbers.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// The header of a file.
pub(crate) struct Header {
    pub(crate) encoding: Encoding,
    pub(crate) elements: Vec<Element>,
}

/// A table: the vertices, the faces, or another one.
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) count: usize,
    pub(crate) properties: Vec<Property>,
}

/// A column of an element.
pub(crate) struct Property {
    pub(crate) name: String,
    /// The type of the length, for a list.
    pub(crate) length: Option<Scalar>,
    pub(crate) scalar: Scalar,
}

impl Header {
    pub(crate) fn parse(text: &str) -> Result<Self, MeshFileError> {
        let mut header = Self {
            encoding: Encoding::Text,
            elements: Vec::new(),
        };
        for line in text.lines().skip(1) {
            let refused = || MeshFileError::Header(line.chars().take(80).collect());
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let scalar = |name: &str| Scalar::named(name).ok_or_else(refused);
            let property = match words.as_slice() {
                ["comment" | "obj_info", ..] | [] => continue,
                ["format", format, "1.0"] => {
                    header.encoding = Encoding::named(format).ok_or_else(refused)?;
                    continue;
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| refused())?;
                    header.elements.push(Element {
                        name: (*name).to_owned(),
                        count,
                        properties: Vec::new(),
                    });
                    continue;
                }
                ["property", "list", length, kind, name] => Property {
                    name: (*name).to_owned(),
                    length: Some(scalar(length)?),
                    scalar: scalar(kind)?,
                },
                ["property", kind, name] => Property {
                    name: (*name).to_owned(),
                    length: None,
                    scalar: scalar(kind)?,
                },
                _ => return Err(refused()),
            };
            header
                .elements
                .last_mut()
                .ok_or_else(refused)?
                .properties
                .push(property);
        }
        Ok(header)
    }
}

impl Element {
    /// The index of a property that is not a list.
    pub(crate) fn index_of(&self, name: &str) -> Option<usize> {
        self.properties
            .iter()
            .position(|property| property.name == name && property.length.is_none())
    }
}

impl Encoding {
    fn named(name: &str) -> Option<Self> {
        match name {
            "ascii" => Some(Self::Text),
            "binary_little_endian" => Some(Self::LittleEndian),
            "binary_big_endian" => Some(Self::BigEndian),
            _ => None,
        }
    }
}

/// The type of a property.
#[derive(Clone, Copy)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    /// The type of this name, in either spelling. Returns `None` if PLY has no such type.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// The number of bytes of a value.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value at the start of `bytes`, with the lowest byte first. Every type fits an `f64` exactly.
    pub(crate) fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Self::U8 => f64::from(u8::from_le_bytes(*bytes.first_chunk()?)),
            Self::I16 => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U16 => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Self::I32 => f64::from(i32::from_le_bytes(*bytes.first_chunk()?)),
            Self::U32 => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::F32 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
            Self::F64 => f64::from_le_bytes(*bytes.first_chunk()?),
        })
    }
}
