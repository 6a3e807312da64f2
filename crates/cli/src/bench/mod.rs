//! `partprobe bench`: how long the parts of the program take on this machine.
//!
//! What goes in are settings; what comes out is a table or JSON on stdout. Nothing is written, and no test asks for
//! a time: figures are to be compared with others of the same run only.

mod step;

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
