//! Runs `partprobe completions` and `partprobe man`: scripts that complete the command line in a shell, and manual pages.

use crate::command_line::command_line;
use crate::counted::counted;
use crate::stdout::{print_line, print_result};
use anyhow::{Context, Result};
use clap_complete::Shell;
use std::fs;
use std::path::PathBuf;

/// The name of the program in scripts and pages, even if its file has another name.
const NAME: &str = "partprobe";

/// Print a script that completes verbs, options and values in a shell
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe completions bash > ~/.local/share/bash-completion/completions/partprobe
  partprobe completions zsh > ~/.zfunc/_partprobe
  partprobe completions fish > ~/.config/fish/completions/partprobe.fish")]
pub(crate) struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Write manual pages, one per verb
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe man --out ~/.local/share/man/man1")]
pub(crate) struct ManArgs {
    /// The folder to write the pages to.
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
}

/// Prints the script.
///
/// # Errors
/// If stdout cannot be written to.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command_line(), NAME, &mut script);
    print_line(String::from_utf8_lossy(&script).trim_end())
}

/// Writes the pages.
///
/// # Errors
/// If a page cannot be written.
pub(crate) fn man(args: &ManArgs) -> Result<()> {
    fs::create_dir_all(&args.out).with_context(|| format!("making {}", args.out.display()))?;
    let command = command_line().name(NAME).bin_name(NAME);
    let n_pages = counted(n_pages(&command), "page", "pages");
    clap_mangen::generate_to(command, &args.out)
        .with_context(|| format!("writing pages into {}", args.out.display()))?;
    let first = args.out.join(format!("{NAME}.1"));
    print_result(format_args!(
        "{n_pages} in {}; begin with {}",
        args.out.display(),
        first.display()
    ))
}

/// The number of pages: one for the command, and one per verb that the help shows.
fn n_pages(command: &clap::Command) -> usize {
    let shown = command.get_subcommands().filter(|verb| !verb.is_hide_set());
    1 + shown.map(n_pages).sum::<usize>()
}
