//! Defines a table: named columns of equal length, whose cells are values or lists of values.

use std::borrow::Cow;
use std::collections::BTreeSet;

/// A text in a cell. Names that the program knows are borrowed.
pub type Text = Cow<'static, str>;

/// A cell of a column of lists: no list, or a list in which elements may be missing.
pub type ListCell<T> = Option<Vec<Option<T>>>;

/// The reason why columns do not make a table, or why a table does not have the requested data.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// Two columns have the same name.
    #[error("two columns are named `{0}`")]
    RepeatedColumn(String),
    /// A column has another number of rows than the first one.
    #[error("column `{column}` has {found} rows for {expected}")]
    Length {
        /// The column.
        column: String,
        /// The number of its rows.
        found: usize,
        /// The number of rows of the first column.
        expected: usize,
    },
    /// There is no such column.
    #[error("the table has no column `{0}`")]
    MissingColumn(String),
    /// The column has other data.
    #[error("column `{column}` does not hold {expected}")]
    OtherType {
        /// The column.
        column: String,
        /// The requested data.
        expected: String,
    },
}

/// The values of a column, one after the other. A missing value is `None`.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Elements {
    /// Signed integers of 32 bits.
    I32(Vec<Option<i32>>),
    /// Unsigned integers of 64 bits.
    U64(Vec<Option<u64>>),
    /// Numbers of 64 bits.
    F64(Vec<Option<f64>>),
    /// Texts.
    Text(Vec<Option<Text>>),
}

impl Elements {
    /// The number of values, including missing ones.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::I32(values) => values.len(),
            Self::U64(values) => values.len(),
            Self::F64(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there is no value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A type that a cell, or an element of a list, can have.
pub trait Element: Sized {
    /// The name of the type in errors.
    const NAME: &'static str;

    /// The values as those of a column.
    fn into_elements(values: Vec<Option<Self>>) -> Elements;

    /// The values of a column. Returns `None` if it has another type.
    fn from_elements(elements: Elements) -> Option<Vec<Option<Self>>>;
}

macro_rules! element {
    ($type:ty, $variant:ident, $name:literal) => {
        impl Element for $type {
            const NAME: &'static str = $name;

            fn into_elements(values: Vec<Option<Self>>) -> Elements {
                Elements::$variant(values)
            }

            fn from_elements(elements: Elements) -> Option<Vec<Option<Self>>> {
                match elements {
                    Elements::$variant(values) => Some(values),
                    _ => None,
                }
            }
        }
    };
}

element!(i32, I32, "32-bit integers");
element!(u64, U64, "unsigned 64-bit integers");
element!(f64, F64, "numbers");
element!(Text, Text, "texts");

/// A named column.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub(crate) name: String,
    /// The length of each row's list, `None` for a row without a list; `None` for a column of single values.
    pub(crate) lengths: Option<Vec<Option<usize>>>,
    pub(crate) elements: Elements,
}

impl Column {
    /// A column with one value per row.
    #[must_use]
    pub fn of_cells<T: Element>(
        name: impl Into<String>,
        cells: impl IntoIterator<Item = Option<T>>,
    ) -> Self {
        Self {
            name: name.into(),
            lengths: None,
            elements: T::into_elements(cells.into_iter().collect()),
        }
    }

    /// A column with one list per row.
    #[must_use]
    pub fn of_lists<T: Element>(
        name: impl Into<String>,
        lists: impl IntoIterator<Item = ListCell<T>>,
    ) -> Self {
        let mut lengths = Vec::new();
        let mut elements = Vec::new();
        for list in lists {
            lengths.push(list.as_ref().map(Vec::len));
            elements.extend(list.into_iter().flatten());
        }
        Self {
            name: name.into(),
            lengths: Some(lengths),
            elements: T::into_elements(elements),
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The number of its rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.lengths
            .as_ref()
            .map_or_else(|| self.elements.len(), Vec::len)
    }
}

/// Columns of equal length with different names, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    columns: Vec<Column>,
}

impl Table {
    /// Joins columns to a table.
    ///
    /// # Errors
    /// If two columns share a name, or have different numbers of rows.
    pub fn new(columns: Vec<Column>) -> Result<Self, TableError> {
        let expected = columns.first().map_or(0, Column::n_rows);
        let mut names = BTreeSet::new();
        for column in &columns {
            if !names.insert(&column.name) {
                return Err(TableError::RepeatedColumn(column.name.clone()));
            }
            if column.n_rows() != expected {
                return Err(TableError::Length {
                    column: column.name.clone(),
                    found: column.n_rows(),
                    expected,
                });
            }
        }
        Ok(Self { columns })
    }

    /// The columns, in their order.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.columns.first().map_or(0, Column::n_rows)
    }

    /// Takes a column of single values out of the table.
    ///
    /// # Errors
    /// If there is no such column, or it has lists or another type.
    pub fn take_cells<T: Element>(&mut self, name: &str) -> Result<Vec<Option<T>>, TableError> {
        let column = self.take(name)?;
        let other = || other_type(name, T::NAME.to_owned());
        if column.lengths.is_some() {
            return Err(other());
        }
        T::from_elements(column.elements).ok_or_else(other)
    }

    /// Takes a column of lists out of the table.
    ///
    /// # Errors
    /// If there is no such column, or it has single values or another type.
    pub fn take_lists<T: Element>(&mut self, name: &str) -> Result<Vec<ListCell<T>>, TableError> {
        let column = self.take(name)?;
        let other = || other_type(name, format!("lists of {}", T::NAME));
        let lengths = column.lengths.ok_or_else(other)?;
        let mut elements = T::from_elements(column.elements)
            .ok_or_else(other)?
            .into_iter();
        let mut list = |length: usize| elements.by_ref().take(length).collect();
        Ok(lengths
            .into_iter()
            .map(|length| length.map(&mut list))
            .collect())
    }

    fn take(&mut self, name: &str) -> Result<Column, TableError> {
        let position = self.columns.iter().position(|column| column.name == name);
        let position = position.ok_or_else(|| TableError::MissingColumn(name.to_owned()))?;
        Ok(self.columns.remove(position))
    }
}

fn other_type(column: &str, expected: String) -> TableError {
    TableError::OtherType {
        column: column.to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_columns() -> Table {
        let ids = Column::of_cells("id", [Some(1_u64), None]);
        let lists = Column::of_lists("parts", [Some(vec![Some(3), None]), None]);
        Table::new(vec![ids, lists]).unwrap()
    }

    #[test]
    fn columns_are_read_once_and_by_their_type() {
        let mut table = two_columns();
        assert_eq!(table.n_rows(), 2);
        assert_eq!(table.take_cells::<u64>("id"), Ok(vec![Some(1), None]));
        assert_eq!(
            table.take_cells::<u64>("id"),
            Err(TableError::MissingColumn("id".to_owned()))
        );
        assert_eq!(
            table.take_lists::<i32>("parts"),
            Ok(vec![Some(vec![Some(3), None]), None])
        );
    }

    #[test]
    fn a_column_of_another_type_is_named() {
        let message = |error: TableError| error.to_string();
        assert_eq!(
            two_columns().take_cells::<Text>("id").map_err(message),
            Err("column `id` does not hold texts".to_owned())
        );
        assert_eq!(
            two_columns().take_cells::<i32>("parts").map_err(message),
            Err("column `parts` does not hold 32-bit integers".to_owned())
        );
        assert_eq!(
            two_columns().take_lists::<u64>("id").map_err(message),
            Err("column `id` does not hold lists of unsigned 64-bit integers".to_owned())
        );
    }

    #[test]
    fn columns_that_do_not_fit_are_refused() {
        let column = |name: &str, n: usize| Column::of_cells(name, vec![Some(0); n]);
        let length = TableError::Length {
            column: "b".to_owned(),
            found: 3,
            expected: 2,
        };
        assert_eq!(
            Table::new(vec![column("a", 2), column("b", 3)]),
            Err(length)
        );
        assert_eq!(
            Table::new(vec![column("a", 2), column("a", 2)]),
            Err(TableError::RepeatedColumn("a".to_owned()))
        );
    }
}
