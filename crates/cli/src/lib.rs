//! Implements the program `partprobe`: arguments, configs, processes, progress and printing. It only exports [`main`]. All
//! reusable code is in the libraries that it calls.
//!
//! Results go to stdout, progress and warnings to stderr. Tables are aligned if stdout is a terminal, and Markdown otherwise. The
//! exit code of a verb is 0 (done), 1 (failed), 2 (wrong usage), 3 (a bound is missed) or 130 (stopped). An error is printed once,
//! in this file.

#![cfg_attr(
    not(feature = "train"),
    allow(
        dead_code,
        unused_imports,
        reason = "code that only training uses is in the same modules as code that labeling uses"
    )
)]

mod aligned_tables;
#[cfg(feature = "train")]
mod allocator;
mod audit;
#[cfg(feature = "train")]
mod backbone;
#[cfg(feature = "train")]
mod backbone_labels;
mod clock;
mod command_line;
mod config;
mod counted;
mod damaged_carriers;
mod dataset_settings;
mod disk_files;
mod file_size_limit;
mod folder_lock;
mod given_path;
#[cfg(feature = "train")]
mod implicit;
mod interrupt;
mod label;
mod label_package;
mod label_sources;
mod markdown_table;
mod onnx_library;
mod output_folder;
mod own_output;
mod points;
mod program_version;
mod progress;
#[cfg(feature = "train")]
mod run;
mod run_path;
mod scored_run;
mod shape_choice;
mod shape_input;
mod shape_loop;
mod source_rows;
mod source_types;
mod standard_input;
mod stderr;
mod stdout;
mod usage;
mod verbs;

use clap::{FromArgMatches, Parser};
use command_line::command_line;
use std::io::ErrorKind;
use std::process::ExitCode;
use stdout::TableForm;
use verbs::Verb;

/// Label the parts of STEP files, and compare how well labels train point-cloud networks.
#[derive(Debug, Parser)]
#[command(
    version = program_version::VERSION.as_str(),
    propagate_version = true,
    arg_required_else_help = true,
    max_term_width = 110
)]
#[cfg_attr(
    feature = "train",
    command(
        after_help = "`run` does all stages of an experiment. The verbs label, sample, train, embed and eval each do one stage.
Start with `partprobe run smoke`, which needs no data, or with `partprobe inspect FILE`.
Every verb has its own help, for example `partprobe label --help`. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 a bound is
missed, 130 stopped by Ctrl-C or by --stop-after."
    )
)]
#[cfg_attr(
    not(feature = "train"),
    command(
        after_help = "This program was built without training. For run, train, embed and eval, build it with `cargo install --path crates/cli`.
Start with `partprobe inspect FILE`. Every verb has its own help, for example `partprobe label --help`.
Exit codes: 0 done, 1 failed, 2 wrong usage, 3 a bound is missed, 130 stopped by Ctrl-C or by --stop-after."
    )
)]
struct Cli {
    /// Show no progress; results, warnings and errors are still printed.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// The form of printed tables; if not given, `text` on a terminal and `markdown` in a pipe or a file.
    #[arg(long, global = true, value_enum, value_name = "FORM")]
    tables: Option<TableForm>,
    #[command(subcommand)]
    verb: Verb,
}

/// The exit code if a bound on a score is missed.
pub(crate) const MISSED_BOUND: u8 = 3;

/// Runs the program on the arguments of this process.
#[must_use]
pub fn main() -> ExitCode {
    file_size_limit::report_as_error();
    let matches = command_line().get_matches();
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    if cli.quiet {
        progress::be_quiet();
    }
    if let Some(form) = cli.tables {
        stdout::print_tables_as(form);
    }
    cli.verb.call().unwrap_or_else(|error| {
        if stdout::is_closed(&error) {
            return ExitCode::SUCCESS;
        }
        // An interruption by the user is not an error.
        let prefix = if interrupt::was_requested() {
            ""
        } else {
            "error: "
        };
        stderr::print_line(format_args!("{prefix}{error:#}{}", remedy_of(&error)));
        ExitCode::from(exit_code(&error))
    })
}

/// What to do if there is no space for a file, as the end of a message. It is empty for all other errors.
fn remedy_of(error: &anyhow::Error) -> &'static str {
    let is_without_space = |cause: &(dyn std::error::Error + 'static)| {
        let kind = cause.downcast_ref().map(std::io::Error::kind);
        matches!(
            kind,
            Some(ErrorKind::StorageFull | ErrorKind::FileTooLarge | ErrorKind::QuotaExceeded)
        )
    };
    match error.chain().any(is_without_space) {
        true => "; free some space, or raise the limit for files, and repeat the command",
        false => "",
    }
}

/// The exit code: 130 if the user stopped the work, 2 for a wrong call, and 1 for any other error.
fn exit_code(error: &anyhow::Error) -> u8 {
    if interrupt::was_requested() {
        interrupt::EXIT_CODE
    } else if usage::is_usage_error(error) {
        2
    } else {
        1
    }
}
