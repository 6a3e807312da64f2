//! Writes one forward and backward pass as a safetensors file, with all data that another implementation needs to repeat it.
//!
//! There are two comparisons. [`Model::parity_case`] writes the results of this crate, and `tools/torch/parity.py` computes them
//! again in PyTorch. The tests below read `vectors.safetensors`, which that script made, and compute the results again in Rust.

#[cfg(test)]
mod vectors;

use crate::data::tokens::Tokens;
use crate::kernels::one_thread::on_one_thread;
use crate::model::backbones::{ShapeInput, features};
use crate::model::forward_mode::ForwardMode;
use crate::model::net_config::NetConfig;
use crate::model::parameters::{self, ParameterShape, host_values};
use crate::model::weights::{TensorFile, WeightsError, named};
use crate::model::{Model, device_of};
use crate::{EmbedError, ThreadError};
use burn::module::Module;
use burn::tensor::{Tensor, TensorData};
use partprobe_carrier::{keyed_rng, unit_interval};

/// The reason why a case could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParityError {
    /// The operating system could not start a thread.
    #[error(transparent)]
    Thread(#[from] ThreadError),
    /// The weights make numbers that are not finite.
    #[error(transparent)]
    Embed(#[from] EmbedError),
    /// The file could not be written.
    #[error(transparent)]
    Weights(#[from] WeightsError),
}

/// A tensor with its name.
type NamedTensor = (ParameterShape, Vec<f32>);

fn rows(name: String, dim: usize, values: Vec<f32>) -> NamedTensor {
    (
        ParameterShape {
            name,
            dims: vec![values.len() / dim.max(1), dim],
        },
        values,
    )
}

impl Model {
    /// Passes the shapes through the network together as in training, and computes the gradient of Σ output · constant. No path
    /// is dropped.
    ///
    /// The tensors are `weights.<name>`, `gradients.<name>`, `statistics` (mean and unbiased variance of each batch norm, in the
    /// order of the pass), and for each shape i `shapes.<i>.features`, `.cells`, `.axes`, `.constant`, `.output` (not normalized,
    /// in training) and `.embedding` (unit, at test time). The config is in the metadata.
    ///
    /// # Errors
    /// If the network's numbers are not finite, or no thread can be started.
    pub fn parity_case(&self, shapes: &[Tokens]) -> Result<Vec<u8>, ParityError> {
        let mut tensors = on_one_thread(|| self.pass_tensors(shapes))?;
        for (idx, tokens) in shapes.iter().enumerate() {
            let embedding = self.embed(tokens)?;
            tensors.extend(token_tensors(&format!("shapes.{idx}."), tokens));
            tensors.push(rows(
                format!("shapes.{idx}.embedding"),
                embedding.dim(),
                embedding.values().to_vec(),
            ));
        }
        let prefixed = parameters::shapes(self.network())
            .into_iter()
            .map(|shape| with_prefix("weights", shape));
        tensors.extend(named(&prefixed.collect::<Vec<_>>(), &self.values()));
        Ok(TensorFile::<NetConfig> {
            content: self.config().clone(),
            tensors,
        }
        .to_bytes()?)
    }

    /// Outputs, constants, gradients and statistics of the pass.
    fn pass_tensors(&self, shapes: &[Tokens]) -> Vec<NamedTensor> {
        let dim = self.config().embedding_dim;
        let backbone = &self.config().backbone;
        let orders = backbone.test_orders();
        let inputs: Vec<ShapeInput> = shapes
            .iter()
            .map(|tokens| backbone.prepare(tokens, &orders))
            .collect();
        let network = self.network().clone().train();
        let mut mode = ForwardMode::repeatable();
        let device = device_of(self.backend()).autodiff();
        let output = network.forward(&inputs.iter().collect::<Vec<_>>(), &device, &mut mode);
        let n_rows = output.dims()[0];
        let constant = random_constant(n_rows * dim);
        let values = host_values(output.clone());
        let weighted =
            output * Tensor::from_data(TensorData::new(constant.clone(), [n_rows, dim]), &device);
        let gradients = parameters::gradients(&network, &mut weighted.sum().backward());

        let mut tensors = vec![rows("statistics".to_owned(), 1, mode.into_statistics())];
        let learned = parameters::shapes(self.network())
            .into_iter()
            .map(|shape| with_prefix("gradients", shape));
        tensors.extend(named(&learned.collect::<Vec<_>>(), &gradients));
        let mut first = 0;
        for (idx, tokens) in shapes.iter().enumerate() {
            let own = first * dim..(first + tokens.n()) * dim;
            let row_of = |name: &str, all: &[f32]| {
                rows(
                    format!("shapes.{idx}.{name}"),
                    dim,
                    all[own.clone()].to_vec(),
                )
            };
            tensors.push(row_of("output", &values));
            tensors.push(row_of("constant", &constant));
            first += tokens.n();
        }
        tensors
    }
}

/// `n` numbers from -1 to 1, by which the outputs are weighted. They are the same at each call.
fn random_constant(n: usize) -> Vec<f32> {
    let rng = &mut keyed_rng(0, &["parity", "constant"]);
    (0..n)
        .map(|_| (2.0 * unit_interval(rng) - 1.0) as f32)
        .collect()
}

/// The tokens of a shape and the label of each, as a safetensors file of `features`, `cells`, `axes` and `labels`.
///
/// # Errors
/// If the header would be larger than the format allows.
pub fn tokens_file(tokens: &Tokens, labels: &[i32]) -> Result<Vec<u8>, WeightsError> {
    let mut tensors = token_tensors("", tokens).to_vec();
    tensors.push(rows(
        "labels".to_owned(),
        1,
        labels.iter().map(|&label| label as f32).collect(),
    ));
    TensorFile {
        content: (),
        tensors,
    }
    .to_bytes()
}

fn with_prefix(prefix: &str, shape: ParameterShape) -> ParameterShape {
    ParameterShape {
        name: format!("{prefix}.{}", shape.name),
        ..shape
    }
}

/// The input of the network for the tokens of a shape. Cells and axes are whole numbers below 2¹⁶, which f32 represents exactly.
fn token_tensors(prefix: &str, tokens: &Tokens) -> [NamedTensor; 3] {
    let cells = tokens.cells.iter().flatten().map(|&x| x as f32).collect();
    let axes = tokens.axes.iter().map(|&axis| f32::from(axis)).collect();
    let features = features(tokens);
    [
        rows(
            format!("{prefix}features"),
            features.len() / tokens.n().max(1),
            features,
        ),
        rows(format!("{prefix}cells"), 3, cells),
        rows(format!("{prefix}axes"), 1, axes),
    ]
}
