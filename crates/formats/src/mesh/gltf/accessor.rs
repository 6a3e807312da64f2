//! Reads numbers from the buffers of a glTF file. Every count, stride and offset is compared with the bytes that are present.

use crate::mesh::gltf::document::{AccessorJson, BufferJson, Document};
use crate::mesh::gltf::error::GltfError;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::borrow::Cow;

/// The buffers of a document.
pub(crate) struct Buffers<'a> {
    document: &'a Document,
    bytes: Vec<Cow<'a, [u8]>>,
}

/// The values of an accessor, row by row.
pub(crate) struct Table {
    /// Numbers in a row.
    pub(crate) width: usize,
    pub(crate) values: Vec<f64>,
    pub(crate) component: Component,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    fn read(self, bytes: &[u8]) -> Option<f64> {
        Some(match self {
            Self::I8 => f64::from(i8::from_le_bytes(*bytes.first_chunk()?)),
            Self::U8 => f64::from(u8::from_le_bytes(*bytes.first_chunk()?)),
            Self::I16 => f64::from(i16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U16 => f64::from(u16::from_le_bytes(*bytes.first_chunk()?)),
            Self::U32 => f64::from(u32::from_le_bytes(*bytes.first_chunk()?)),
            Self::F32 => f64::from(f32::from_le_bytes(*bytes.first_chunk()?)),
        })
    }
}

impl<'a> Buffers<'a> {
    /// Finds all buffers. `read` gives the bytes of another file.
    ///
    /// # Errors
    /// If one cannot be read.
    pub(crate) fn new(
        document: &'a Document,
        binary: Option<&'a [u8]>,
        read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Self, GltfError> {
        let buffers = document.buffers.iter().enumerate();
        let bytes = buffers.map(|(index, buffer)| {
            let binary = binary.filter(|_| index == 0);
            buffer_bytes(buffer, binary, read).map_err(|reason| GltfError::Buffer { index, reason })
        });
        Ok(Self {
            document,
            bytes: bytes.collect::<Result<_, _>>()?,
        })
    }

    /// The numbers of an accessor, with one of these widths.
    ///
    /// # Errors
    /// If it does not exist, does not fit its buffer, or has another width.
    pub(crate) fn table(&self, index: usize, widths: &[usize]) -> Result<Table, GltfError> {
        let accessor = self
            .document
            .accessors
            .get(index)
            .ok_or(GltfError::Missing {
                what: "accessor",
                index,
            })?;
        let table = self.table_of(accessor);
        let refused = |reason| GltfError::Accessor { index, reason };
        let table = table.map_err(refused)?;
        if widths.contains(&table.width) {
            Ok(table)
        } else {
            Err(refused("its rows have another length"))
        }
    }

    fn table_of(&self, accessor: &AccessorJson) -> Result<Table, &'static str> {
        if accessor.sparse.is_some() {
            return Err("it is sparse; export the file without sparse accessors");
        }
        let component = Component::of_code(accessor.component_type)
            .ok_or("its component type is not in the specification")?;
        let width = match accessor.shape.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => return Err("it does not hold numbers or vectors"),
        };
        let (view, stride) = self.view(accessor)?;
        let row_size = width * component.size();
        let stride = stride.unwrap_or(row_size);
        if stride < row_size {
            return Err("its rows overlap");
        }
        let needed = match accessor.count {
            0 => Some(0),
            count => stride
                .checked_mul(count - 1)
                .and_then(|last| last.checked_add(row_size)),
        };
        let cut_off = "it is longer than its buffer";
        let needed = needed
            .filter(|&needed| needed <= view.len())
            .ok_or(cut_off)?;

        let rows = view[..needed].chunks(stride);
        let cells = rows.flat_map(|row| row[..row_size].chunks(component.size()));
        let values: Option<Vec<f64>> = cells.map(|cell| component.read(cell)).collect();
        Ok(Table {
            width,
            values: values.ok_or(cut_off)?,
            component,
        })
    }

    /// The bytes from the start of an accessor to the end of its view, and the stride if there is one.
    fn view(&self, accessor: &AccessorJson) -> Result<(&[u8], Option<usize>), &'static str> {
        let outside = "its view is outside of its buffer";
        let index = accessor.buffer_view.ok_or("it has no buffer view")?;
        let view = self
            .document
            .buffer_views
            .get(index)
            .ok_or("its buffer view does not exist")?;
        let buffer = self
            .bytes
            .get(view.buffer)
            .ok_or("its buffer does not exist")?;
        let end = view
            .byte_offset
            .checked_add(view.byte_length)
            .ok_or(outside)?;
        let bytes = buffer.get(view.byte_offset..end).ok_or(outside)?;
        let bytes = bytes.get(accessor.byte_offset..).ok_or(outside)?;
        Ok((bytes, view.byte_stride))
    }
}

/// The bytes of a buffer: from the binary chunk, from its own address, or from another file.
fn buffer_bytes<'a>(
    buffer: &BufferJson,
    binary: Option<&'a [u8]>,
    read: &dyn Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Cow<'a, [u8]>, String> {
    let Some(uri) = &buffer.uri else {
        let binary = binary.ok_or("it has no address, and the file has no binary chunk")?;
        return Ok(Cow::Borrowed(binary));
    };
    if let Some(data) = uri.strip_prefix("data:") {
        let (_, text) = data
            .split_once(";base64,")
            .ok_or("its data are not base64")?;
        let bytes = STANDARD.decode(text).map_err(|error| error.to_string())?;
        return Ok(Cow::Owned(bytes));
    }
    let is_outside = uri.starts_with(['/', '\\'])
        || uri.contains(':')
        || uri.split(['/', '\\']).any(|name| name == "..");
    if is_outside {
        return Err(format!(
            "{uri} is not in the folder of the file; put it there"
        ));
    }
    read(uri).map(Cow::Owned)
}
