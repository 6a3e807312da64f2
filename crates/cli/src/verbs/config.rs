//! Runs `partprobe config`: it lists the shipped configs, prints one after merging it with its bases, and checks a file.

use crate::config::{
    Config, LoadedConfig, load, load_standard_input, shipped, shipped_descriptions,
};
use crate::markdown_table::{Alignment, markdown_table};
#[cfg(feature = "train")]
use crate::run::{checked_expectations, ensure_frozen_parts};
use crate::standard_input::is_standard_input;
use crate::stdout::{print_line, print_result, print_tables};
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use std::path::Path;

/// List, print and check configs
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ConfigArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    /// List the shipped configs and their purposes
    List,
    /// Print a config, with all keys of the configs that it builds on
    #[command(after_help = "Examples:
  partprobe config show hour
  partprobe config show mine.toml --set train.steps=5000
  partprobe config show base --source > base.toml

A config of your own starts with `base = \"hour\"`, or with the name of a file in the same folder, and contains only the keys that
differ.")]
    Show(ShowArgs),
    /// Check every key and every value of a config
    #[command(after_help = "Example: partprobe config check mine.toml
An error names the file and the line. The exit code is then 2.")]
    Check(CheckArgs),
}

#[derive(Clone, Debug, clap::Args)]
struct ShowArgs {
    /// A shipped config or a TOML file; `-` is the standard input.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// Change a value, for example train.steps=500.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the text of a shipped config as it is, with its comments and without its base.
    #[arg(long, conflicts_with = "set")]
    source: bool,
}

#[derive(Clone, Debug, clap::Args)]
struct CheckArgs {
    /// The TOML file, or a shipped config; `-` is the standard input.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// Change a value before the check.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Runs the requested command.
///
/// # Errors
/// If the config cannot be read, or one of its keys or values is wrong.
pub(crate) fn config(args: &ConfigArgs) -> Result<()> {
    match &args.action {
        Action::List => list(),
        Action::Show(args) => show(args),
        Action::Check(args) => check(args),
    }
}

/// The config of an argument, which may be the standard input.
fn loaded(config: &str, set: &[String]) -> Result<LoadedConfig> {
    if is_standard_input(Path::new(config)) {
        load_standard_input(set)
    } else {
        load(config, set)
    }
}

fn check(args: &CheckArgs) -> Result<()> {
    let loaded = loaded(&args.config, &args.set)?;
    ensure_trainable(&loaded.config).map_err(|error| loaded.located(&error))?;
    print_line(format_args!(
        "{}: every key and value is valid",
        args.config
    ))
}

/// Refuses configs that a run refuses before its first stage, if no data are needed for this. Files that a config names are not
/// read.
#[cfg(feature = "train")]
fn ensure_trainable(config: &Config) -> Result<()> {
    checked_expectations(config)?;
    ensure_frozen_parts(config)?;
    Ok(())
}

/// A program without training runs no config.
#[cfg(not(feature = "train"))]
#[expect(clippy::unnecessary_wraps, reason = "the other one can fail")]
fn ensure_trainable(_config: &Config) -> Result<()> {
    Ok(())
}

fn list() -> Result<()> {
    let rows = shipped_descriptions().map(|row| row.map(str::to_owned));
    print_tables(markdown_table(
        ["config", "about"],
        [Alignment::Left, Alignment::Left],
        rows,
    ))
}

fn show(args: &ShowArgs) -> Result<()> {
    if !args.source {
        let loaded = loaded(&args.config, &args.set)?;
        return print_result(loaded.merged.trim_end());
    }
    let from_stdin = is_standard_input(Path::new(&args.config));
    ensure!(
        !from_stdin,
        UsageError(
            "--source prints the text of a shipped config or of a file, and `-` is neither"
                .to_owned()
        )
    );
    match shipped(&args.config) {
        Some(text) => print_result(text.trim_end()),
        None => print_result(std::fs::read_to_string(&args.config)?.trim_end()),
    }
}
