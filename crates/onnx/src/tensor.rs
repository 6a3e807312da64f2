//! Defines the declarations of a model's tensors, and the tensors that go in and come out.

use std::fmt;

/// The declaration of a tensor by the model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TensorSpec {
    /// Its name.
    pub name: String,
    /// The type of its numbers.
    pub element: Element,
    /// Its dimensions. A dimension that depends on the input is `None`.
    pub shape: Vec<Option<usize>>,
}

/// The type of the numbers of a tensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Element {
    /// Floating-point numbers of 32 bits.
    F32,
    /// Whole numbers of 64 bits.
    I64,
    /// A type that this crate neither writes nor reads, by its name.
    Other(String),
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::F32 => "float32",
            Self::I64 => "int64",
            Self::Other(name) => name,
        })
    }
}

impl fmt::Display for TensorSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            name,
            element,
            shape,
        } = self;
        write!(f, "`{name}` {element} {}", Dimensions(shape))
    }
}

/// Dimensions for messages, with `?` for one that is not fixed: `[1, ?, 6]`.
pub(crate) struct Dimensions<'a>(pub(crate) &'a [Option<usize>]);

impl fmt::Display for Dimensions<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = |size: &Option<usize>| size.map_or("?".to_owned(), |size| size.to_string());
        let sizes: Vec<String> = self.0.iter().map(text).collect();
        write!(f, "[{}]", sizes.join(", "))
    }
}

/// A tensor that goes into a model.
#[derive(Clone, Debug, PartialEq)]
pub struct InputTensor {
    /// The name of the input.
    pub name: String,
    /// The dimensions. Their product is the number of values.
    pub shape: Vec<usize>,
    /// The values in row-major order.
    pub values: InputValues,
}

/// The values of a tensor that goes into a model.
#[derive(Clone, Debug, PartialEq)]
pub enum InputValues {
    /// Of type `float32`.
    F32(Vec<f32>),
    /// Of type `int64`.
    I64(Vec<i64>),
}

/// A tensor of type `float32` that came out of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct OutputTensor {
    /// The dimensions. Their product is the number of values.
    pub shape: Vec<usize>,
    /// The values in row-major order.
    pub values: Vec<f32>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_declared_tensor_is_one_line() {
        let spec = TensorSpec {
            name: "points".to_owned(),
            element: Element::F32,
            shape: vec![Some(1), None, Some(6)],
        };
        assert_eq!(spec.to_string(), "`points` float32 [1, ?, 6]");
    }
}
