//! The arguments of `bench`.

use super::step;
use anyhow::Result;

/// Measure the program on this machine.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct BenchArgs {
    #[command(subcommand)]
    subject: Subject,
}

/// What can be measured.
#[derive(Clone, Debug, clap::Subcommand)]
enum Subject {
    Step(step::StepArgs),
}

/// Measures what was asked for.
///
/// # Errors
/// If a setting is out of its range, or the output cannot be written.
pub(crate) fn bench(args: &BenchArgs) -> Result<()> {
    match &args.subject {
        Subject::Step(args) => step::bench_step(args),
    }
}
