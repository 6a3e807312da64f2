//! Runs `partprobe bench step`: measures an update of the weights and a forward pass on a generated part.

use super::timing::{cpu_seconds, median_ms};
use crate::allocator::keep_freed_memory;
use crate::config::{Config, load};
use crate::label::carriers_of_text;
use crate::points::points_of;
use crate::stdout::print_line;
use anyhow::{Context, Result};
use partprobe_dataset::write_atomically;
use partprobe_net::{Backend, TrainConfig, TrainSettings, TrainShape, Training, tokens_file};
use partprobe_sources::source_named;
use serde::Serialize;
use std::path::PathBuf;

/// Measure the time and memory of an update and of a forward pass.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe bench step
  partprobe bench step --tokens 20000 --jobs 2
  partprobe bench step --set net.backbone.preset=tiny --json

load: augmentation, tokens, and tables of neighbors and patches. A training does this before its updates.
step: forward, loss, backward and AdamW, on --batch copies of one generated part, each in its own pose.
tables, forward: the tables of neighbors and patches, then the network alone, for the first copy at test time.
Times are medians over --steps updates. cpu_ms is the CPU time of the whole process, which is more reliable on a busy machine.")]
pub(super) struct StepArgs {
    /// The approximate number of tokens in a shape.
    #[arg(long, value_name = "N", default_value_t = 4096)]
    tokens: usize,
    /// The number of shapes per update.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// The number of measured updates. Two more are done before them.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..))]
    steps: u16,
    /// The number of threads, which compute the shapes of a batch in parallel.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: u16,
    /// Settings to start from: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Write the tokens of the first copy, on which another implementation can be measured.
    #[arg(long, value_name = "FILE", hide = true)]
    tokens_out: Option<PathBuf>,
    /// Print one JSON object instead of lines.
    #[arg(long)]
    json: bool,
}

/// What was measured.
#[derive(Serialize)]
struct StepFigures {
    parameters: usize,
    tokens: usize,
    batch: u16,
    threads: u16,
    /// The time of augmentation, tokens and tables of a batch on one thread. A training does this ahead of the step.
    load_ms: f64,
    step_ms: f64,
    step_cpu_ms: f64,
    tables_ms: f64,
    forward_ms: f64,
    shapes_per_minute: f64,
    /// The highest resident memory of this process so far, or `None` if the system does not report it.
    peak_memory_mib: Option<f64>,
}

/// Measures and prints.
///
/// # Errors
/// If a setting is out of its range, or the output cannot be written.
pub(super) fn bench_step(args: &StepArgs) -> Result<()> {
    keep_freed_memory(args.jobs.into());
    let figures = measure(args)?;
    if args.json {
        return print_line(serde_json::to_string(&figures)?);
    }
    let memory = figures
        .peak_memory_mib
        .map_or_else(|| "unknown".to_owned(), |mib| format!("{mib:.0} MiB"));
    print_line(format!(
        "{} parameters, {} tokens, batch {}, {} threads
load {:.1} ms; step {:.1} ms ({:.1} CPU ms), {:.0} shapes a minute; tables {:.1} ms, forward {:.1} ms; peak memory {memory}",
        figures.parameters,
        figures.tokens,
        figures.batch,
        figures.threads,
        figures.load_ms,
        figures.step_ms,
        figures.step_cpu_ms,
        figures.shapes_per_minute,
        figures.tables_ms,
        figures.forward_ms,
    ))
}

fn measure(args: &StepArgs) -> Result<StepFigures> {
    let config = load(&args.config, &args.set)?.config;
    let shape = generated_shape(args.tokens, &config)?;
    let batch: Vec<TrainShape> = (0..args.batch)
        .map(|copy| TrainShape {
            id: format!("{}-{copy}", shape.id),
            ..shape.clone()
        })
        .collect();
    let mut training = Training::new(&config.net, &settings(&config, args), Backend::Flex)?
        .with_threads(args.jobs.into())?;
    let (tokens, labels) = training.loading().tokens(&batch[0], 0)?;
    if let Some(path) = &args.tokens_out {
        write_atomically(path, &tokens_file(&tokens, &labels)?)?;
    }
    let load_ms = median_ms(args.steps, || training.load(&batch))?;
    let (step_ms, step_cpu_ms) = measure_steps(&mut training, &batch, args.steps)?;
    let model = training.model();
    let tables_ms = median_ms(args.steps, || anyhow::Ok(model.prepare(&tokens)))?;
    let prepared = model.prepare(&tokens);
    let forward_ms = median_ms(args.steps, || model.embed_prepared(&prepared))?;
    Ok(StepFigures {
        parameters: model.n_parameters() + model.n_head_parameters(),
        tokens: tokens.n(),
        batch: args.batch,
        threads: args.jobs,
        load_ms,
        step_ms,
        step_cpu_ms,
        tables_ms,
        forward_ms,
        shapes_per_minute: 6e4 * f64::from(args.batch) / step_ms,
        peak_memory_mib: peak_memory_mib(),
    })
}

/// The median time of a step and the mean of its CPU time, in milliseconds, after two that do not count. The poses are the same
/// in each step, because the time depends on the position of a shape in the grid.
fn measure_steps(training: &mut Training, batch: &[TrainShape], n: u16) -> Result<(f64, f64)> {
    let loaded = training.load(batch)?;
    for _ in 0..2 {
        training.step(&loaded)?;
    }
    let cpu_before = cpu_seconds();
    let step_ms = median_ms(n, || training.step(&loaded))?;
    Ok((step_ms, (cpu_seconds() - cpu_before) * 1e3 / f64::from(n)))
}

/// A generated part with ten points per token, so that almost no voxel of its surface is empty.
fn generated_shape(n_tokens: usize, config: &Config) -> Result<TrainShape> {
    let part = partprobe_synth::part(
        &partprobe_synth::SynthSettings {
            seed: 1,
            min_parts: 8,
            max_parts: 12,
        },
        0,
    );
    let carriers = carriers_of_text(part.step.as_bytes(), &part.name, &config.label)?;
    let carrier = carriers
        .first()
        .context("the generated part has no carrier")?;
    let wanted = crate::config::SampleConfig {
        n_points: 10 * n_tokens,
        ..config.sample.clone()
    };
    let sample = points_of(&part.name, carrier, &wanted)?;
    let labels = source_named("step-parts")?
        .labels(carrier, 0)?
        .label_of_points(&sample)?;
    Ok(TrainShape {
        id: part.name,
        sample,
        labels,
    })
}

fn settings(config: &Config, args: &StepArgs) -> TrainSettings {
    let train = TrainConfig {
        steps: usize::from(args.steps) + 2,
        batch_shapes: args.batch.into(),
        accumulate: 1,
        ..TrainConfig::default()
    };
    let tokens = partprobe_net::TokenConfig {
        train_tokens: args.tokens.into(),
        test_tokens: args.tokens,
        ..config.tokens
    };
    let Config {
        loss,
        optim,
        augment,
        ..
    } = config.clone();
    TrainSettings {
        loss,
        optim,
        augment,
        tokens,
        train,
    }
}

fn peak_memory_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib / 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_short_bench_has_figures_and_its_tokens() {
        let dir = tempfile::tempdir().unwrap();
        let tokens_out = dir.path().join("tokens.safetensors");
        let args = StepArgs {
            tokens: 64,
            batch: 2,
            steps: 1,
            jobs: 2,
            config: "base".to_owned(),
            set: Vec::new(),
            tokens_out: Some(tokens_out.clone()),
            json: false,
        };
        let figures = measure(&args).unwrap();
        assert!((40..100).contains(&figures.tokens), "{}", figures.tokens);
        assert!(figures.step_ms > 0.0 && figures.tables_ms > 0.0 && figures.forward_ms > 0.0);
        assert!(figures.shapes_per_minute > 0.0);
        let bytes = std::fs::read(tokens_out).unwrap();
        let tensors = safetensors::SafeTensors::deserialize(&bytes).unwrap();
        for (name, width) in [("features", 6), ("cells", 3), ("axes", 1), ("labels", 1)] {
            assert_eq!(
                tensors.tensor(name).unwrap().shape(),
                [figures.tokens, width],
                "{name}"
            );
        }
    }
}
