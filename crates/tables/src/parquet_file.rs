//! Defines the layout of a table in a Parquet file: the schema that writer and reader share.
//!
//! Every column may have missing values, like the columns that Arrow writes. A list is the three-level group of the format: the
//! group may be missing, and each element may be missing.

use crate::table::{Column, Elements};
use parquet::basic::{ConvertedType, LogicalType, Repetition, Type as PhysicalType};
use parquet::errors::ParquetError;
use parquet::schema::types::{ColumnPath, Type, TypePtr};
use std::sync::Arc;

/// The names of the two inner levels of a list, as the format prescribes them.
pub(crate) const LIST_LEVELS: [&str; 2] = ["list", "element"];
/// The definition level of a value in a column of single values.
pub(crate) const CELL_IS_THERE: i16 = 1;
/// The definition levels of a list column: no list, an empty list, a missing element, an element.
pub(crate) const NO_LIST: i16 = 0;
pub(crate) const EMPTY_LIST: i16 = 1;
pub(crate) const NO_ELEMENT: i16 = 2;
pub(crate) const ELEMENT_IS_THERE: i16 = 3;

/// The types that columns can have in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StoredType {
    I32,
    U64,
    F64,
    Text,
}

impl StoredType {
    pub(crate) fn of(elements: &Elements) -> Self {
        match elements {
            Elements::I32(_) => Self::I32,
            Elements::U64(_) => Self::U64,
            Elements::F64(_) => Self::F64,
            Elements::Text(_) => Self::Text,
        }
    }

    /// The type of a leaf in a schema. Returns `None` if tables of partprobe do not have this type.
    pub(crate) fn of_leaf(leaf: &Type) -> Option<Self> {
        let logical = leaf.get_basic_info().logical_type_ref();
        match (leaf.get_physical_type(), logical) {
            (PhysicalType::INT32, None) => Some(Self::I32),
            (PhysicalType::INT64, Some(logical)) if *logical == unsigned() => Some(Self::U64),
            (PhysicalType::DOUBLE, None) => Some(Self::F64),
            (PhysicalType::BYTE_ARRAY, Some(LogicalType::String)) => Some(Self::Text),
            _ => None,
        }
    }

    fn physical(self) -> PhysicalType {
        match self {
            Self::I32 => PhysicalType::INT32,
            Self::U64 => PhysicalType::INT64,
            Self::F64 => PhysicalType::DOUBLE,
            Self::Text => PhysicalType::BYTE_ARRAY,
        }
    }

    fn logical(self) -> Option<LogicalType> {
        match self {
            Self::I32 | Self::F64 => None,
            Self::U64 => Some(unsigned()),
            Self::Text => Some(LogicalType::String),
        }
    }
}

fn unsigned() -> LogicalType {
    LogicalType::integer(64, false)
}

/// The schema of a file with these columns.
pub(crate) fn schema_of(columns: &[Column]) -> Result<TypePtr, ParquetError> {
    let fields = columns.iter().map(field_of).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("schema")
        .with_fields(fields)
        .build()?;
    Ok(Arc::new(schema))
}

fn field_of(column: &Column) -> Result<TypePtr, ParquetError> {
    let stored = StoredType::of(&column.elements);
    if column.lengths.is_none() {
        return leaf(&column.name, stored);
    }
    let [list, element] = LIST_LEVELS;
    let repeated = Type::group_type_builder(list)
        .with_repetition(Repetition::REPEATED)
        .with_fields(vec![leaf(element, stored)?])
        .build()?;
    let group = Type::group_type_builder(&column.name)
        .with_repetition(Repetition::OPTIONAL)
        .with_converted_type(ConvertedType::LIST)
        .with_logical_type(Some(LogicalType::List))
        .with_fields(vec![Arc::new(repeated)])
        .build()?;
    Ok(Arc::new(group))
}

fn leaf(name: &str, stored: StoredType) -> Result<TypePtr, ParquetError> {
    let leaf = Type::primitive_type_builder(name, stored.physical())
        .with_repetition(Repetition::OPTIONAL)
        .with_logical_type(stored.logical())
        .build()?;
    Ok(Arc::new(leaf))
}

/// The path of a column's leaf in the schema.
pub(crate) fn path_of(column: &Column) -> ColumnPath {
    let mut parts = vec![column.name.clone()];
    if column.lengths.is_some() {
        parts.extend(LIST_LEVELS.map(str::to_owned));
    }
    ColumnPath::new(parts)
}
