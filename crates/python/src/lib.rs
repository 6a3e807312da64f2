//! Implements the Python module `partprobe`, which turns STEP files into labeled meshes, point samples and scores as NumPy arrays.
//!
//! It takes paths, bytes and arrays, and returns objects with NumPy arrays. Each file here contains one class or one group of
//! functions; the computations are in the libraries that they call. The package around the module is in `python/`: the
//! errors, the types for checkers (`_partprobe.pyi`), and the names that users import.
//!
//! # What it guarantees
//!
//! - Python keeps running during a computation, and Ctrl-C ends the wait for it (`background`).
//! - Integers are signed, so that `torch.from_numpy` gives indices. The only exception is `face_step_id`, which is a name.
//! - An array owns its numbers: they are not copied between the call that makes it and NumPy. Arrays of a carrier and of a
//!   sample are made at the first access, kept, and read-only. The arrays of a data set's items are new and writable.
//! - Bad input raises an exception that names the file, and the entity if there is one. A panic becomes an exception, too.
//!
//! # What it does not do
//!
//! It does not run the program `partprobe`. The wheel contains the real program as a separate file. A program inside of Python
//! could not start its label workers, which are copies of the running executable: this would be Python. It would also share its
//! signals, memory limits and allocator with the interpreter. The price is that the wheel contains the libraries twice.

#![allow(
    rustdoc::invalid_html_tags,
    reason = "docstrings are Python's: an object is shown as <partprobe.Carrier …>"
)]

mod arrays;
mod background;
mod carrier;
mod dataset;
mod errors;
mod given_arrays;
mod given_numbers;
mod graph;
mod input;
mod label;
mod label_options;
mod lists;
mod model;
mod near_name;
mod picture;
mod sample;
mod score;

use pyo3::prelude::*;

/// The compiled part of the package `partprobe`.
#[pymodule]
mod _partprobe {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::carrier::PyCarrier;
    #[pymodule_export]
    use crate::dataset::PyDataset;
    #[pymodule_export]
    use crate::label::{label, label_all};
    #[pymodule_export]
    use crate::lists::{label_options, metrics, sources, synth};
    #[pymodule_export]
    use crate::model::PyModel;
    #[pymodule_export]
    use crate::sample::PySample;
    #[pymodule_export]
    use crate::score::score;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
