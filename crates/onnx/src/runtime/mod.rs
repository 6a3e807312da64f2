//! The runtimes that can run a model, and which one is taken.
//!
//! A config names one: `tract`, or the path of a library of ONNX Runtime. If it names none, ONNX Runtime is taken if the
//! system's loader finds it, and otherwise tract if it is built in.

#[cfg(feature = "ort")]
mod onnx_runtime;
#[cfg(feature = "tract")]
mod tract;

use crate::error::OnnxError;
use crate::model::Model;

/// The name of the runtime in Rust.
const TRACT: &str = "tract";

/// What a message adds if the runtime in Rust can be built in.
const BUILD_TRACT: &str = if cfg!(feature = "tract") {
    ""
} else {
    ", or build the program with the cargo feature `tract`"
};

/// The model in these bytes, ready to run. `path` is how messages name it.
///
/// `runtime` is `tract`, the path of a library of ONNX Runtime, or `None` for what there is: the library that the system's
/// loader finds, and otherwise tract if it is built in.
///
/// # Errors
/// If there is no such runtime, or it cannot read the model.
pub fn open_model(
    path: &str,
    bytes: Vec<u8>,
    runtime: Option<&str>,
) -> Result<Box<dyn Model>, OnnxError> {
    match runtime {
        Some(TRACT) => by_tract(path, &bytes),
        Some(library) => by_onnx_runtime(path, bytes, library),
        None => by_any(path, bytes),
    }
}

/// The file name of ONNX Runtime's library on this system, which the system's loader may find.
pub(crate) fn library_name() -> String {
    format!(
        "{}onnxruntime{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    )
}

fn by_any(path: &str, bytes: Vec<u8>) -> Result<Box<dyn Model>, OnnxError> {
    match by_onnx_runtime(path, bytes.clone(), &library_name()) {
        Err(OnnxError::Library { .. } | OnnxError::NoRuntime { .. }) if cfg!(feature = "tract") => {
            by_tract(path, &bytes)
        }
        Err(OnnxError::Library { reason, .. }) => Err(OnnxError::NoRuntime {
            model: path.to_owned(),
            reason,
            tract: BUILD_TRACT,
        }),
        opened => opened,
    }
}

#[cfg(feature = "ort")]
fn by_onnx_runtime(path: &str, bytes: Vec<u8>, library: &str) -> Result<Box<dyn Model>, OnnxError> {
    let model = onnx_runtime::OnnxRuntimeModel::open(path, bytes, library)?;
    Ok(Box::new(model))
}

#[cfg(not(feature = "ort"))]
fn by_onnx_runtime(
    path: &str,
    _bytes: Vec<u8>,
    _library: &str,
) -> Result<Box<dyn Model>, OnnxError> {
    Err(OnnxError::NoRuntime {
        model: path.to_owned(),
        reason: "this program was built without the cargo feature `ort`, which loads ONNX Runtime"
            .to_owned(),
        tract: BUILD_TRACT,
    })
}

#[cfg(feature = "tract")]
fn by_tract(path: &str, bytes: &[u8]) -> Result<Box<dyn Model>, OnnxError> {
    Ok(Box::new(tract::TractModel::open(path, bytes)?))
}

#[cfg(not(feature = "tract"))]
fn by_tract(path: &str, _bytes: &[u8]) -> Result<Box<dyn Model>, OnnxError> {
    Err(OnnxError::NoRuntime {
        model: path.to_owned(),
        reason: "this program was built without the cargo feature `tract`".to_owned(),
        tract: BUILD_TRACT,
    })
}
