//! Reads whole numbers from the caller. A number that is out of range is a `UsageError` that names what it stands for.

use crate::errors::usage;
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;

/// A seed of random numbers, from 0 to 2⁶⁴ − 1.
///
/// # Errors
/// `UsageError` if it is out of this range, and `TypeError` if it is not a whole number.
pub(crate) fn seed(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    in_range("a seed must be from 0 to 2**64 - 1", given)
}

/// A seed, or `None`.
///
/// # Errors
/// As for [`seed`].
pub(crate) fn optional_seed(given: &Bound<'_, PyAny>) -> PyResult<Option<u64>> {
    if given.is_none() {
        return Ok(None);
    }
    seed(given).map(Some)
}

/// A number of things, such as points.
///
/// # Errors
/// `UsageError` if it is negative or too large for this machine, and `TypeError` if it is not a whole number.
pub(crate) fn count(given: &Bound<'_, PyAny>) -> PyResult<usize> {
    in_range("a number of things must not be negative", given)
}

/// The index of a part.
///
/// # Errors
/// `UsageError` if it is out of range, and `TypeError` if it is not a whole number.
pub(crate) fn index(given: &Bound<'_, PyAny>) -> PyResult<u64> {
    in_range("an index must be from 0 to 2**64 - 1", given)
}

/// A number of parts.
///
/// # Errors
/// `UsageError` if it is out of range, and `TypeError` if it is not a whole number.
pub(crate) fn part_count(given: &Bound<'_, PyAny>) -> PyResult<u32> {
    in_range("a number of parts must be from 0 to 2**32 - 1", given)
}

fn in_range<'py, T>(rule: &str, given: &Bound<'py, PyAny>) -> PyResult<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error = PyErr>,
{
    given.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyOverflowError>(given.py()) {
            usage(format!("{rule}, and it is {given}"))
        } else {
            error
        }
    })
}
