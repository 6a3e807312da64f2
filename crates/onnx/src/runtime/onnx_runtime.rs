//! Runs models on ONNX Runtime, loaded from a library of the user's machine.
//!
//! A session runs on one thread, so a result does not depend on the number of threads. Threads that label several shapes at a
//! time use different sessions. A program can load only one library.

use crate::error::OnnxError;
use crate::model::Model;
use crate::tensor::{Element, InputTensor, InputValues, OutputTensor, TensorSpec};
use ort::environment::Environment;
use ort::logging::LogLevel;
use ort::session::{Session, SessionInputValue};
use ort::value::{Outlet, Tensor, TensorElementType, ValueType};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The library that this program has loaded.
static LOADED: Mutex<Option<Library>> = Mutex::new(None);

/// A loaded library, and the data that all sessions share.
#[derive(Clone)]
struct Library {
    path: PathBuf,
    environment: Environment,
}

/// A model of ONNX Runtime.
pub(crate) struct OnnxRuntimeModel {
    runtime: String,
    environment: Environment,
    bytes: Vec<u8>,
    inputs: Vec<TensorSpec>,
    outputs: Vec<TensorSpec>,
    /// Sessions that no thread uses at the moment.
    idle: Mutex<Vec<Session>>,
}

impl OnnxRuntimeModel {
    /// Loads the library, unless it is already loaded, and reads the model.
    ///
    /// # Errors
    /// If the library cannot be loaded, another one is already loaded, or it cannot read the model.
    pub(crate) fn open(path: &str, bytes: Vec<u8>, library: &str) -> Result<Self, OnnxError> {
        let Library {
            path: library,
            environment,
        } = load(library)?;
        let file_name = library.file_name().unwrap_or(library.as_os_str());
        let runtime = format!("ONNX Runtime ({})", file_name.to_string_lossy());
        let session = session(&environment, &bytes).map_err(|error| OnnxError::Model {
            model: path.to_owned(),
            runtime: runtime.clone(),
            reason: one_line(&error),
        })?;
        Ok(Self {
            runtime,
            environment,
            bytes,
            inputs: session.inputs().iter().map(spec).collect(),
            outputs: session.outputs().iter().map(spec).collect(),
            idle: Mutex::new(vec![session]),
        })
    }

    fn take_session(&self) -> Result<Session, ort::Error> {
        let idle = self
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        idle.map_or_else(|| session(&self.environment, &self.bytes), Ok)
    }

    fn run_session(
        session: &mut Session,
        inputs: Vec<InputTensor>,
        output: &str,
    ) -> Result<OutputTensor, ort::Error> {
        let values = inputs
            .into_iter()
            .map(value)
            .collect::<Result<Vec<(String, SessionInputValue<'static>)>, ort::Error>>()?;
        let outputs = session.run(values)?;
        let (shape, values) = outputs[output].try_extract_tensor::<f32>()?;
        Ok(OutputTensor {
            shape: shape.iter().map(|&size| size.max(0) as usize).collect(),
            values: values.to_vec(),
        })
    }
}

impl Model for OnnxRuntimeModel {
    fn runtime(&self) -> &str {
        &self.runtime
    }

    fn inputs(&self) -> &[TensorSpec] {
        &self.inputs
    }

    fn outputs(&self) -> &[TensorSpec] {
        &self.outputs
    }

    fn run(&self, inputs: Vec<InputTensor>, output: &str) -> Result<OutputTensor, String> {
        if !self.outputs.iter().any(|spec| spec.name == output) {
            return Err(format!("there is no output `{output}`"));
        }
        let mut session = self.take_session().map_err(|error| one_line(&error))?;
        let result = Self::run_session(&mut session, inputs, output);
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        idle.push(session);
        result.map_err(|error| one_line(&error))
    }
}

/// Loads a library, unless it is already loaded. The system's loader searches a name without a folder.
fn load(library: &str) -> Result<Library, OnnxError> {
    let unusable = |reason: String| OnnxError::Library {
        library: library.to_owned(),
        reason,
    };
    let is_name = Path::new(library).components().count() == 1 && !Path::new(library).exists();
    let path = if is_name {
        PathBuf::from(library)
    } else {
        std::path::absolute(library).map_err(|error| unusable(error.to_string()))?
    };

    let mut loaded = LOADED.lock().unwrap_or_else(PoisonError::into_inner);
    match &*loaded {
        Some(same) if same.path == path => return Ok(same.clone()),
        Some(other) => {
            return Err(OnnxError::OtherLibrary {
                requested: library.to_owned(),
                loaded: other.path.display().to_string(),
            });
        }
        None => {}
    }
    let builder = ort::init_from(&path).map_err(|error| unusable(error.to_string()))?;
    let environment = builder
        .with_name("partprobe")
        .with_telemetry(false)
        .build()
        .map_err(|error| unusable(one_line(&error)))?;
    // What it has to say is in the errors that it returns.
    environment.set_log_level(LogLevel::Fatal);
    let library = Library { path, environment };
    *loaded = Some(library.clone());
    Ok(library)
}

/// A session that runs on the calling thread and prints nothing.
fn session(environment: &Environment, bytes: &[u8]) -> Result<Session, ort::Error> {
    Session::builder(environment)?
        .with_intra_threads(1)?
        .with_inter_threads(1)?
        .with_parallel_execution(false)?
        .with_deterministic_compute(true)?
        .with_log_level(LogLevel::Fatal)?
        .commit_from_memory(bytes)
}

fn spec(outlet: &Outlet) -> TensorSpec {
    let (element, shape) = match outlet.dtype() {
        ValueType::Tensor { ty, shape, .. } => {
            // A dimension that is not fixed is -1.
            let sizes = shape.iter().map(|&size| usize::try_from(size).ok());
            (element(*ty), sizes.collect())
        }
        other => (Element::Other(other.to_string()), Vec::new()),
    };
    TensorSpec {
        name: outlet.name().to_owned(),
        element,
        shape,
    }
}

fn element(element: TensorElementType) -> Element {
    match element {
        TensorElementType::Float32 => Element::F32,
        TensorElementType::Int64 => Element::I64,
        TensorElementType::Float64 => Element::Other("float64".to_owned()),
        TensorElementType::Float16 => Element::Other("float16".to_owned()),
        other => Element::Other(other.to_string()),
    }
}

fn value(input: InputTensor) -> Result<(String, SessionInputValue<'static>), ort::Error> {
    let value = match input.values {
        InputValues::F32(values) => Tensor::from_array((input.shape, values))?.into(),
        InputValues::I64(values) => Tensor::from_array((input.shape, values))?.into(),
    };
    Ok((input.name, value))
}

/// The message without line breaks and without a final period.
fn one_line(error: &ort::Error) -> String {
    let text = error.to_string();
    let words: Vec<&str> = text.split_whitespace().collect();
    words.join(" ").trim_end_matches('.').to_owned()
}
