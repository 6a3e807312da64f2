//! Reads the Parquet files that [`table_to_parquet`](crate::table_to_parquet) writes.
//!
//! Files of other writers are refused if their columns have other types or other levels.

use crate::parquet_file::{
    CELL_IS_THERE, ELEMENT_IS_THERE, EMPTY_LIST, LIST_LEVELS, NO_LIST, StoredType,
};
use crate::table::{Column, Elements, Table, TableError, Text};
use bytes::Bytes;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType};
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// The number of rows that are decoded at a time. So memory is only allocated for rows that really exist in the file.
const ROWS_AT_A_TIME: usize = 4096;

/// The reason why bytes are not a table.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ParquetReadError {
    /// The bytes are damaged, or are not Parquet.
    #[error("the Parquet file is damaged: {0}")]
    Damaged(String),
    /// The file has no such column.
    #[error("the Parquet file has no column `{0}`")]
    MissingColumn(String),
    /// A column has a type that partprobe does not write.
    #[error("column `{0}` of the Parquet file was not written by partprobe")]
    ForeignColumn(String),
    /// The columns do not make a table.
    #[error(transparent)]
    Table(#[from] TableError),
}

impl From<ParquetError> for ParquetReadError {
    fn from(error: ParquetError) -> Self {
        Self::Damaged(error.to_string())
    }
}

/// A table with the key-value metadata of its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParquetTable {
    /// The requested columns.
    pub table: Table,
    /// The metadata by key.
    pub metadata: BTreeMap<String, String>,
}

/// The columns of a file that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Columns<'a> {
    /// All of them.
    All,
    /// Those with these names, in this order.
    Named(&'a [&'a str]),
}

/// The table in the bytes of a Parquet file.
///
/// # Errors
/// If the bytes are damaged, or a column is missing or of a type that partprobe does not write.
pub fn table_from_parquet(
    bytes: Vec<u8>,
    columns: Columns<'_>,
) -> Result<ParquetTable, ParquetReadError> {
    // The decoder of the format may panic on damaged pages, which must not end the program.
    catch_unwind(AssertUnwindSafe(|| read(bytes, columns))).unwrap_or_else(|_| {
        Err(ParquetReadError::Damaged(
            "its pages cannot be decoded".to_owned(),
        ))
    })
}

fn read(bytes: Vec<u8>, columns: Columns<'_>) -> Result<ParquetTable, ParquetReadError> {
    let file = SerializedFileReader::new(Bytes::from(bytes))?;
    let info = file.metadata().file_metadata();
    let entries = info.key_value_metadata().into_iter().flatten();
    let metadata = entries
        .map(|entry| (entry.key.clone(), entry.value.clone().unwrap_or_default()))
        .collect();
    let leaves = info.schema_descr().columns();
    let position = |name: &str| {
        leaves
            .iter()
            .position(|leaf| leaf.path().parts()[0] == name)
            .ok_or_else(|| ParquetReadError::MissingColumn(name.to_owned()))
    };
    let wanted: Vec<usize> = match columns {
        Columns::All => (0..leaves.len()).collect(),
        Columns::Named(names) => names
            .iter()
            .map(|name| position(name))
            .collect::<Result<_, _>>()?,
    };
    let read_column = |&leaf: &usize| {
        let mut column = PartialColumn::of(&leaves[leaf])?;
        for group in 0..file.num_row_groups() {
            column.read(file.get_row_group(group)?.get_column_reader(leaf)?)?;
        }
        Ok(column.column)
    };
    let columns: Vec<Column> = wanted
        .iter()
        .map(read_column)
        .collect::<Result<_, ParquetReadError>>()?;
    let table = Table::new(columns)?;
    Ok(ParquetTable { table, metadata })
}

/// A column with the rows that were read so far.
struct PartialColumn {
    column: Column,
}

impl PartialColumn {
    /// The column of a leaf, without a row.
    fn of(leaf: &ColumnDescriptor) -> Result<Self, ParquetReadError> {
        let parts = leaf.path().parts();
        let name = &parts[0];
        let foreign = || ParquetReadError::ForeignColumn(name.clone());
        let inner: Vec<&str> = parts[1..].iter().map(String::as_str).collect();
        let levels = (leaf.max_def_level(), leaf.max_rep_level());
        let is_list = match levels {
            (CELL_IS_THERE, 0) if inner.is_empty() => false,
            (ELEMENT_IS_THERE, 1) if inner == LIST_LEVELS => true,
            _ => return Err(foreign()),
        };
        let elements = match StoredType::of_leaf(leaf.self_type()).ok_or_else(foreign)? {
            StoredType::I32 => Elements::I32(Vec::new()),
            StoredType::U64 => Elements::U64(Vec::new()),
            StoredType::F64 => Elements::F64(Vec::new()),
            StoredType::Text => Elements::Text(Vec::new()),
        };
        Ok(Self {
            column: Column {
                name: name.clone(),
                lengths: is_list.then(Vec::new),
                elements,
            },
        })
    }

    /// Adds the rows of one row group.
    fn read(&mut self, reader: ColumnReader) -> Result<(), ParquetReadError> {
        let Column {
            name,
            lengths,
            elements,
        } = &mut self.column;
        let lengths = lengths.as_mut();
        match (reader, elements) {
            (ColumnReader::Int32ColumnReader(reader), Elements::I32(values)) => {
                add_values(reader, lengths, values, Ok)
            }
            (ColumnReader::Int64ColumnReader(reader), Elements::U64(values)) => {
                add_values(reader, lengths, values, |value| Ok(value.cast_unsigned()))
            }
            (ColumnReader::DoubleColumnReader(reader), Elements::F64(values)) => {
                add_values(reader, lengths, values, Ok)
            }
            (ColumnReader::ByteArrayColumnReader(reader), Elements::Text(values)) => {
                add_values(reader, lengths, values, |value| text_of(&value))
            }
            _ => Err(ParquetReadError::ForeignColumn(name.clone())),
        }
    }
}

fn text_of(value: &ByteArray) -> Result<Text, ParquetReadError> {
    Ok(Text::Owned(value.as_utf8()?.to_owned()))
}

fn add_values<T: DataType, V>(
    mut reader: ColumnReaderImpl<T>,
    mut lengths: Option<&mut Vec<Option<usize>>>,
    elements: &mut Vec<Option<V>>,
    value_of: impl Fn(T::T) -> Result<V, ParquetReadError>,
) -> Result<(), ParquetReadError> {
    loop {
        let (mut definition, mut repetition, mut stored) = (Vec::new(), Vec::new(), Vec::new());
        let (n_rows, ..) = reader.read_records(
            ROWS_AT_A_TIME,
            Some(&mut definition),
            Some(&mut repetition),
            &mut stored,
        )?;
        if n_rows == 0 {
            return Ok(());
        }
        let mut values = stored.into_iter().map(&value_of);
        let mut next = || {
            values
                .next()
                .unwrap_or_else(|| Err(ParquetReadError::Damaged("values are missing".to_owned())))
        };
        match lengths.as_deref_mut() {
            None => {
                for level in definition {
                    let is_there = level == CELL_IS_THERE;
                    elements.push(if is_there { Some(next()?) } else { None });
                }
            }
            Some(lengths) => {
                for (level, repeats) in definition.into_iter().zip(repetition) {
                    count_element(lengths, level, repeats > 0);
                    if level > EMPTY_LIST {
                        let is_there = level == ELEMENT_IS_THERE;
                        elements.push(if is_there { Some(next()?) } else { None });
                    }
                }
            }
        }
    }
}

/// Begins a list, or adds one to the length of the last list.
fn count_element(lengths: &mut Vec<Option<usize>>, level: i16, repeats: bool) {
    match lengths.last_mut() {
        Some(last) if repeats => *last = Some(last.unwrap_or(0) + 1),
        _ => lengths.push(match level {
            NO_LIST => None,
            EMPTY_LIST => Some(0),
            _ => Some(1),
        }),
    }
}
