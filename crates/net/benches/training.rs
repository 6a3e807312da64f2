//! Measures the steps of a training on one generated part of 4 096 tokens: tokens, loading, and one update of the
//! weights. Measures the layer `mean-shift`, too.

use divan::Bencher;
use partprobe_carrier::{Embeddings, NormalKind, keyed_rng, sample_by_area, unit_interval};
use partprobe_label::{LabelOptions, label};
use partprobe_net::{
    BackboneConfig, Backend, NetConfig, OptimConfig, Preset, Ptv3Config, RefineConfig,
    ScheduleConfig, TokenConfig, TrainConfig, TrainSettings, TrainShape, Training, Voxels,
    tokenize,
};
use partprobe_synth::SynthSettings;
use std::hint::black_box;

fn main() {
    divan::main();
}

const N_POINTS: usize = 20_000;
const N_TOKENS: usize = 4096;

/// Measures grouping the points of a shape into tokens.
#[divan::bench(sample_count = 20)]
fn tokens(bencher: Bencher<'_, '_>) {
    let shape = generated_shape();
    bencher.bench(|| tokenize(black_box(&shape.sample), N_TOKENS, Voxels::NormalKeyed));
}

/// Measures the work of the loader threads before an update: pose, tokens, jitter and the tables of all levels.
#[divan::bench(args = Preset::ALL.map(Preset::name), sample_count = 20)]
fn loading(bencher: Bencher<'_, '_>, preset: &str) {
    let shape = generated_shape();
    let loading = training(preset).loading();
    bencher.bench(|| loading.load(black_box(&shape), 0).map(drop));
}

/// Measures forward pass, loss, backward pass and AdamW for one shape, on one thread.
#[divan::bench(args = ["micro", "tiny"], sample_count = 10, sample_size = 1)]
fn update(bencher: Bencher<'_, '_>, preset: &str) {
    let mut training = training(preset);
    let batch = training
        .load(&[generated_shape()])
        .expect("a generated part has tokens");
    bencher.bench_local(|| training.step(black_box(&batch)).map(drop));
}

/// Measures eight steps of mean shift after the head, with 128 numbers per token.
#[divan::bench(args = [1024, 2048, 4096], sample_count = 10, sample_size = 1)]
fn mean_shift(bencher: Bencher<'_, '_>, n_tokens: usize) {
    let mut rng = keyed_rng(0, &["mean shift"]);
    let values = (0..n_tokens * 128).map(|_| unit_interval(&mut rng) as f32 - 0.5);
    let rows = Embeddings::new(128, values.collect()).expect("whole rows");
    let layer = RefineConfig::MeanShift {
        kappa: 20.0,
        steps: 8,
    };
    let multiplicity = vec![1; n_tokens];
    bencher.bench(|| layer.refined(black_box(&rows), &multiplicity).map(drop));
}

fn generated_shape() -> TrainShape {
    let settings = SynthSettings {
        seed: 0,
        min_parts: 8,
        max_parts: 16,
    };
    let part = partprobe_synth::part(&settings, 0);
    let file = label(part.step.as_bytes(), &part.name, &LabelOptions::default())
        .expect("a generated part can be read");
    let carrier = file
        .shapes
        .into_iter()
        .find_map(|shape| shape.carrier.ok())
        .expect("a generated part has a carrier");

    let rng = &mut keyed_rng(0, &["bench"]);
    let sample = sample_by_area(carrier.mesh(), N_POINTS, NormalKind::Triangle, rng)
        .expect("a carrier has area");
    let of_face = carrier.part_of_face();
    let labels = sample
        .triangles
        .iter()
        .map(|&triangle| of_face[carrier.mesh().tri_face[triangle as usize] as usize])
        .collect();
    TrainShape {
        id: part.name,
        sample,
        labels,
    }
}

fn training(preset: &str) -> Training {
    let preset = Preset::ALL
        .into_iter()
        .find(|found| found.name() == preset)
        .expect("a preset of this name");
    let ptv3 = Ptv3Config {
        preset,
        ..Ptv3Config::default()
    };
    let net = NetConfig {
        backbone: BackboneConfig::Ptv3(ptv3),
        ..NetConfig::default()
    };
    Training::new(&net, &settings(), Backend::Flex).expect("settings in their ranges")
}

fn settings() -> TrainSettings {
    TrainSettings {
        optim: OptimConfig {
            schedule: ScheduleConfig::Constant,
            ..OptimConfig::default()
        },
        tokens: TokenConfig {
            train_tokens: N_TOKENS.into(),
            test_tokens: N_TOKENS,
            ..TokenConfig::default()
        },
        train: TrainConfig {
            steps: 1_000_000,
            batch_shapes: 1,
            ..TrainConfig::default()
        },
        ..TrainSettings::default()
    }
}
