//! The program `partprobe` as a library: verbs, configs, files and printing; every computation is another crate's.
//!
//! Results go to stdout, progress and warnings to stderr. A verb ends with 0 (done), 1 (failed) or 2 (usage),
//! and an error is printed once, here.

pub mod atomic_write;
pub mod config;
pub mod inspect;
pub mod json_lines;
pub mod measured;
pub mod progress;
pub mod usage;
pub mod verify;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// STEP files in, part labels out, and a fair comparison of the labels that train point-cloud networks.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true, arg_required_else_help = true, max_term_width = 110)]
#[command(after_help = "Start with `partprobe run smoke`, which needs no data, or with `partprobe inspect FILE`.
Every verb explains itself: `partprobe label --help`. Exit codes: 0 done, 1 failed, 2 wrong usage.")]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
enum Verb {
    Inspect(inspect::InspectArgs),
    Verify(verify::VerifyArgs),
}

/// Runs the program on the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    let outcome = match Cli::parse().verb {
        Verb::Inspect(args) => inspect::inspect(&args),
        Verb::Verify(args) => verify::verify(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(if error.is::<usage::UsageError>() { 2 } else { 1 })
        }
    }
}
