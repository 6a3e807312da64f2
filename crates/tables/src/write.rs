//! Writes a table as the bytes of a Parquet file.

use crate::parquet_file::{
    CELL_IS_THERE, ELEMENT_IS_THERE, EMPTY_LIST, NO_ELEMENT, NO_LIST, StoredType, path_of,
    schema_of,
};
use crate::table::{Column, Elements, Table};
use parquet::basic::{Compression, Encoding, GzipLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int32Type, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A table cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the table cannot be written as Parquet: {0}")]
pub struct ParquetWriteError(String);

impl From<ParquetError> for ParquetWriteError {
    fn from(error: ParquetError) -> Self {
        Self(error.to_string())
    }
}

/// The bytes of a Parquet file with one row group. `metadata` becomes its key-value metadata, in the order of the keys.
///
/// Integers are stored as differences, and all pages are packed by gzip. The bytes depend only on the arguments.
///
/// # Errors
/// If the file would pass the limits of the format.
pub fn table_to_parquet(
    table: &Table,
    metadata: &BTreeMap<String, String>,
) -> Result<Vec<u8>, ParquetWriteError> {
    let schema = schema_of(table.columns())?;
    let properties = Arc::new(properties(table.columns(), metadata)?);
    let mut file = SerializedFileWriter::new(Vec::new(), schema, properties)?;
    let mut group = file.next_row_group()?;
    for column in table.columns() {
        // The schema has one leaf per column, so there is one writer per column.
        if let Some(mut writer) = group.next_column()? {
            write_column(&mut writer, column)?;
            writer.close()?;
        }
    }
    group.close()?;
    Ok(file.into_inner()?)
}

fn properties(
    columns: &[Column],
    metadata: &BTreeMap<String, String>,
) -> Result<WriterProperties, ParquetError> {
    let entry = |(key, value): (&String, &String)| KeyValue::new(key.clone(), value.clone());
    let mut properties = WriterProperties::builder()
        .set_created_by(concat!("partprobe ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_compression(Compression::GZIP(GzipLevel::try_new(6)?))
        .set_statistics_enabled(EnabledStatistics::Chunk)
        .set_key_value_metadata(Some(metadata.iter().map(entry).collect()));
    for column in columns {
        let path = path_of(column);
        if matches!(
            StoredType::of(&column.elements),
            StoredType::I32 | StoredType::U64
        ) {
            properties = properties
                .set_column_dictionary_enabled(path.clone(), false)
                .set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
        }
    }
    Ok(properties.build())
}

fn write_column(
    writer: &mut SerializedColumnWriter<'_>,
    column: &Column,
) -> Result<(), ParquetError> {
    let Column {
        lengths, elements, ..
    } = column;
    let lengths = lengths.as_deref();
    match elements {
        Elements::I32(values) => {
            write_values::<Int32Type, _>(writer, lengths, values, |&value| value)
        }
        Elements::U64(values) => {
            write_values::<Int64Type, _>(writer, lengths, values, |&value| value.cast_signed())
        }
        Elements::F64(values) => {
            write_values::<DoubleType, _>(writer, lengths, values, |&value| value)
        }
        Elements::Text(values) => {
            write_values::<ByteArrayType, _>(writer, lengths, values, |text| {
                ByteArray::from(text.as_bytes())
            })
        }
    }
}

fn write_values<T: DataType, V>(
    writer: &mut SerializedColumnWriter<'_>,
    lengths: Option<&[Option<usize>]>,
    values: &[Option<V>],
    stored: impl Fn(&V) -> T::T,
) -> Result<(), ParquetError> {
    let there: Vec<T::T> = values.iter().flatten().map(stored).collect();
    let writer = writer.typed::<T>();
    match lengths {
        None => {
            let is_there = |value: &Option<V>| i16::from(value.is_some()) * CELL_IS_THERE;
            let definition: Vec<i16> = values.iter().map(is_there).collect();
            writer.write_batch(&there, Some(&definition), None)?;
        }
        Some(lengths) => {
            let levels = ListLevels::of(lengths, values);
            writer.write_batch(&there, Some(&levels.definition), Some(&levels.repetition))?;
        }
    }
    Ok(())
}

/// The levels of the format, which store the beginnings of lists and the missing values.
#[derive(Default)]
struct ListLevels {
    definition: Vec<i16>,
    repetition: Vec<i16>,
}

impl ListLevels {
    fn of<V>(lengths: &[Option<usize>], values: &[Option<V>]) -> Self {
        let mut levels = Self::default();
        let mut values = values.iter();
        for length in lengths {
            match *length {
                None => levels.push(NO_LIST, true),
                Some(0) => levels.push(EMPTY_LIST, true),
                Some(length) => {
                    for (position, value) in values.by_ref().take(length).enumerate() {
                        let level = match value {
                            Some(_) => ELEMENT_IS_THERE,
                            None => NO_ELEMENT,
                        };
                        levels.push(level, position == 0);
                    }
                }
            }
        }
        levels
    }

    fn push(&mut self, definition: i16, begins_row: bool) {
        self.definition.push(definition);
        self.repetition.push(i16::from(!begins_row));
    }
}
