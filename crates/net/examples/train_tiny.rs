//! Trains a tiny backbone on eight generated parts and prints the loss of each update.
//!
//! ```sh
//! cargo run --release -p partprobe-net --example train_tiny
//! ```
//!
//! The whole loop is [`fit`]. This file supplies its two ends: batches from memory, and an observer that prints.

use partprobe_carrier::{NormalKind, keyed_rng, sample_by_area};
use partprobe_label::{LabelOptions, label};
use partprobe_net::{
    AugmentConfig, BackboneConfig, Backend, Batches, Curve, Hinge, LoadedShape, Loading,
    LossConfig, LossWeight, NetConfig, NoDefect, NormKind, Observer, OptimConfig, Preset,
    Ptv3Config, ScheduleConfig, StepReport, TokenConfig, TrainConfig, TrainError, TrainSettings,
    TrainShape, Training, Voxels, fit,
};
use std::error::Error;
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn Error>> {
    let shapes: Vec<TrainShape> = (0..8).map(shape).collect::<Result<_, _>>()?;
    let mut training = Training::new(&network(), &settings(), Backend::Flex)?.with_threads(2)?;
    let mut batches = InMemory {
        shapes: &shapes,
        loading: training.loading(),
        n_batches: 0,
    };
    fit(&mut training, &mut batches, &mut PrintLoss)?;
    println!(
        "{} parameters were trained",
        training.model().n_parameters()
    );
    Ok(())
}

/// A generated part: 2000 points of its surface with normals, and the STEP part of each.
fn shape(index: u64) -> Result<TrainShape, Box<dyn Error>> {
    let part = partprobe_synth::part(
        &partprobe_synth::SynthSettings {
            seed: 0,
            min_parts: 4,
            max_parts: 8,
        },
        index,
    );
    let file = label(part.step.as_bytes(), &part.name, &LabelOptions::default())?;
    let carrier = file
        .shapes
        .into_iter()
        .next()
        .ok_or("a file has a shape")?
        .carrier?;

    let rng = &mut keyed_rng(0, &["example", &part.name]);
    let sample = sample_by_area(carrier.mesh(), 2000, NormalKind::Triangle, rng)?;
    let of_triangle = carrier.part_of_face();
    let labels = sample.triangles.iter().map(|&triangle| {
        let face = carrier.mesh().tri_face[triangle as usize];
        of_triangle[face as usize]
    });
    Ok(TrainShape {
        id: part.name,
        labels: labels.collect(),
        sample,
    })
}

/// Batches whose shapes are all in memory. `Loading::batch` returns the shapes of a whole update, so that this is right
/// only as long as `accumulate` is 1.
struct InMemory<'a> {
    shapes: &'a [TrainShape],
    loading: Loading,
    n_batches: usize,
}

impl Batches for InMemory<'_> {
    type Error = TrainError;

    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, TrainError> {
        let step = self.n_batches;
        self.n_batches += 1;
        let batch = self.loading.batch(self.shapes.len(), step);
        batch
            .into_iter()
            .map(|idx| self.loading.load(&self.shapes[idx], step))
            .collect()
    }
}

/// An observer that prints the loss.
struct PrintLoss;

impl Observer for PrintLoss {
    type Error = TrainError;

    fn after_step(
        &mut self,
        _: &Training,
        report: &StepReport,
    ) -> Result<ControlFlow<()>, TrainError> {
        println!("step {:>2}: loss {:.4}", report.step, report.loss.total);
        Ok(ControlFlow::Continue(()))
    }
}

/// PTv3 at its smallest.
fn network() -> NetConfig {
    let ptv3 = Ptv3Config {
        preset: Preset::Micro,
        patch: 64,
        norm: NormKind::Layer,
        drop_path: 0.0,
        xcpe: true,
        attention: true,
        orders: Curve::ALL.to_vec(),
        shuffle_orders: true,
    };
    NetConfig {
        backbone: BackboneConfig::Ptv3(ptv3),
        embedding_dim: 32,
    }
}

/// Small settings for a quick run: twenty updates of two shapes each. `configs/base.toml` has the real defaults.
fn settings() -> TrainSettings {
    TrainSettings {
        loss: LossConfig {
            pull_weight: 1.0,
            push_weight: 1.0,
            proto_ce_weight: 1.0,
            pull_margin: 0.1,
            push_margin: 0.3,
            temperature: 0.1,
            hinge: Hinge::Linear,
            weight: LossWeight::Part,
        },
        optim: OptimConfig {
            learning_rate: 2e-3,
            weight_decay: 0.02,
            block_lr_factor: 1.0,
            clip_norm: 3.0,
            schedule: ScheduleConfig::OneCycle {
                warmup_fraction: 0.05,
                div: 10.0,
                final_div: 1000.0,
            },
        },
        augment: AugmentConfig {
            axis_rotations: true,
            free_rotation_probability: 0.5,
            reflect_probability: 0.5,
            scale: [0.8, 1.2],
            jitter_sigma: 0.005,
            jitter_clip: 0.02,
        },
        tokens: TokenConfig {
            train_tokens: 256,
            test_tokens: 256,
            voxels: Voxels::NormalKeyed,
        },
        train: TrainConfig {
            steps: 20,
            batch_shapes: 2,
            accumulate: 1,
            seed: 0,
            defect: NoDefect::None,
        },
    }
}
