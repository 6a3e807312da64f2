//! Computes a trunk for a block of points: the output, its gradient by the position, and the backward pass from the derivatives
//! of a loss by both.
//!
//! Notation of the comments: layer l computes a = h·W + b and h′ = φ(a). The gradient pass starts with the output's weights and
//! computes g ← (g ∘ φ′)·Wᵀ. A loss on the gradient first goes back through this pass, and its derivative by a is added in the
//! ordinary backward pass. So a point whose gradient has a loss needs six matrix products per layer, and any other point needs
//! three.

use super::activation::Activation;
use super::layout::{LAYERS, Layout};
use crate::kernels::{Kernel, Panels, add_column_sums, add_outer_products, multiply, vectorized};

/// The number of points in a block. It is a multiple of the rows of a tile, and the numbers of a block fit into the second-level
/// cache.
pub(crate) const BLOCK: usize = 96;

/// The weights in the order in which products read them.
#[derive(Clone, Debug)]
pub(crate) struct PreparedNetwork {
    pub(crate) layout: Layout,
    pub(super) activation: Activation,
    pub(super) parameters: Vec<f32>,
    /// The matrix of each layer.
    forward: Vec<Panels>,
    /// Its transpose.
    backward: Vec<Panels>,
    /// The head's two matrices and their transposes.
    pub(super) head: [Panels; 4],
}

impl PreparedNetwork {
    pub(crate) fn new(layout: Layout, activation: Activation, parameters: Vec<f32>) -> Self {
        let mut network = Self {
            layout,
            activation,
            parameters,
            forward: vec![Panels::default(); LAYERS],
            backward: vec![Panels::default(); LAYERS],
            head: Default::default(),
        };
        network.prepare();
        network
    }

    #[cfg(test)]
    pub(crate) fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    pub(crate) fn into_parameters(self) -> Vec<f32> {
        self.parameters
    }

    /// Changes the weights.
    pub(crate) fn update(&mut self, change: impl FnOnce(&mut [f32])) {
        change(&mut self.parameters);
        self.prepare();
    }

    fn prepare(&mut self) {
        let layout = self.layout;
        for layer in 0..LAYERS {
            let weights = &self.parameters[layout.weights(layer)];
            let depth = layout.depth(layer);
            self.forward[layer].set(weights, depth, layout.width);
            self.backward[layer].set_transpose(weights, layout.width, depth);
        }
        if layout.n_labels > 0 {
            self.prepare_head();
        }
    }

    pub(super) fn slice(&self, range: std::ops::Range<usize>) -> &[f32] {
        &self.parameters[range]
    }
}

/// The numbers of one block, and the sum of the gradients of the previous blocks. It is allocated once and used for many blocks.
#[derive(Clone, Debug)]
pub(crate) struct Workspace {
    /// `[BLOCK, 3]`
    pub(crate) positions: Vec<f32>,
    /// The output, `[BLOCK]`.
    pub(crate) outputs: Vec<f32>,
    /// The gradient by the position, `[BLOCK, 3]`.
    pub(crate) gradients: Vec<f32>,
    /// The derivative of the loss by the output.
    pub(crate) by_output: Vec<f32>,
    /// The derivative of the loss by the gradient.
    pub(crate) by_gradient: Vec<f32>,
    /// The derivative of the loss by the last hidden layer, from the head, `[BLOCK, width]`.
    pub(crate) by_last: Vec<f32>,
    /// φ(a), φ′(a) and g of each layer, `[BLOCK, width]`.
    pub(super) values: Vec<Vec<f32>>,
    slopes: Vec<Vec<f32>>,
    passed: Vec<Vec<f32>>,
    scratch: [Vec<f32>; 3],
    pub(crate) head: super::head::HeadRows,
    /// The derivative of the loss by each parameter, summed over blocks.
    pub(crate) sums: Vec<f32>,
}

impl Workspace {
    pub(crate) fn new(layout: &Layout) -> Self {
        let rows = || vec![0.0; BLOCK * layout.width];
        let layers = || (0..LAYERS).map(|_| rows()).collect();
        Self {
            positions: vec![0.0; BLOCK * 3],
            outputs: vec![0.0; BLOCK],
            gradients: vec![0.0; BLOCK * 3],
            by_output: vec![0.0; BLOCK],
            by_gradient: vec![0.0; BLOCK * 3],
            by_last: rows(),
            values: layers(),
            slopes: layers(),
            passed: layers(),
            scratch: [rows(), rows(), rows()],
            head: super::head::HeadRows::new(layout),
            sums: vec![0.0; layout.n_parameters()],
        }
    }

    /// Computes the output at each position.
    pub(crate) fn forward(&mut self, network: &PreparedNetwork) {
        vectorized(Forward(self, network));
    }

    /// Computes the gradient by the position, after [`forward`](Self::forward).
    pub(crate) fn gradient(&mut self, network: &PreparedNetwork) {
        vectorized(Gradient(self, network));
    }

    /// Adds the derivatives by the parameters that follow from `by_gradient`. Stores the derivatives by the weighted sums in
    /// `passed`.
    pub(crate) fn pull_back_gradient(&mut self, network: &PreparedNetwork) {
        vectorized(PullBackGradient(self, network));
    }

    /// Adds the derivatives by the parameters that follow from `by_output`, `by_last` and, if there was one, the loss on the
    /// gradient.
    pub(crate) fn backward(&mut self, network: &PreparedNetwork, parts: BackwardParts) {
        vectorized(Backward(self, network, parts));
    }

    #[inline(always)]
    fn forward_by<const N: usize>(&mut self, network: &PreparedNetwork) {
        let layout = &network.layout;
        for layer in 0..LAYERS {
            let (before, own) = self.values.split_at_mut(layer);
            let input = before.last().unwrap_or(&self.positions);
            let sums = &mut self.scratch[0];
            let biases = network.slice(layout.biases(layer));
            multiply::<N>(input, &network.forward[layer], biases, sums);
            network
                .activation
                .apply(sums, &mut own[0], &mut self.slopes[layer]);
        }
        let weights = network.slice(layout.output_weights());
        let bias = network.parameters[layout.output_bias()];
        let rows = self.values[LAYERS - 1].chunks_exact(layout.width);
        for (output, row) in self.outputs.iter_mut().zip(rows) {
            *output = bias + dot(row, weights);
        }
    }

    #[inline(always)]
    fn gradient_by<const N: usize>(&mut self, network: &PreparedNetwork) {
        let layout = &network.layout;
        let weights = network.slice(layout.output_weights());
        for row in self.passed[LAYERS - 1].chunks_exact_mut(layout.width) {
            row.copy_from_slice(weights);
        }
        for layer in (0..LAYERS).rev() {
            let scaled = &mut self.scratch[0];
            product_of(&self.passed[layer], &self.slopes[layer], scaled);
            let target = match layer {
                0 => &mut self.gradients,
                _ => &mut self.passed[layer - 1],
            };
            multiply::<N>(scaled, &network.backward[layer], &[], target);
        }
    }

    #[inline(always)]
    fn pull_back_gradient_by<const N: usize>(&mut self, network: &PreparedNetwork) {
        let layout = &network.layout;
        let [scaled, q, r] = &mut self.scratch;
        for layer in 0..LAYERS {
            let q_before: &[f32] = if layer == 0 { &self.by_gradient } else { q };
            product_of(&self.passed[layer], &self.slopes[layer], scaled);
            let dims = [layout.depth(layer), layout.width];
            add_outer_products::<N>(
                q_before,
                scaled,
                dims,
                &mut self.sums[layout.weights(layer)],
            );
            multiply::<N>(q_before, &network.forward[layer], &[], r);
            let (values, slopes) = (&self.values[layer], &self.slopes[layer]);
            network
                .activation
                .bend(values, slopes, r, &mut self.passed[layer]);
            std::mem::swap(q, r);
        }
        add_column_sums(q, &mut self.sums[layout.output_weights()]);
    }

    #[inline(always)]
    fn backward_by<const N: usize>(&mut self, network: &PreparedNetwork, parts: BackwardParts) {
        let layout = &network.layout;
        let [delta, z, _] = &mut self.scratch;
        let weights = network.slice(layout.output_weights());
        let of_output = &mut self.sums[layout.output_weights()];
        let rows = z.chunks_exact_mut(layout.width);
        let inputs = self.values[LAYERS - 1].chunks_exact(layout.width);
        for ((z, input), &by_output) in rows.zip(inputs).zip(&self.by_output) {
            for (((z, &x), &weight), sum) in
                z.iter_mut().zip(input).zip(weights).zip(&mut *of_output)
            {
                *z = by_output * weight;
                *sum = by_output.mul_add(x, *sum);
            }
        }
        self.sums[layout.output_bias()] += self.by_output.iter().sum::<f32>();
        if parts.has_head {
            add_to(z, &self.by_last);
        }
        for layer in (0..LAYERS).rev() {
            product_of(z, &self.slopes[layer], delta);
            if parts.has_gradient {
                add_to(delta, &self.passed[layer]);
            }
            let input = match layer {
                0 => &self.positions,
                _ => &self.values[layer - 1],
            };
            let dims = [layout.depth(layer), layout.width];
            add_outer_products::<N>(input, delta, dims, &mut self.sums[layout.weights(layer)]);
            add_column_sums(delta, &mut self.sums[layout.biases(layer)]);
            if layer > 0 {
                multiply::<N>(delta, &network.backward[layer], &[], z);
            }
        }
    }

    /// The last hidden layer, `[BLOCK, width]`.
    pub(super) fn last(&self) -> &[f32] {
        &self.values[LAYERS - 1]
    }
}

/// The inputs of a block's loss besides the output.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BackwardParts {
    /// Whether `by_last` has the derivatives from the head.
    pub(crate) has_head: bool,
    /// Whether [`Workspace::pull_back_gradient`] was called.
    pub(crate) has_gradient: bool,
}

struct Forward<'a>(&'a mut Workspace, &'a PreparedNetwork);

impl Kernel for Forward<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        self.0.forward_by::<N>(self.1);
    }
}

struct Gradient<'a>(&'a mut Workspace, &'a PreparedNetwork);

impl Kernel for Gradient<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        self.0.gradient_by::<N>(self.1);
    }
}

struct PullBackGradient<'a>(&'a mut Workspace, &'a PreparedNetwork);

impl Kernel for PullBackGradient<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        self.0.pull_back_gradient_by::<N>(self.1);
    }
}

struct Backward<'a>(&'a mut Workspace, &'a PreparedNetwork, BackwardParts);

impl Kernel for Backward<'_> {
    #[inline(always)]
    fn run<const N: usize>(self) {
        self.0.backward_by::<N>(self.1, self.2);
    }
}

#[inline(always)]
fn product_of(a: &[f32], b: &[f32], target: &mut [f32]) {
    for ((target, a), b) in target.iter_mut().zip(a).zip(b) {
        *target = a * b;
    }
}

#[inline(always)]
fn add_to(target: &mut [f32], x: &[f32]) {
    for (target, x) in target.iter_mut().zip(x) {
        *target += x;
    }
}

/// The scalar product in 16 sums, which are then added in a fixed order.
#[inline(always)]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let (a, _) = a.as_chunks::<16>();
    let (b, _) = b.as_chunks::<16>();
    let mut sums = [0.0f32; 16];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..16 {
            sums[lane] = a[lane].mul_add(b[lane], sums[lane]);
        }
    }
    let mut width = 8;
    while width > 0 {
        for lane in 0..width {
            sums[lane] += sums[lane + width];
        }
        width /= 2;
    }
    sums[0]
}
