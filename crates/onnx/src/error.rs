//! Defines the reasons why a model gives no features. Each message names the model and the tensor, what was found and expected,
//! and the remedy.

/// An error of a model, its runtime, or their settings in the config.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OnnxError {
    /// There is no runtime for the model.
    #[error(
        "there is no runtime for {model}: {reason}. Install ONNX Runtime (`pip install onnxruntime` in the active Python \
         environment), or set `runtime` or ORT_DYLIB_PATH to the path of its library (libonnxruntime.so)"
    )]
    NoRuntime {
        /// The model.
        model: String,
        /// The library that was searched.
        reason: String,
    },
    /// The library of ONNX Runtime cannot be used.
    #[error(
        "`runtime` {library} cannot be used: {reason}; set `runtime` to the library of ONNX Runtime 1.17 or newer \
         (libonnxruntime.so)"
    )]
    Library {
        /// The path of the library.
        library: String,
        /// The reason.
        reason: String,
    },
    /// Two sources of one config name different libraries.
    #[error(
        "`runtime` is {requested}, but this program has already loaded {loaded}, and it can load only one; use the same \
         `runtime` for all sources of a config"
    )]
    OtherLibrary {
        /// The requested path.
        requested: String,
        /// The path of the library that is in use.
        loaded: String,
    },
    /// The runtime cannot read or prepare the model.
    #[error(
        "{model} cannot be used with {runtime}: {reason}; check that the file is a whole ONNX model and that the runtime knows \
         its operators"
    )]
    Model {
        /// The model.
        model: String,
        /// The runtime.
        runtime: String,
        /// The message of the runtime.
        reason: String,
    },
    /// A key names a tensor that the model does not have.
    #[error(
        "{model} has no {direction} `{tensor}`, which `{key}` names; its {direction}s are {known}"
    )]
    NoTensor {
        /// The model.
        model: String,
        /// `input` or `output`.
        direction: &'static str,
        /// The tensor.
        tensor: String,
        /// The key of the config.
        key: &'static str,
        /// The tensors that it has, separated by commas.
        known: String,
    },
    /// The config does not say what goes into an input.
    #[error(
        "{model} has the input {input}, and no key says what goes into it; set `positions`, `normals`, `areas` or `count` to \
         the name of the input that gets them (one input may get several)"
    )]
    UnusedInput {
        /// The model.
        model: String,
        /// The input, with its type and dimensions.
        input: String,
    },
    /// The model has several outputs.
    #[error(
        "{model} has {n_outputs} outputs: {known}; set `features` to the name of the one with the features"
    )]
    WhichOutput {
        /// The model.
        model: String,
        /// The number of its outputs.
        n_outputs: usize,
        /// The outputs, separated by commas.
        known: String,
    },
    /// A tensor has numbers of another type.
    #[error("{model}: {tensor} must have the type {expected}; export the model with this type")]
    Element {
        /// The model.
        model: String,
        /// The tensor, with its type and dimensions.
        tensor: String,
        /// The type that it must have.
        expected: &'static str,
    },
    /// A tensor has other dimensions than what goes into it, or comes out.
    #[error(
        "{model}: {tensor} does not have the dimensions of {content}, which are {expected}; {remedy}"
    )]
    Shape {
        /// The model.
        model: String,
        /// The tensor, with its dimensions.
        tensor: String,
        /// A description of the data that go in or come out.
        content: String,
        /// Dimensions that fit.
        expected: String,
        /// Advice for the user.
        remedy: &'static str,
    },
    /// It is not clear which dimension is that of the points.
    #[error(
        "{model}: {tensor} may have its {items} in either dimension; set `{key}` to `rows` (their numbers are next to each \
         other) or `columns`"
    )]
    Layout {
        /// The model.
        model: String,
        /// The tensor, with its dimensions.
        tensor: String,
        /// `points` or `triangles`.
        items: &'static str,
        /// The key of the config.
        key: &'static str,
    },
    /// The model was made for a number of points or triangles.
    #[error(
        "{model}: {tensor} is made for {n_expected} {items}, and there are {n_found}; {remedy}"
    )]
    Count {
        /// The model.
        model: String,
        /// The tensor, with its dimensions.
        tensor: String,
        /// `points` or `triangles`.
        items: &'static str,
        /// The number for which the model was made.
        n_expected: usize,
        /// The number of points or triangles.
        n_found: usize,
        /// Advice for the user.
        remedy: &'static str,
    },
    /// The model failed on a shape.
    #[error("{model} failed with {runtime}: {reason}")]
    Run {
        /// The model.
        model: String,
        /// The runtime.
        runtime: String,
        /// The message of the runtime.
        reason: String,
    },
    /// A feature is not a finite number.
    #[error(
        "{model}: output `{tensor}` has {value} in row {row} of {n_rows}; every feature must be a finite number, so check the \
         model and the keys `frame` and `factor`"
    )]
    NotFinite {
        /// The model.
        model: String,
        /// The output.
        tensor: String,
        /// NaN or an infinity.
        value: String,
        /// The row.
        row: usize,
        /// The number of rows.
        n_rows: usize,
    },
    /// The shape has no surface for a model.
    #[error("the shape has no surface: {0}")]
    NoSurface(String),
}
