//! Opens a model with ONNX Runtime, whose library is loaded from the user's machine.
//!
//! The bytes of a model and the path of the library go in. Without a path, the system's loader looks for the library. Another
//! runtime implements [`Model`].

#[cfg(feature = "ort")]
mod onnx_runtime;

use crate::error::OnnxError;
use crate::model::Model;

/// The model in these bytes, ready to run. `path` is its name in messages.
///
/// `runtime` is the path of a library of ONNX Runtime, or `None` for the one that the system's loader finds.
///
/// # Errors
/// If there is no such library, or it cannot read the model.
pub fn open_model(
    path: &str,
    bytes: Vec<u8>,
    runtime: Option<&str>,
) -> Result<Box<dyn Model>, OnnxError> {
    match runtime {
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
    match by_onnx_runtime(path, bytes, &library_name()) {
        Err(OnnxError::Library { reason, .. }) => Err(OnnxError::NoRuntime {
            model: path.to_owned(),
            reason,
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
    })
}
