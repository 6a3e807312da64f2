//! Lists the types of `[sources.NAME]`: label files of other programs, and models that are run.
//!
//! Takes the name of a type and its keys, and returns a source that labels shapes. The files of a type are only known to the type
//! itself.

#[cfg(feature = "train")]
use crate::backbone_labels::BACKBONE;
use crate::onnx_library;
use partprobe_imports::{IMPORT_TYPES, Import, ImportError, ImportType, import_type_among};
use partprobe_onnx::ONNX;
use partprobe_sources::SourceContext;

/// The key of the type `onnx` that names the library which runs the model.
const RUNTIME: &str = "runtime";

/// The types that run a model.
const MODEL_TYPES: &[&ImportType] = &[
    &ONNX,
    #[cfg(feature = "train")]
    &BACKBONE,
];

/// The type with this name.
///
/// # Errors
/// If there is none. The message lists those that exist.
pub(crate) fn source_type(name: &str) -> Result<&'static ImportType, ImportError> {
    import_type_among(IMPORT_TYPES.iter().chain(MODEL_TYPES.iter().copied()), name)
}

/// The source of this type, with the keys of a context.
///
/// # Errors
/// If there is no such type, a key is unknown, missing or out of range, or its files cannot be read.
pub(crate) fn open_source(
    type_name: &str,
    context: SourceContext,
) -> Result<Box<dyn Import>, ImportError> {
    let source_type = source_type(type_name)?;
    source_type.open(&with_runtime(source_type, context))
}

/// Adds the library of ONNX Runtime that is on this machine, if a model needs one and its config names none.
fn with_runtime(source_type: &ImportType, context: SourceContext) -> SourceContext {
    if source_type.name != ONNX.name || context.parameter(RUNTIME).is_some() {
        return context;
    }
    match onnx_library::find() {
        Some(library) => context.with(RUNTIME, library.to_string_lossy()),
        None => context,
    }
}
