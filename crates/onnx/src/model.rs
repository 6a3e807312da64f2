//! Defines the interface of a model in a runtime: it describes its tensors, and it can be run.

use crate::tensor::{InputTensor, OutputTensor, TensorSpec};

/// A model that is ready to run, on any number of threads at the same time.
///
/// The same input must give the same bytes each time, on any thread.
pub trait Model: Send + Sync {
    /// The runtime, for reports: for example `ONNX Runtime 1.22`.
    fn runtime(&self) -> &str;

    /// The inputs that the model needs.
    fn inputs(&self) -> &[TensorSpec];

    /// The outputs that it has.
    fn outputs(&self) -> &[TensorSpec];

    /// Runs the model and returns one output. There is one input tensor per entry of [`inputs`](Self::inputs).
    ///
    /// # Errors
    /// The message of the runtime, if it cannot run the model on this input.
    fn run(&self, inputs: Vec<InputTensor>, output: &str) -> Result<OutputTensor, String>;
}
