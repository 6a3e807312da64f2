//! Compares small networks with PyTorch, forward and backward: `vectors.safetensors` contains the results of PyTorch.
//!
//! Weights, inputs and the constants by which the outputs are multiplied are not in the file. Both sides compute them from their
//! names (`planted`). The file contains the tokens: cells and axes of two shapes, of which one is shorter than a patch.

use crate::data::curve::Cell;
use crate::data::hierarchy::{Hierarchy, fixed_orders};
use crate::data::level_rows::{LevelRows, levels_of};
use crate::data::neighbors::Neighbors;
use crate::data::tokens::Tokens;
use crate::model::backbones::backbone::{N_FEATURES, matrix};
use crate::model::backbones::ptv3::Ptv3;
use crate::model::backbones::ptv3::block::{Attention, Block, Mlp, Xcpe};
use crate::model::backbones::stem::{STEM_VOLUME, Stem, stem_neighbors};
use crate::model::backbones::u_net::{DecoderStage, EncoderStage, UNetSettings};
use crate::model::backbones::{Ptv3Config, Stages};
use crate::model::forward_mode::ForwardMode;
use crate::model::layers::NormKind;
use crate::model::layers::{Linear, Norm};
use crate::model::parameters::{self, Initializer, host_values};
use crate::testing::ptv3;
use burn::module::Module;
use burn::tensor::{Device, Tensor, TensorData};
use safetensors::SafeTensors;

const FILE: &[u8] = include_bytes!("vectors.safetensors");
/// Channels of the blocks: one head.
const WIDTH: usize = 16;
/// The allowed relative L2 norm of the difference between the two implementations, tensor by tensor.
const BLOCK_TOLERANCE: f64 = 1e-4;
const NETWORK_TOLERANCE: f64 = 1e-3;

/// Numbers between −1 and 1 that depend only on a name: splitmix64, seeded by the name's FNV-1a hash.
fn planted(name: &str, n: usize) -> Vec<f32> {
    let seed = name.bytes().fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
    });
    let draw = |idx: u64| {
        let mut z = seed.wrapping_add((idx + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    };
    (0..n as u64).map(draw).collect()
}

/// The module with planted values. The values of matrices are smaller if they have more inputs, and scales are near 1.
fn with_planted_values<M: Module>(module: M, case: &str) -> M {
    let mut values = Vec::new();
    for shape in parameters::shapes(&module) {
        let is_scale =
            shape.name.ends_with("norm.weight") || shape.name.ends_with("running_variance");
        let size = if shape.dims.len() == 2 {
            (1.0 / shape.dims[0] as f32).sqrt()
        } else {
            0.5
        };
        let around = if is_scale { 1.0 } else { 0.0 };
        let own = planted(&format!("{case}/{}", shape.name), shape.len());
        values.extend(own.into_iter().map(|x| around + size * x));
    }
    parameters::with_values(module, &values)
}

/// A tensor of the file, as f64.
fn expected(name: &str) -> Vec<f64> {
    let file = SafeTensors::deserialize(FILE).unwrap();
    let view = file
        .tensor(name)
        .unwrap_or_else(|_| panic!("{name} is not in the vectors"));
    view.data()
        .chunks_exact(4)
        .map(|word| f64::from(f32::from_le_bytes(word.try_into().unwrap())))
        .collect()
}

fn length(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|x| x * x).sum::<f64>().sqrt()
}

#[track_caller]
fn assert_close(name: &str, found: &[f32], tolerance: f64) {
    let expected = expected(name);
    assert_eq!(found.len(), expected.len(), "{name}");
    let apart = length(found.iter().zip(&expected).map(|(&x, y)| f64::from(x) - y));
    let size = length(expected.iter().copied());
    assert!(apart <= tolerance * size, "{name}: {apart:e} of {size:e}");
}

fn tokens(shape: usize) -> Tokens {
    let read = |name: &str| expected(&format!("tokens.{shape}.{name}"));
    let cells: Vec<Cell> = read("cells")
        .chunks(3)
        .map(|cell| [cell[0] as u32, cell[1] as u32, cell[2] as u32])
        .collect();
    let n = cells.len();
    Tokens {
        positions: vec![[0.0; 3]; n],
        normals: vec![[0.0; 3]; n],
        cells,
        axes: read("axes").iter().map(|&axis| axis as u8).collect(),
        token_of_point: vec![],
        multiplicity: vec![1; n],
    }
}

fn device() -> Device {
    Device::flex().autodiff()
}

/// Both shapes, on two levels, with the patches of the config below.
fn levels() -> Vec<LevelRows> {
    let config = config(NormKind::Layer);
    let hierarchies = [0, 1].map(|shape| {
        Hierarchy::new(
            &tokens(shape),
            config.patch,
            &fixed_orders(2, &config.orders),
        )
    });
    levels_of(&hierarchies.each_ref())
}

fn config(norm: NormKind) -> Ptv3Config {
    Ptv3Config {
        norm,
        patch: 16,
        ..ptv3()
    }
}

fn n_tokens(level: usize) -> usize {
    levels()[level].shapes.iter().map(|shape| shape.n).sum()
}

/// Planted features of both shapes.
fn features(case: &str) -> Tensor<2> {
    let n = |shape| tokens(shape).n();
    let all = [0, 1]
        .map(|shape| planted(&format!("{case}/features.{shape}"), n(shape) * N_FEATURES))
        .concat();
    matrix(all, n_tokens(0), &device())
}

/// The 5³ neighborhoods of both shapes.
fn around() -> Neighbors {
    let each = [0, 1].map(|shape| stem_neighbors(&tokens(shape)));
    Neighbors::joined(&each.each_ref())
}

fn init() -> Device {
    Device::flex()
}

/// Runs a module in training on planted rows, and compares output, gradients and batch statistics.
#[track_caller]
fn check<M: Module>(
    case: &str,
    tolerance: f64,
    module: M,
    n_rows: &[usize],
    forward: impl Fn(&M, &[Tensor<2>], &mut ForwardMode) -> Tensor<2>,
) {
    let module = with_planted_values(module, case).train();
    let input = |(idx, &n): (usize, &usize)| -> Tensor<2> {
        let values = planted(&format!("{case}/rows.{idx}"), n * WIDTH);
        Tensor::from_data(TensorData::new(values, [n, WIDTH]), &device()).require_grad()
    };
    let inputs: Vec<Tensor<2>> = n_rows.iter().enumerate().map(input).collect();
    let mut mode = ForwardMode::repeatable();
    let output = forward(&module, &inputs, &mut mode);
    let constant = planted(&format!("{case}/constant"), output.dims().iter().product());
    let constant = Tensor::from_data(TensorData::new(constant, output.dims()), &device());
    assert_close(
        &format!("{case}/output"),
        &host_values(output.clone()),
        tolerance,
    );
    let statistics = mode.into_statistics();
    if !statistics.is_empty() {
        assert_close(&format!("{case}/statistics"), &statistics, tolerance);
    }
    let mut gradients = (output * constant).sum().backward();
    for (idx, input) in inputs.iter().enumerate() {
        let found = host_values(input.grad_remove(&mut gradients).unwrap());
        assert_close(&format!("{case}/rows.{idx}.gradient"), &found, tolerance);
    }
    let found = parameters::gradients(&module, &mut gradients);
    let mut rest = found.as_slice();
    for shape in parameters::shapes(&module) {
        let (own, after) = rest.split_at(shape.len());
        rest = after;
        if case.ends_with("batch") && shape.name.ends_with("linear.bias") {
            // The following batch norm removes the bias, so its gradient is 0 except for rounding.
            let matrix = expected(&format!(
                "{case}/{}.gradient",
                shape.name.replace("linear.bias", "linear.weight")
            ));
            let size = length(own.iter().map(|&x| f64::from(x)));
            assert!(
                size <= tolerance * length(matrix.into_iter()),
                "{case}/{}: {size:e}",
                shape.name
            );
        } else if !shape.is_statistic() {
            assert_close(&format!("{case}/{}.gradient", shape.name), own, tolerance);
        }
    }
}

#[test]
fn the_pieces_of_a_block() {
    let (levels, device) = (levels(), init());
    let init = Initializer::zeros(&device);
    let n = n_tokens(0);
    check(
        "xcpe",
        BLOCK_TOLERANCE,
        Xcpe::new(&init, "", WIDTH),
        &[n],
        |xcpe, rows, _| xcpe.forward(rows[0].clone(), &levels[0]),
    );
    // Both levels have patches with a filled-up end, and a shape that is shorter than a patch.
    for (level, curve) in [(0, 0), (0, 3), (1, 2)] {
        let attention = Attention::new(&init, "", WIDTH, curve);
        check(
            &format!("attention.{level}.{curve}"),
            BLOCK_TOLERANCE,
            attention,
            &[n_tokens(level)],
            |attention, rows, _| attention.forward(rows[0].clone(), &levels[level]),
        );
    }
    check(
        "mlp",
        BLOCK_TOLERANCE,
        Mlp::new(&init, "", WIDTH),
        &[n],
        |mlp, rows, _| mlp.forward(rows[0].clone()),
    );
}

#[test]
fn stem_pooling_and_unpooling_with_either_norm() {
    let (levels, device) = (levels(), init());
    let init = Initializer::zeros(&device);
    let stages = Stages {
        encoder_depths: vec![0, 0],
        encoder_widths: vec![WIDTH, WIDTH],
        decoder_depths: vec![0],
        decoder_widths: vec![WIDTH],
    };
    for (norm, kind) in [("layer", NormKind::Layer), ("batch", NormKind::Batch)] {
        let stem = format!("stem.{norm}");
        check(
            &stem,
            BLOCK_TOLERANCE,
            Stem::new(&init, kind, [STEM_VOLUME * N_FEATURES, 2]),
            &[],
            |module, _, mode| module.forward(features(&stem), &around(), mode),
        );
        let settings = UNetSettings {
            stages: &stages,
            norm: kind,
            drop_path: 0.0,
        };
        let block = |name: &str, settings| Block::new(&init, name, &config(kind), settings);
        let pool = EncoderStage::all(&init, settings, block).remove(1);
        check(
            &format!("pool.{norm}"),
            BLOCK_TOLERANCE,
            pool,
            &[n_tokens(0)],
            |stage, rows, mode| stage.pool(rows[0].clone(), &levels[0], mode),
        );
        let unpool = DecoderStage::all(&init, settings, block).remove(0);
        check(
            &format!("unpool.{norm}"),
            BLOCK_TOLERANCE,
            unpool,
            &[n_tokens(1), n_tokens(0)],
            |stage, rows, mode| stage.forward(rows[0].clone(), rows[1].clone(), &levels[0], mode),
        );
    }
}

/// A backbone of two stages and a head. With batch norms it has no block, so that the file is small.
#[derive(Module, Debug)]
struct Small {
    backbone: Ptv3,
    head: Linear,
}

fn small(norm: NormKind, device: &Device) -> Small {
    let init = Initializer::zeros(device);
    let stages = Stages {
        encoder_depths: vec![0, usize::from(norm == NormKind::Layer)],
        encoder_widths: vec![WIDTH, WIDTH],
        decoder_depths: vec![0],
        decoder_widths: vec![WIDTH],
    };
    let backbone = Ptv3::with_stages(&init, &stages, &config(norm));
    Small {
        backbone,
        head: Linear::new(&init, "head", [WIDTH, 8]),
    }
}

#[test]
fn a_whole_network_with_either_norm() {
    let (levels, device) = (levels(), init());
    for (norm, kind) in [("layer", NormKind::Layer), ("batch", NormKind::Batch)] {
        let case = format!("network.{norm}");
        check(
            &case,
            NETWORK_TOLERANCE,
            small(kind, &device),
            &[],
            |network, _, mode| {
                network.head.forward(network.backbone.forward_levels(
                    features(&case),
                    &around(),
                    &levels,
                    mode,
                ))
            },
        );
    }
}

#[test]
fn batch_norms_at_test_time() {
    let (levels, device) = (levels(), init());
    let network = with_planted_values(small(NormKind::Batch, &device), "network.batch");
    let rows = network.backbone.forward_levels(
        features("network.batch"),
        &around(),
        &levels,
        &mut ForwardMode::Test,
    );
    let norm = with_planted_values(
        Norm::new(&Initializer::zeros(&device), NormKind::Batch, 3),
        "norm",
    );
    let plain: Tensor<2> =
        Tensor::from_data(TensorData::new(planted("norm/rows", 15), [5, 3]), &device);
    assert_close(
        "norm/test_output",
        &host_values(norm.forward(plain, &mut ForwardMode::Test)),
        BLOCK_TOLERANCE,
    );
    assert_close(
        "network.batch/test_output",
        &host_values(network.head.forward(rows)),
        NETWORK_TOLERANCE,
    );
}
