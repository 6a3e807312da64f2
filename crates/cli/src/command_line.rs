//! Makes the command line: the arguments of all verbs, with the verbs in groups, and with sentences that are wrapped to the width
//! of the terminal.

use crate::Cli;
use clap::{Command, CommandFactory};
use std::env;

/// The verbs under their headings, in the order in which users need them. Verbs that are not built in are left out.
const GROUPS: [(&str, &[&str]); 8] = [
    ("Whole experiments", &["run", "verdict", "config"]),
    (
        "Label STEP files",
        &[
            "label", "status", "merge", "inspect", "extract", "sample", "synth",
        ],
    ),
    (
        "Look at label sources",
        &["sources", "compare", "tessellation", "calibrate"],
    ),
    (
        "Train, and use what was trained",
        &["train", "predict", "embed", "nearest", "models", "replay"],
    ),
    (
        "Score and report",
        &[
            "eval",
            "score",
            "report",
            "runs",
            "rerun",
            "expect",
            "false-alarms",
        ],
    ),
    (
        "Exchange with other programs",
        &["export", "check", "weights", "render"],
    ),
    (
        "Release labels without geometry",
        &["release", "attach", "registry"],
    ),
    (
        "The program itself",
        &["verify", "bench", "completions", "man", "help"],
    ),
];

/// The widest line of a help text. It is also the width if the terminal does not report its own. Both values are those of clap.
const MAX_WIDTH: usize = 110;
const DEFAULT_WIDTH: usize = 100;

/// The whole command line.
pub(crate) fn command_line() -> Command {
    let command = flowing(Cli::command());
    let groups = groups(&command, width());
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}\nOptions:\n{{options}}{{after-help}}"
    ))
}

/// The largest number of columns of a line of help.
fn width() -> usize {
    let columns = env::var("COLUMNS").ok().and_then(|text| text.parse().ok());
    let of_terminal = || terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    let width: usize = columns.or_else(of_terminal).unwrap_or(DEFAULT_WIDTH);
    width.clamp(40, MAX_WIDTH)
}

/// One paragraph per group: its heading, and one or more lines per verb.
fn groups(command: &Command, width: usize) -> String {
    let about = |name: &str| {
        if name == "help" {
            return Some("Print this text, or the help of a verb".to_owned());
        }
        let verb = command.find_subcommand(name)?;
        verb.get_about().map(ToString::to_string)
    };
    let names = GROUPS.iter().flat_map(|(_, names)| names.iter());
    let indent = names.map(|name| name.len()).max().unwrap_or_default() + 4;
    let mut text = String::new();
    for (heading, names) in GROUPS {
        let listed: Vec<(&str, String)> = names
            .iter()
            .filter_map(|name| Some((*name, about(name)?)))
            .collect();
        if listed.is_empty() {
            continue;
        }
        text += &format!("{heading}:\n");
        for (name, about) in listed {
            let lines = wrapped(&about, width.saturating_sub(indent));
            text += &format!(
                "  {name:rest$}{}\n",
                lines.join(&format!("\n{:indent$}", "")),
                rest = indent - 2
            );
        }
        text.push('\n');
    }
    text.pop();
    text
}

/// Breaks a sentence between words into lines of at most this width. A longer word has its own line.
#[must_use]
pub(crate) fn wrapped(text: &str, width: usize) -> Vec<String> {
    let mut lines: Vec<String> = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().filter(|line| {
            line.is_empty() || line.chars().count() + 1 + word.chars().count() <= width
        });
        match last {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => *line += &format!(" {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Wraps the sentences below a verb's help to the width of the terminal.
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

/// Joins the lines of a sentence. Examples are indented and not changed.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn the_command_line_is_well_formed() {
        command_line().debug_assert();
    }

    #[test]
    fn every_verb_that_is_shown_is_in_one_group() {
        let command = command_line();
        let shown: BTreeSet<&str> = command
            .get_subcommands()
            .filter(|verb| !verb.is_hide_set())
            .map(Command::get_name)
            .collect();
        let mut grouped = BTreeSet::new();
        for name in GROUPS.iter().flat_map(|(_, names)| names.iter()) {
            assert!(grouped.insert(*name), "{name} is in two groups");
        }
        let missing: Vec<_> = shown.difference(&grouped).collect();
        assert!(missing.is_empty(), "in no group: {missing:?}");
    }

    #[test]
    fn sentences_break_between_words() {
        for (text, width, expected) in [
            ("one two three", 7, vec!["one two", "three"]),
            ("one two three", 13, vec!["one two three"]),
            ("incomprehensible, yes", 5, vec!["incomprehensible,", "yes"]),
            ("", 5, vec![""]),
        ] {
            assert_eq!(wrapped(text, width), expected);
        }
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
