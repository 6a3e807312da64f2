//! Converts the tables of a Markdown text to aligned columns for a terminal.
//!
//! Markdown and the width of the terminal go in, and text comes out. Lines outside of tables are not changed.

use crate::command_line::wrapped;
use std::iter::Peekable;

/// The space between two columns.
const GAP: &str = "  ";
/// The last column is wrapped only if it keeps at least this many characters.
const MIN_WRAPPED: usize = 24;

/// The text with its tables aligned. If the terminal has a `width`, a last column of text that is too long for it is wrapped.
#[must_use]
pub(crate) fn aligned(markdown: &str, width: Option<usize>) -> String {
    let mut lines = markdown.lines().peekable();
    let mut text = Vec::new();
    while let Some(line) = lines.next() {
        let next = lines.peek().copied().unwrap_or_default();
        match (cells_of(line), sides_of(next)) {
            (Some(heading), Some(sides)) if heading.len() == sides.len() => {
                lines.next();
                let mut rows = vec![heading];
                rows.extend(rows_below(&mut lines));
                text.extend(table_lines(&rows, &sides, width));
            }
            _ => text.push(line.to_owned()),
        }
    }
    text.join("\n")
}

/// The rows that follow the rule of a table.
fn rows_below<'a>(lines: &mut Peekable<impl Iterator<Item = &'a str>>) -> Vec<Vec<String>> {
    let mut rows = Vec::new();
    while let Some(row) = lines.peek().and_then(|line| cells_of(line)) {
        lines.next();
        rows.push(row);
    }
    rows
}

/// The cells of a row, without the marks of code and bold text.
fn cells_of(line: &str) -> Option<Vec<String>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    let mut cells = vec![String::new()];
    let mut characters = inner.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '\\' if characters.peek() == Some(&'|') => cells.last_mut()?.extend(characters.next()),
            '|' => cells.push(String::new()),
            other => cells.last_mut()?.push(other),
        }
    }
    let plain = |cell: String| cell.replace("**", "").replace('`', "").trim().to_owned();
    Some(cells.into_iter().map(plain).collect())
}

/// For each column of a rule such as `|---|---:|`, whether it is aligned to the right.
fn sides_of(line: &str) -> Option<Vec<bool>> {
    let cells = cells_of(line)?;
    let is_rule = |cell: &String| {
        let dashes = cell.trim_matches(':');
        !dashes.is_empty() && dashes.chars().all(|character| character == '-')
    };
    cells
        .iter()
        .all(is_rule)
        .then(|| cells.iter().map(|cell| cell.ends_with(':')).collect())
}

fn table_lines(rows: &[Vec<String>], is_right: &[bool], width: Option<usize>) -> Vec<String> {
    let n_columns = is_right.len();
    let cell = |row: &Vec<String>, column: usize| row.get(column).cloned().unwrap_or_default();
    let width_of = |column: usize| {
        let lengths = rows.iter().map(|row| cell(row, column).chars().count());
        lengths.max().unwrap_or(0)
    };
    let mut widths: Vec<usize> = (0..n_columns).map(width_of).collect();
    let last = n_columns - 1;
    let before: usize = widths[..last].iter().map(|width| width + GAP.len()).sum();
    if let Some(room) = width.and_then(|width| width.checked_sub(before))
        && room >= MIN_WRAPPED
        && !is_right[last]
    {
        widths[last] = widths[last].min(room);
    }

    let mut lines = Vec::new();
    for (number, row) in rows.iter().enumerate() {
        let mut text = String::new();
        for column in 0..last {
            text += &padded(&cell(row, column), widths[column], is_right[column]);
            text += GAP;
        }
        let wrapped = wrapped(&cell(row, last), widths[last]);
        for (line, part) in wrapped.iter().enumerate() {
            let start = if line == 0 {
                text.clone()
            } else {
                " ".repeat(before)
            };
            let part = padded(part, widths[last], is_right[last]);
            lines.push((start + &part).trim_end().to_owned());
        }
        if number == 0 {
            let rules: Vec<String> = widths.iter().map(|&width| "─".repeat(width)).collect();
            lines.push(rules.join(GAP));
        }
    }
    lines
}

fn padded(text: &str, width: usize, is_right: bool) -> String {
    if is_right {
        format!("{text:>width$}")
    } else {
        format!("{text:width$}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(markdown: &str, width: Option<usize>, expected: &str) {
        assert_eq!(aligned(markdown, width), expected);
    }

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        check(
            "Scores:\n\n| source | n |\n|---|---:|\n| `a` | 1 |\n| **long\\|er** | 23 |\n\nA | b.",
            None,
            "Scores:\n\nsource    n\n───────  ──\na         1\nlong|er  23\n\nA | b.",
        );
        check("| a | b |\n|---|---|", None, "a  b\n─  ─");
    }

    #[test]
    fn what_is_not_a_table_stays() {
        for text in [
            "",
            "| a | b |",
            "| a |\n|---|---|\n| b |",
            "|a|\nb",
            "---\n|---|",
        ] {
            check(text, Some(80), text);
        }
    }

    #[test]
    fn a_long_last_column_is_wrapped() {
        let text = "| n | words |\n|---|---|\n| 1 | one two three four five six |\n| 2 | x |";
        check(
            text,
            Some(27),
            "n  words\n─  ────────────────────────\n1  one two three four five\n   six\n2  x",
        );
        // There is no room for a column of words.
        assert_eq!(aligned(text, Some(20)), aligned(text, None));
    }
}
