//! Defines arrays like those of NumPy: a shape and row-major values of one type.

use crate::numpy::half::Half;

/// The values of an array, in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// `float16`.
    F16(Vec<Half>),
    /// `float32`.
    F32(Vec<f32>),
    /// `float64`.
    F64(Vec<f64>),
    /// `int32`.
    I32(Vec<i32>),
    /// `int64`.
    I64(Vec<i64>),
    /// `uint8`.
    U8(Vec<u8>),
    /// `uint32`.
    U32(Vec<u32>),
    /// `uint64`.
    U64(Vec<u64>),
    /// `bool`.
    Bool(Vec<bool>),
    /// Unicode text. NumPy drops trailing zero characters, so a round trip through a file also drops them.
    Text(Vec<String>),
}

/// A row-major array.
///
/// Invariant: the number of values is the product of the shape. An empty shape is a scalar.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    shape: Vec<usize>,
    values: Values,
}

/// A type whose values an [`Array`] can hold.
pub trait Element: Sized + Clone {
    /// The name of the type in NumPy.
    const NAME: &'static str;

    /// Wraps values of this type.
    fn wrap(values: Vec<Self>) -> Values;

    /// The values, if they are of this type.
    fn unwrap_from(values: Values) -> Option<Vec<Self>>;
}

macro_rules! elements {
    ($($variant:ident: $element:ty = $name:literal,)*) => {
        $(impl Element for $element {
            const NAME: &'static str = $name;

            fn wrap(values: Vec<Self>) -> Values {
                Values::$variant(values)
            }

            fn unwrap_from(values: Values) -> Option<Vec<Self>> {
                match values {
                    Values::$variant(values) => Some(values),
                    _ => None,
                }
            }
        })*

        impl Values {
            /// The number of values.
            #[must_use]
            pub fn len(&self) -> usize {
                match self {
                    $(Self::$variant(values) => values.len(),)*
                }
            }

            /// The name of the type in NumPy.
            #[must_use]
            pub fn type_name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => <$element>::NAME,)*
                }
            }
        }
    };
}

elements! {
    F16: Half = "float16",
    F32: f32 = "float32",
    F64: f64 = "float64",
    I32: i32 = "int32",
    I64: i64 = "int64",
    U8: u8 = "uint8",
    U32: u32 = "uint32",
    U64: u64 = "uint64",
    Bool: bool = "bool",
    Text: String = "str",
}

impl Values {
    /// Whether there is no value.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Array {
    /// A single value, with an empty shape.
    #[must_use]
    pub fn scalar<T: Element>(value: T) -> Self {
        Self {
            shape: Vec::new(),
            values: T::wrap(vec![value]),
        }
    }

    /// One dimension.
    #[must_use]
    pub fn vector<T: Element>(values: Vec<T>) -> Self {
        Self {
            shape: vec![values.len()],
            values: T::wrap(values),
        }
    }

    /// Two dimensions: one row per entry.
    #[must_use]
    pub fn rows<T: Element + Copy, const N: usize>(rows: &[[T; N]]) -> Self {
        Self {
            shape: vec![rows.len(), N],
            values: T::wrap(rows.as_flattened().to_vec()),
        }
    }

    /// Three dimensions: one block per entry.
    #[must_use]
    pub fn blocks<T: Element + Copy, const M: usize, const N: usize>(
        blocks: &[[[T; N]; M]],
    ) -> Self {
        let values = blocks.as_flattened().as_flattened().to_vec();
        Self {
            shape: vec![blocks.len(), M, N],
            values: T::wrap(values),
        }
    }

    /// Makes an array of values with a shape. Returns `None` if the shape does not fit the number of values.
    #[must_use]
    pub fn with_shape(shape: Vec<usize>, values: Values) -> Option<Self> {
        let count = shape
            .iter()
            .try_fold(1usize, |count, &side| count.checked_mul(side))?;
        (count == values.len()).then_some(Self { shape, values })
    }

    /// The length of each dimension.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The values.
    #[must_use]
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Returns the values and consumes the array.
    #[must_use]
    pub fn into_values(self) -> Values {
        self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_must_count_its_values() {
        assert_eq!(Array::rows(&[[1u8, 2], [3, 4]]).shape(), [2, 2]);
        assert!(Array::with_shape(vec![2, 3], Values::U8(vec![0; 6])).is_some());
        assert!(Array::with_shape(vec![2, 2], Values::U8(vec![0; 6])).is_none());
        assert!(Array::with_shape(vec![usize::MAX, 2], Values::U8(Vec::new())).is_none());
    }
}
