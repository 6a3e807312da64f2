//! An update whose numbers stopped being finite, kept as it was, and `partprobe replay`, which makes it again.

use super::folder::RunFolder;
use super::stages::{Execution, ExecutionArgs};
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::PointSample;
use partprobe_formats::{Compression, SampleLabels, sample_from_npz, sample_to_npz};
use partprobe_net::{Backend, TrainError, TrainShape, Training};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The name under which the labels stand in the files of the shapes.
const LABELS: &str = "supervision";

/// `batch.json` of a dump: the shapes of the update, in their order; shape k stands in `<k>.npz`.
#[derive(Deserialize, Serialize)]
struct Batch {
    format_version: u32,
    /// The update, counted from 1.
    step: usize,
    error: String,
    shapes: Vec<String>,
}

/// Writes the training as it was before the update, and the update's shapes with their points and labels.
///
/// # Errors
/// If a file cannot be written.
pub(super) fn dump(
    folder: &RunFolder,
    relative: &str,
    training: &Training,
    shapes: &[Cow<'_, TrainShape>],
    error: &str,
) -> Result<()> {
    folder.write(&format!("{relative}/checkpoint"), &training.checkpoint()?)?;
    for (k, shape) in shapes.iter().enumerate() {
        let labels = SampleLabels::from([(LABELS.to_owned(), shape.labels.clone())]);
        let bytes = sample_to_npz(&shape.sample, &labels, Compression::Stored)?;
        folder.write(&format!("{relative}/{k}.npz"), &bytes)?;
    }
    let batch = Batch {
        format_version: 1,
        step: training.n_steps_done() + 1,
        error: error.to_owned(),
        shapes: shapes.iter().map(|shape| shape.id.clone()).collect(),
    };
    folder.write_json(&format!("{relative}/batch.json"), &batch)
}

/// Make the update again at which a training stopped because its numbers were no longer finite.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe replay runs/mine/diverged/step-parts-0
The folder holds the training as it was before the update (checkpoint), and the points and labels of the update's shapes
(0.npz, 1.npz, … in the order of batch.json). Each shape is tried alone and then all together, with the same poses.
Exit code 1 if the update fails again, 0 if it does not."
)]
pub(crate) struct ReplayArgs {
    /// The folder that the training left behind.
    #[arg(value_name = "DUMP")]
    dump: PathBuf,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Repeats the update, shape by shape and as a whole.
///
/// # Errors
/// If the folder is no dump.
pub(crate) fn replay(args: &ReplayArgs) -> Result<ExitCode> {
    let execution = Execution::new(&args.execution)?;
    let path = args.dump.join("batch.json");
    ensure!(
        path.is_file(),
        UsageError(format!(
            "{} is not a dump of a training: it has no batch.json",
            args.dump.display()
        ))
    );
    let batch: Batch =
        serde_json::from_slice(&read(&path)?).with_context(|| path.display().to_string())?;
    let shapes = read_shapes(&args.dump, &batch)?;
    let checkpoint = read(&args.dump.join("checkpoint"))?;
    print_line(format_args!("step {}: {}", batch.step, batch.error))?;
    for shape in &shapes {
        let found = update(&checkpoint, std::slice::from_ref(shape), execution.backend)?;
        print_line(format_args!("{}: {}", shape.id, outcome(&found)))?;
    }
    let together = update(&checkpoint, &shapes, execution.backend)?;
    print_line(format_args!("the whole update: {}", outcome(&together)))?;
    Ok(if together.is_ok() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    })
}

fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("reading {}", path.display()))
}

fn read_shapes(dump: &Path, batch: &Batch) -> Result<Vec<TrainShape>> {
    let read_shape = |(k, id): (usize, &String)| {
        let path = dump.join(format!("{k}.npz"));
        let (sample, mut labels): (PointSample, SampleLabels) =
            sample_from_npz(&read(&path)?).with_context(|| path.display().to_string())?;
        let labels = labels
            .remove(LABELS)
            .with_context(|| format!("{} has no labels", path.display()))?;
        Ok(TrainShape {
            id: id.clone(),
            sample,
            labels,
        })
    };
    batch.shapes.iter().enumerate().map(read_shape).collect()
}

/// Loss and gradient norm of the update after the checkpoint, from these shapes alone.
fn update(
    checkpoint: &[u8],
    shapes: &[TrainShape],
    backend: Backend,
) -> Result<Result<(f64, f64), TrainError>> {
    let mut training = Training::resume(checkpoint, backend)?;
    let (loading, step) = (training.loading(), training.n_steps_done());
    let loaded: Result<Vec<_>, TrainError> = shapes
        .iter()
        .map(|shape| loading.load(shape, step))
        .collect();
    Ok(loaded
        .and_then(|batch| training.step(&batch))
        .map(|report| (report.loss.total, report.grad_norm)))
}

fn outcome(found: &Result<(f64, f64), TrainError>) -> String {
    match found {
        Ok((loss, norm)) => format!("loss {loss:.6}, gradient norm {norm:.6}"),
        Err(error) => error.to_string(),
    }
}
