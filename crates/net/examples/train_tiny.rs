//! Trains a tiny backbone on eight generated parts and prints the loss of each update.
//!
//! ```sh
//! cargo run --release -p partprobe-net --example train_tiny
//! ```
//!
//! The whole loop is [`fit`]. This file supplies its input and its output: shapes in memory, and an observer that prints. A
//! program whose shapes do not fit into memory implements [`Batches`](partprobe_net::Batches).

use partprobe_carrier::{NormalKind, keyed_rng, sample_by_area};
use partprobe_label::{LabelOptions, label};
use partprobe_net::{
    BackboneConfig, Backend, NetConfig, Observer, Ptv3Config, StepReport, TokenConfig, TrainConfig,
    TrainError, TrainSettings, TrainShape, Training, fit,
};
use std::error::Error;
use std::ops::ControlFlow;

fn main() -> Result<(), Box<dyn Error>> {
    let shapes: Vec<TrainShape> = (0..8).map(shape).collect::<Result<_, _>>()?;
    let mut training = Training::new(&network(), &settings(), Backend::Flex)?.with_threads(2)?;
    let mut batches = training.batches_of(&shapes);
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

/// The smallest PTv3, with short embeddings. The patches are as small as the shapes.
fn network() -> NetConfig {
    NetConfig {
        backbone: BackboneConfig::Ptv3(Ptv3Config {
            patch: 64,
            ..Ptv3Config::default()
        }),
        embedding_dim: 32,
        refine: None,
    }
}

/// The default settings, changed for a quick run of twenty updates with two shapes each.
fn settings() -> TrainSettings {
    TrainSettings {
        tokens: TokenConfig {
            train_tokens: 256.into(),
            test_tokens: 256,
            ..TokenConfig::default()
        },
        train: TrainConfig {
            steps: 20,
            batch_shapes: 2,
            ..TrainConfig::default()
        },
        ..TrainSettings::default()
    }
}
