//! Reads arrays from the caller: lists, NumPy arrays, or tensors in CPU memory.

use crate::errors::usage;
use numpy::{Element, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::fmt::Display;

/// A vector of integers of any type.
///
/// # Errors
/// `UsageError` with the name if it is not such a vector, or a number does not fit in 32 bits.
pub(crate) fn labels(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<i32>> {
    let array = of_kind(name, given, "iu", 1, "whole numbers")?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    // The sign bit of one type is the highest bit of the other.
    if kind == "u" {
        narrowed::<u64>(name, &converted(&array, "uint64")?)
    } else {
        narrowed::<i64>(name, &converted(&array, "int64")?)
    }
}

/// The numbers of a vector of this type, if each fits in 32 bits.
fn narrowed<T: Element + Copy + TryInto<i32> + Display>(
    name: &str,
    array: &Bound<'_, PyAny>,
) -> PyResult<Vec<i32>> {
    let wide: PyReadonlyArray1<'_, T> = array.extract()?;
    let narrowed = |&label: &T| {
        label
            .try_into()
            .map_err(|_| usage(format!("{name}: {label} does not fit in 32 bits")))
    };
    wide.as_array().iter().map(narrowed).collect()
}

/// The values of a matrix of finite numbers, row by row, and the length of a row.
///
/// # Errors
/// `UsageError` with the name if it is not such a matrix.
pub(crate) fn matrix(name: &str, given: &Bound<'_, PyAny>) -> PyResult<(Vec<f32>, usize)> {
    let array = of_kind(name, given, "f", 2, "floating-point numbers")?;
    let array = converted(&array, "float32")?;
    let rows: PyReadonlyArray2<'_, f32> = array.extract()?;
    let dim = rows.shape()[1];
    if dim == 0 {
        return Err(usage(format!("{name}: its rows are empty")));
    }
    let values: Vec<f32> = rows.as_array().iter().copied().collect();
    match values.iter().position(|x| !x.is_finite()) {
        Some(at) => Err(usage(format!(
            "{name}: row {} contains {}",
            at / dim,
            values[at]
        ))),
        None => Ok((values, dim)),
    }
}

/// Rows of three finite numbers.
///
/// # Errors
/// `UsageError` with the name if it is not such a matrix.
pub(crate) fn triples(name: &str, given: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; 3]>> {
    let (values, dim) = matrix(name, given)?;
    if dim != 3 {
        return Err(usage(format!(
            "{name}: it must have three columns, and it has {dim}"
        )));
    }
    Ok(values.as_chunks().0.to_vec())
}

/// The array, if its type is one of these kinds and it has this number of dimensions.
fn of_kind<'py>(
    name: &str,
    given: &Bound<'py, PyAny>,
    kinds: &str,
    n_dimensions: usize,
    expected: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let array = given
        .py()
        .import("numpy")?
        .call_method1("asarray", (given,))?;
    let dtype = array.getattr("dtype")?;
    let kind: String = dtype.getattr("kind")?.extract()?;
    if !kinds.contains(&kind) {
        return Err(usage(format!(
            "{name}: it must contain {expected}, and its type is {dtype}"
        )));
    }
    let found: usize = array.getattr("ndim")?.extract()?;
    if found != n_dimensions {
        let shape = array.getattr("shape")?;
        return Err(usage(format!(
            "{name}: it must have {n_dimensions} dimensions, and its shape is {shape}"
        )));
    }
    Ok(array)
}

fn converted<'py>(array: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    let options = PyDict::new(array.py());
    options.set_item("copy", false)?;
    array.call_method("astype", (dtype,), Some(&options))
}
