//! Defines the arguments of `bench`.

use super::sources;
#[cfg(feature = "train")]
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
    #[cfg(feature = "train")]
    Step(step::StepArgs),
    Sources(sources::SourcesArgs),
}

/// Runs the requested measurement.
///
/// # Errors
/// If a setting is out of its range, or the output cannot be written.
pub(crate) fn bench(args: &BenchArgs) -> Result<()> {
    match &args.subject {
        #[cfg(feature = "train")]
        Subject::Step(args) => step::bench_step(args),
        Subject::Sources(args) => sources::bench_sources(args),
    }
}
