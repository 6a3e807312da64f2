//! Views the parameters of a burn module as one vector of numbers, with a name and a shape for each tensor.
//!
//! The optimizer, the gradients of a batch and the checkpoints use this vector. The keys of burn's own optimizer state are ids
//! that are random in each process, so burn's checkpoints could not be equal byte for byte. The tensors are in the order of the
//! module's fields.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Device, Gradients, Tensor, TensorData};
use partprobe_carrier::keyed_rng;

/// The name and the shape of one tensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ParameterShape {
    /// Field names joined by dots, for example `backbone.encoder.0.blocks.0.attention.qkv.weight`.
    pub(crate) name: String,
    /// Length along each axis.
    pub(crate) dims: Vec<usize>,
}

impl ParameterShape {
    /// The number of values of the tensor.
    pub(crate) fn len(&self) -> usize {
        self.dims.iter().product()
    }

    /// Whether the tensor is a running statistic. It has no gradient and is not a learned parameter.
    pub(crate) fn is_statistic(&self) -> bool {
        self.name
            .rsplit('.')
            .next()
            .is_some_and(|field| field.starts_with("running_"))
    }
}

/// The source of the values of new tensors, and their device.
pub(crate) struct Initializer<'a> {
    /// The seed, or `None` for zeros, which are then replaced by other values.
    seed: Option<u64>,
    device: &'a Device,
}

impl<'a> Initializer<'a> {
    /// Draws random weights with this seed.
    pub(crate) fn seeded(seed: u64, device: &'a Device) -> Self {
        Self {
            seed: Some(seed),
            device,
        }
    }

    /// Sets weights to 0.
    pub(crate) fn zeros(device: &'a Device) -> Self {
        Self { seed: None, device }
    }

    /// A tensor of random numbers, uniform in ±1/√`fan_in`, drawn for this name. This is PyTorch's default for weights and
    /// biases.
    pub(crate) fn uniform<const D: usize>(
        &self,
        name: &str,
        dims: [usize; D],
        fan_in: usize,
    ) -> Param<Tensor<D>> {
        let Some(seed) = self.seed else {
            return Param::from_tensor(Tensor::zeros(dims, self.device));
        };
        let rng = &mut keyed_rng(seed, &["init", name]);
        let bound = 1.0 / (fan_in.max(1) as f64).sqrt();
        let draw = |_| (bound * (2.0 * partprobe_carrier::unit_interval(rng) - 1.0)) as f32;
        let values: Vec<f32> = (0..dims.iter().product::<usize>()).map(draw).collect();
        Param::from_data(TensorData::new(values, dims), self.device)
    }

    /// A vector of equal numbers.
    pub(crate) fn constant(&self, dim: usize, value: f32) -> Param<Tensor<1>> {
        Param::from_data(TensorData::new(vec![value; dim], [dim]), self.device)
    }
}

/// Names and shapes of all tensors, in the order of [`values`].
pub(crate) fn shapes(module: &impl Module) -> Vec<ParameterShape> {
    let mut visitor = ShapeVisitor::default();
    module.visit(&mut visitor);
    visitor.shapes
}

#[derive(Default)]
struct ShapeVisitor {
    path: Vec<String>,
    shapes: Vec<ParameterShape>,
}

impl ModuleVisitor for ShapeVisitor {
    fn enter_module(&mut self, name: &str, container_type: &str) {
        if !is_variant(container_type) {
            self.path.push(name.to_owned());
        }
    }

    fn exit_module(&mut self, _name: &str, container_type: &str) {
        if !is_variant(container_type) {
            self.path.pop();
        }
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.shapes.push(ParameterShape {
            name: self.path.join("."),
            dims: param.val().dims().to_vec(),
        });
    }
}

/// Whether a module is the variant of an enum. The config determines the variant, so its name is left out.
fn is_variant(container_type: &str) -> bool {
    container_type.starts_with("Enum:")
}

/// All values, tensor by tensor.
///
/// # Shapes
/// - output: `[n]`, where `n` is the sum of the lengths of [`shapes`]; each tensor is row-major
pub(crate) fn values(module: &impl Module) -> Vec<f32> {
    let mut visitor = ValueVisitor { values: Vec::new() };
    module.visit(&mut visitor);
    visitor.values
}

struct ValueVisitor {
    values: Vec<f32>,
}

impl ModuleVisitor for ValueVisitor {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        self.values.extend(host_values(param.val()));
    }
}

/// All gradients, tensor by tensor. The gradient is 0 for a tensor on which the loss does not depend.
///
/// # Shapes
/// - output: `[n]`, as that of [`values`]
pub(crate) fn gradients(module: &impl Module, gradients: &mut Gradients) -> Vec<f32> {
    let mut visitor = GradientVisitor {
        gradients,
        values: Vec::new(),
    };
    module.visit(&mut visitor);
    visitor.values
}

struct GradientVisitor<'a> {
    gradients: &'a mut Gradients,
    values: Vec<f32>,
}

impl ModuleVisitor for GradientVisitor<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let tensor = param.val();
        match tensor.grad_remove(self.gradients) {
            Some(gradient) => self.values.extend(host_values(gradient)),
            None => self.values.resize(
                self.values.len() + tensor.dims().iter().product::<usize>(),
                0.0,
            ),
        }
    }
}

/// The module with other values.
///
/// # Shapes
/// - values: `[n]`, as the output of [`values`]
pub(crate) fn with_values<M: Module>(module: M, values: &[f32]) -> M {
    module.map(&mut ValueMapper { rest: values })
}

struct ValueMapper<'a> {
    rest: &'a [f32],
}

impl ModuleMapper for ValueMapper<'_> {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        param.map(|tensor| {
            let (dims, device) = (tensor.dims(), tensor.device());
            let (own, rest) = self
                .rest
                .split_at(dims.iter().product::<usize>().min(self.rest.len()));
            self.rest = rest;
            Tensor::from_data(TensorData::new(own.to_vec(), dims), &device)
        })
    }
}

/// The numbers of a tensor, row-major. Every tensor of this crate is f32, so the read succeeds.
pub(crate) fn host_values<const D: usize>(tensor: Tensor<D>) -> Vec<f32> {
    tensor.into_data().try_to_vec::<f32>().unwrap_or_default()
}
