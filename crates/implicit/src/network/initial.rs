//! Draws the initial weights.

use super::activation::{Activation, FREQUENCY};
use super::layout::{HEAD_WIDTH, LAYERS, Layout};
use super::trunk::Trunk;
use partprobe_carrier::{keyed_rng, unit_interval};
use std::f64::consts::PI;

/// The radius of the sphere with which a softplus trunk starts, in units of half the longest side of the shape.
const RADIUS: f32 = 0.5;

/// The initial parameters. Those of the trunk depend only on the seed. Those of the head also depend on the number of labels.
pub(super) fn initial_parameters(trunk: Trunk, n_labels: usize, seed: u64) -> Vec<f32> {
    let layout = Layout::new(trunk.width(), n_labels);
    let mut parameters = vec![0.0; layout.n_parameters()];
    match trunk.activation() {
        Activation::Sine => draw_sines(&layout, seed, &mut parameters),
        Activation::Softplus => draw_sphere(&layout, seed, &mut parameters),
    }
    if n_labels > 0 {
        draw_head(&layout, seed, &mut parameters);
    }
    parameters
}

/// The initialization of SIREN: the first layer is uniform in ±1/in, and the others in ±√(6/in)/30, so that sums have the same
/// spread in all layers.
fn draw_sines(layout: &Layout, seed: u64, parameters: &mut [f32]) {
    let mut rng = keyed_rng(seed, &["implicit", "trunk"]);
    let mut draw = |values: &mut [f32], most: f64| {
        for x in values {
            *x = (most * (2.0 * unit_interval(&mut rng) - 1.0)) as f32;
        }
    };
    let of_sines = |depth: usize| (6.0 / depth as f64).sqrt() / f64::from(FREQUENCY);
    for layer in 0..LAYERS {
        let depth = layout.depth(layer);
        let most = if layer == 0 {
            1.0 / depth as f64
        } else {
            of_sines(depth)
        };
        draw(&mut parameters[layout.weights(layer)], most);
        draw(
            &mut parameters[layout.biases(layer)],
            1.0 / (depth as f64).sqrt(),
        );
    }
    draw(
        &mut parameters[layout.output_weights()],
        of_sines(layout.width),
    );
}

/// Geometric initialization (Atzmon and Lipman, "SAL: sign agnostic learning of shapes from raw data", 2020): the distance to a
/// sphere, approximately.
fn draw_sphere(layout: &Layout, seed: u64, parameters: &mut [f32]) {
    let mut rng = keyed_rng(seed, &["implicit", "trunk"]);
    let mut normal = || {
        let radius = (-2.0 * libm::log(1.0 - unit_interval(&mut rng))).sqrt();
        radius * libm::cos(2.0 * PI * unit_interval(&mut rng))
    };
    let spread = (2.0 / layout.width as f64).sqrt();
    for layer in 0..LAYERS {
        for x in &mut parameters[layout.weights(layer)] {
            *x = (spread * normal()) as f32;
        }
    }
    let mean = (PI / layout.width as f64).sqrt();
    for x in &mut parameters[layout.output_weights()] {
        *x = (mean + 1e-4 * normal()) as f32;
    }
    parameters[layout.output_bias()] = -RADIUS;
}

/// Uniform weights that preserve the spread of values through a ReLU (He et al. 2015).
fn draw_head(layout: &Layout, seed: u64, parameters: &mut [f32]) {
    let mut rng = keyed_rng(seed, &["implicit", "head"]);
    let mut draw = |depth: usize| {
        let most = (6.0 / depth as f64).sqrt();
        (most * (2.0 * unit_interval(&mut rng) - 1.0)) as f32
    };
    for x in &mut parameters[layout.head_weights()] {
        *x = draw(layout.width);
    }
    for row in parameters[layout.label_weights()].chunks_exact_mut(layout.label_columns()) {
        for x in &mut row[..layout.n_labels] {
            *x = 0.5 * draw(HEAD_WIDTH);
        }
    }
}
