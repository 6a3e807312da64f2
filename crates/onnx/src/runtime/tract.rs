//! tract, a runtime in Rust that is built into the program.
//!
//! tract optimizes a model for the dimensions of its inputs. The plan for the last dimensions is kept, since most models get
//! the same number of points each time. A plan runs on the thread that calls it.

use crate::error::OnnxError;
use crate::model::Model;
use crate::tensor::{Element, InputTensor, InputValues, OutputTensor, TensorSpec};
use std::sync::{Arc, Mutex, PoisonError};
use tract_onnx::prelude::{
    DatumType, Framework, InferenceFact, InferenceModel, InferenceModelExt, IntoRunnable, OutletId,
    Tensor, TractResult, TypedRunnableModel,
};

/// How reports name the runtime.
const RUNTIME: &str = "tract";

type Plan = Arc<TypedRunnableModel>;

/// A model of tract.
pub(crate) struct TractModel {
    model: InferenceModel,
    inputs: Vec<TensorSpec>,
    outputs: Vec<TensorSpec>,
    last: Mutex<Option<LastPlan>>,
}

/// A plan, and what it was made for.
struct LastPlan {
    shapes: Vec<Vec<usize>>,
    output: String,
    plan: Plan,
}

impl TractModel {
    /// Reads the model.
    ///
    /// # Errors
    /// If the bytes are not a model, or one of its operators is unknown.
    pub(crate) fn open(path: &str, bytes: &[u8]) -> Result<Self, OnnxError> {
        let opened = Self::parse(bytes);
        opened.map_err(|error| OnnxError::Model {
            model: path.to_owned(),
            runtime: RUNTIME.to_owned(),
            reason: one_line(&error),
        })
    }

    fn parse(mut bytes: &[u8]) -> TractResult<Self> {
        let model = tract_onnx::onnx().model_for_read(&mut bytes)?;
        let specs = |outlets: &[OutletId]| -> TractResult<Vec<TensorSpec>> {
            outlets.iter().map(|&outlet| spec(&model, outlet)).collect()
        };
        let inputs = specs(model.input_outlets()?)?;
        let outputs = specs(model.output_outlets()?)?;
        Ok(Self {
            model,
            inputs,
            outputs,
            last: Mutex::new(None),
        })
    }

    fn plan(&self, inputs: &[InputTensor], output: &str) -> TractResult<Plan> {
        let shapes: Vec<Vec<usize>> = inputs.iter().map(|input| input.shape.clone()).collect();
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = &*last
            && known.shapes == shapes
            && known.output == output
        {
            return Ok(known.plan.clone());
        }

        let outlets = self.model.output_outlets()?;
        let index = self.outputs.iter().position(|spec| spec.name == output);
        let outlet = outlets.get(index.unwrap_or_default()).copied();
        let mut model = self
            .model
            .clone()
            .with_output_outlets(&outlet.into_iter().collect::<Vec<OutletId>>())?;
        for (at, input) in inputs.iter().enumerate() {
            let kind = match input.values {
                InputValues::F32(_) => DatumType::F32,
                InputValues::I64(_) => DatumType::I64,
            };
            model.set_input_fact(at, InferenceFact::dt_shape(kind, &input.shape))?;
        }
        let plan = model.into_optimized()?.into_runnable()?;
        *last = Some(LastPlan {
            shapes,
            output: output.to_owned(),
            plan: plan.clone(),
        });
        Ok(plan)
    }

    fn run_plan(&self, inputs: Vec<InputTensor>, output: &str) -> TractResult<OutputTensor> {
        let plan = self.plan(&inputs, output)?;
        let tensors = inputs
            .into_iter()
            .map(|input| match input.values {
                InputValues::F32(values) => Tensor::from_shape(&input.shape, &values),
                InputValues::I64(values) => Tensor::from_shape(&input.shape, &values),
            })
            .collect::<TractResult<Vec<Tensor>>>()?;
        let outputs = plan.run(tensors.into_iter().map(Into::into).collect())?;
        let first = &outputs[0];
        Ok(OutputTensor {
            shape: first.shape().to_vec(),
            values: first.as_slice::<f32>()?.to_vec(),
        })
    }
}

impl Model for TractModel {
    fn runtime(&self) -> &str {
        RUNTIME
    }

    fn inputs(&self) -> &[TensorSpec] {
        &self.inputs
    }

    fn outputs(&self) -> &[TensorSpec] {
        &self.outputs
    }

    fn run(&self, inputs: Vec<InputTensor>, output: &str) -> Result<OutputTensor, String> {
        self.run_plan(inputs, output)
            .map_err(|error| one_line(&error))
    }
}

/// A tensor as the model declares it.
fn spec(model: &InferenceModel, outlet: OutletId) -> TractResult<TensorSpec> {
    let fact = model.outlet_fact(outlet)?;
    let element = match fact.datum_type.concretize() {
        Some(DatumType::F32) => Element::F32,
        Some(DatumType::I64) => Element::I64,
        Some(DatumType::F64) => Element::Other("float64".to_owned()),
        Some(DatumType::F16) => Element::Other("float16".to_owned()),
        Some(other) => Element::Other(format!("{other:?}").to_lowercase()),
        // A model need not say it.
        None => Element::F32,
    };
    let shape = fact
        .shape
        .dims()
        .map(|dim| dim.concretize().and_then(|dim| dim.to_usize().ok()))
        .collect();
    let label = model.outlet_label(outlet);
    let name = label.unwrap_or(&model.nodes[outlet.node].name);
    Ok(TensorSpec {
        name: name.to_owned(),
        element,
        shape,
    })
}

/// The message with its causes, without line breaks.
fn one_line(error: &tract_onnx::prelude::TractError) -> String {
    let text = format!("{error:#}");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
