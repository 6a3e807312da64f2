//! Runs `partprobe replay`: it repeats the update at which a training stopped, shape by shape and as a whole.

use crate::run::{DumpedUpdate, Execution, ExecutionArgs};
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_net::{Backend, TrainError, TrainShape, Training};
use std::path::PathBuf;
use std::process::ExitCode;

/// Repeat the update at which a training stopped because its numbers were no longer finite.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe replay runs/mine/diverged/step-parts-0
The folder contains the state of the training before the update (checkpoint), and the points and labels of the update's shapes
(0.npz, 1.npz, … in the order of batch.json). Each shape is tried alone and then all together, with the same poses.
Exit code 1 if the update fails again, 0 if it does not."
)]
pub(crate) struct ReplayArgs {
    /// The folder that the training wrote when it stopped.
    #[arg(value_name = "DUMP")]
    dump: PathBuf,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Repeats the update, shape by shape and as a whole.
///
/// # Errors
/// If the folder is not a dump.
pub(crate) fn replay(args: &ReplayArgs) -> Result<ExitCode> {
    let execution = Execution::new(&args.execution.machine)?;
    ensure!(
        args.dump.join(DumpedUpdate::FILE).is_file(),
        UsageError(format!(
            "{} is not a dump of a training: it has no batch.json",
            args.dump.display()
        ))
    );
    let dumped = DumpedUpdate::read(&args.dump)?;
    let shapes = dumped.read_shapes(&args.dump)?;
    let checkpoint = DumpedUpdate::checkpoint(&args.dump)?;
    print_line(&dumped.error)?;
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

/// Loss and gradient norm of the update after the checkpoint, with only these shapes.
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
