//! Converts the arrays of carriers and samples to NumPy arrays.
//!
//! NumPy takes over the memory of an array. Integers become `int64`, so narrower ones are copied. Only `uint64` stays the same, because
//! `#` numbers may not fit into `int64`.

use numpy::{Element, PyArray1, PyArrayMethods};
use partprobe_formats::{Array, Values};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The array with the same shape and values.
pub(crate) fn numpy_array(py: Python<'_>, array: Array) -> PyResult<Bound<'_, PyAny>> {
    let shape = array.shape().to_vec();
    match array.into_values() {
        Values::F16(values) => shaped(py, values.iter().map(|x| x.to_f32()).collect(), shape),
        Values::F32(values) => shaped(py, values, shape),
        Values::F64(values) => shaped(py, values, shape),
        Values::I32(values) => shaped(py, widened(&values), shape),
        Values::I64(values) => shaped(py, values, shape),
        Values::U8(values) => shaped(py, widened(&values), shape),
        Values::U32(values) => shaped(py, widened(&values), shape),
        Values::U64(values) => shaped(py, values, shape),
        Values::Bool(values) => shaped(py, values, shape),
        Values::Text(values) => texts(py, values),
    }
}

/// The values as 64-bit numbers, which can index tensors.
pub(crate) fn widened<T: Copy + Into<i64>>(values: &[T]) -> Vec<i64> {
    values.iter().map(|&value| value.into()).collect()
}

/// Values in row-major order, with this shape.
pub(crate) fn shaped<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: Vec<usize>,
) -> PyResult<Bound<'_, PyAny>> {
    Ok(PyArray1::from_vec(py, values).reshape(shape)?.into_any())
}

/// Rows of `N` numbers.
pub(crate) fn rows<T: Element, const N: usize>(
    py: Python<'_>,
    rows: Vec<[T; N]>,
) -> PyResult<Bound<'_, PyAny>> {
    let shape = vec![rows.len(), N];
    shaped(py, rows.into_flattened(), shape)
}

fn texts(py: Python<'_>, values: Vec<String>) -> PyResult<Bound<'_, PyAny>> {
    let options = PyDict::new(py);
    options.set_item(intern!(py, "dtype"), "U")?;
    py.import(intern!(py, "numpy"))?
        .call_method(intern!(py, "array"), (values,), Some(&options))
}

/// Arrays that are made at the first access and then kept. They are read-only, because several users may share them.
#[derive(Debug)]
pub(crate) struct KeptArrays(Py<PyDict>);

impl KeptArrays {
    pub(crate) fn new(py: Python<'_>) -> Self {
        Self(PyDict::new(py).unbind())
    }

    /// The array with this name.
    ///
    /// # Errors
    /// If it cannot be made.
    pub(crate) fn get<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        make: impl FnOnce() -> PyResult<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let kept = self.0.bind(py);
        if let Some(array) = kept.get_item(name)? {
            return Ok(array);
        }
        let array = make()?;
        let options = PyDict::new(py);
        options.set_item(intern!(py, "write"), false)?;
        array.call_method(intern!(py, "setflags"), (), Some(&options))?;
        kept.set_item(name, &array)?;
        Ok(array)
    }
}
