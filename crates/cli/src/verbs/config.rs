//! Runs `partprobe config`: it lists the shipped configs, prints one with everything that it builds on, and checks a file.

use crate::config::{Config, load, shipped, shipped_names};
use crate::markdown_table::{Alignment, markdown_table};
use crate::run::checked_expectations;
use crate::stdout::{print_line, print_result, print_tables};
use crate::usage::as_usage_error;
use anyhow::Result;
use partprobe_sources::source_named;

/// List, print and check configs
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ConfigArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum Action {
    /// List the shipped configs, each with its first sentence
    List,
    /// Print a config, with all keys of the configs that it builds on
    #[command(after_help = "Examples:
  partprobe config show hour
  partprobe config show mine.toml --set train.steps=5000
  partprobe config show base --source > base.toml

A config of your own starts with `base = \"hour\"`, or with the name of a file beside it, and lists only what differs.")]
    Show(ShowArgs),
    /// Check a config: every key and every value
    #[command(after_help = "Example: partprobe config check mine.toml
An error names the file and the line. The exit code is then 2.")]
    Check(CheckArgs),
}

#[derive(Clone, Debug, clap::Args)]
struct ShowArgs {
    /// A shipped config or a TOML file.
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
    /// The TOML file, or a shipped config.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// Change a value before the check.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Does what is asked for.
///
/// # Errors
/// If the config cannot be read, or one of its keys or values is wrong.
pub(crate) fn config(args: &ConfigArgs) -> Result<()> {
    match &args.action {
        Action::List => list(),
        Action::Show(args) => show(args),
        Action::Check(args) => {
            let config = load(&args.config, &args.set)?.config;
            ensure_known_names(&config).map_err(as_usage_error)?;
            print_line(format_args!(
                "{}: every key and value is valid",
                args.config
            ))
        }
    }
}

/// Refuses what a run refuses before its first stage, as far as it needs no data: files that a config names are not looked at.
fn ensure_known_names(config: &Config) -> Result<()> {
    for name in config.label_sources() {
        if !config.sources.contains_key(&name) {
            source_named(&name)?;
        }
    }
    checked_expectations(config)?;
    Ok(())
}

fn list() -> Result<()> {
    let rows = shipped_names().map(|name| {
        let about = shipped(name).map(first_sentence).unwrap_or_default();
        [name.to_owned(), about]
    });
    print_tables(markdown_table(
        ["config", "about"],
        [Alignment::Left, Alignment::Left],
        rows,
    ))
}

/// The first sentence of the comment that a config begins with, without what follows a colon.
fn first_sentence(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix('#'));
    let comment: Vec<&str> = lines.map(str::trim).collect();
    let comment = comment.join(" ") + " ";
    let ends = [": ", ". ", "? "].map(|end| comment.find(end));
    let end = ends.into_iter().flatten().min().unwrap_or(comment.len());
    comment[..end].trim_end().to_owned()
}

fn show(args: &ShowArgs) -> Result<()> {
    let loaded = load(&args.config, &args.set)?;
    if !args.source {
        return print_result(loaded.merged.trim_end());
    }
    match shipped(&args.config) {
        Some(text) => print_result(text.trim_end()),
        None => print_result(std::fs::read_to_string(&args.config)?.trim_end()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_sentence_ends_at_the_first_mark() {
        for (text, expected) in [
            ("# One thing. Another.\nkey = 1", "One thing"),
            (
                "# A long\n# sentence: `partprobe run`.\n",
                "A long sentence",
            ),
            ("# Of the paper (§4.5). More.", "Of the paper (§4.5)"),
            ("key = 1", ""),
        ] {
            assert_eq!(first_sentence(text), expected);
        }
    }
}
