//! The program `partprobe` as a library: verbs, configs, files and printing; every computation is another crate's.
//!
//! Results go to stdout, progress and warnings to stderr. A verb ends with 0 (done), 1 (failed), 2 (usage) or 130 (stopped),
//! and an error is printed once, here.

#![cfg_attr(
    not(feature = "train"),
    allow(
        dead_code,
        reason = "what training alone uses stays beside what labeling uses"
    )
)]

#[cfg(feature = "train")]
mod allocator;
mod audit;
#[cfg(feature = "train")]
mod bench;
mod calibrate;
mod check;
mod clock;
mod compare;
mod config;
mod counted;
mod damaged_carriers;
mod dataset_settings;
mod export;
mod extract;
mod file_size_limit;
mod folder_lock;
mod inspect;
mod interrupt;
mod label;
mod merge;
#[cfg(feature = "train")]
mod models;
mod output_folder;
#[cfg(feature = "train")]
mod parity;
mod progress;
mod render;
#[cfg(feature = "train")]
mod run;
mod sample;
mod shape_choice;
mod shape_source;
mod source_card;
mod source_list;
mod sources;
mod status;
mod stderr;
mod stdout;
mod synth;
mod tessellation;
mod usage;
mod verify;

use clap::{Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// STEP files in, part labels out, and a fair comparison of the labels that train point-cloud networks.
#[derive(Debug, Parser)]
#[command(
    version,
    propagate_version = true,
    arg_required_else_help = true,
    max_term_width = 110
)]
#[cfg_attr(
    feature = "train",
    command(
        after_help = "The stages, each alone: label, sample, train, embed, eval; `run` does all of them.
Start with `partprobe run smoke`, which needs no data, or with `partprobe inspect FILE`.
Every verb explains itself, for example `partprobe label --help`. Exit codes: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C."
    )
)]
#[cfg_attr(
    not(feature = "train"),
    command(
        after_help = "This program was built without training. Build it with `cargo install --path crates/cli` for run, train, embed and eval.
Start with `partprobe inspect FILE`. Every verb explains itself, for example `partprobe label --help`.
Exit codes: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C."
    )
)]
struct Cli {
    #[command(subcommand)]
    verb: Verb,
}

/// What the program can do.
#[derive(Debug, Subcommand)]
enum Verb {
    #[cfg(feature = "train")]
    Run(run::RunArgs),
    Label(label::LabelArgs),
    Merge(merge::MergeArgs),
    Status(status::StatusArgs),
    Sample(sample::SampleArgs),
    #[cfg(feature = "train")]
    Train(run::TrainArgs),
    #[cfg(feature = "train")]
    Replay(run::ReplayArgs),
    #[cfg(feature = "train")]
    Embed(run::EmbedArgs),
    #[cfg(feature = "train")]
    Eval(run::EvalArgs),
    Inspect(inspect::InspectArgs),
    Extract(extract::ExtractArgs),
    Render(render::RenderArgs),
    Synth(synth::SynthArgs),
    Verify(verify::VerifyArgs),
    Export(export::ExportArgs),
    Check(check::CheckArgs),
    Calibrate(calibrate::CalibrateArgs),
    Compare(compare::CompareArgs),
    Tessellation(tessellation::TessellationArgs),
    #[cfg(feature = "train")]
    Bench(bench::BenchArgs),
    #[cfg(feature = "train")]
    Models(models::ModelsArgs),
    Sources(sources::SourcesArgs),
    #[command(hide = true)]
    Worker(label::WorkerArgs),
    #[cfg(feature = "train")]
    #[command(hide = true)]
    Parity(parity::ParityArgs),
}

/// Runs the program on the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    file_size_limit::report_as_error();
    let done = |()| ExitCode::SUCCESS;
    let matches = flowing(Cli::command()).get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let outcome = match cli.verb {
        #[cfg(feature = "train")]
        Verb::Run(args) => run::run(&args),
        Verb::Label(args) => label::label(&args).map(done),
        Verb::Merge(args) => merge::merge(&args).map(done),
        Verb::Status(args) => status::status(&args).map(done),
        Verb::Sample(args) => sample::sample(&args).map(done),
        #[cfg(feature = "train")]
        Verb::Train(args) => run::train(&args),
        #[cfg(feature = "train")]
        Verb::Replay(args) => run::replay(&args),
        #[cfg(feature = "train")]
        Verb::Embed(args) => run::embed(&args),
        #[cfg(feature = "train")]
        Verb::Eval(args) => run::evaluate_run(&args),
        Verb::Inspect(args) => inspect::inspect(&args).map(done),
        Verb::Extract(args) => extract::extract(&args).map(done),
        Verb::Render(args) => render::render(&args).map(done),
        Verb::Synth(args) => synth::synth(&args).map(done),
        Verb::Verify(args) => verify::verify(&args).map(done),
        Verb::Export(args) => export::export(&args).map(done),
        Verb::Check(args) => check::check(&args).map(done),
        Verb::Calibrate(args) => calibrate::calibrate(&args).map(done),
        Verb::Compare(args) => compare::compare(&args).map(done),
        Verb::Tessellation(args) => tessellation::tessellation(&args).map(done),
        #[cfg(feature = "train")]
        Verb::Bench(args) => bench::bench(&args).map(done),
        #[cfg(feature = "train")]
        Verb::Models(args) => models::models(&args).map(done),
        Verb::Sources(args) => sources::sources(&args).map(done),
        #[cfg(feature = "train")]
        Verb::Parity(args) => parity::parity(&args).map(done),
        Verb::Worker(args) => label::worker(&args).map(done),
    };
    outcome.unwrap_or_else(|error| {
        if stdout::is_closed(&error) {
            return ExitCode::SUCCESS;
        }
        stderr::print_line(format_args!("error: {error:#}"));
        ExitCode::from(exit_code(&error))
    })
}

/// Lets the width of the terminal decide where the sentences below a verb's help break.
fn flowing(command: Command) -> Command {
    let names: Vec<String> = command
        .get_subcommands()
        .map(|verb| verb.get_name().to_owned())
        .collect();
    let text = command.get_after_help().map(ToString::to_string);
    let command = match text {
        Some(text) => command.after_help(joined(&text)),
        None => command,
    };
    names.into_iter().fold(command, |command, name| {
        command.mut_subcommand(name, flowing)
    })
}

/// Joins the lines that a sentence was broken into; examples are indented and stay as they are.
fn joined(text: &str) -> String {
    let mut joined = String::new();
    let mut is_open = false;
    for line in text.lines() {
        let is_prose = !line.is_empty() && !line.starts_with(' ');
        if !joined.is_empty() {
            joined.push(if is_open && is_prose { ' ' } else { '\n' });
        }
        joined.push_str(line);
        is_open = is_prose && !line.starts_with("Example") && !line.ends_with(['.', ':']);
    }
    joined
}

/// 130 where the user stopped the work, 2 where the call cannot be meant, 1 for any other error.
fn exit_code(error: &anyhow::Error) -> u8 {
    if interrupt::was_asked() {
        interrupt::EXIT_CODE
    } else if usage::is_usage_error(error) {
        2
    } else {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        flowing(Cli::command()).debug_assert();
    }

    #[test]
    fn sentences_are_joined_and_examples_are_not() {
        for (text, expected) in [
            ("One\ntwo.\nThree\nfour.", "One two.\nThree four."),
            (
                "Examples:\n  a\n  b\n\nOne\ntwo.",
                "Examples:\n  a\n  b\n\nOne two.",
            ),
            ("Example: a b\nOne.", "Example: a b\nOne."),
            ("", ""),
        ] {
            assert_eq!(joined(text), expected);
        }
    }
}
