//! Writes a table in Markdown. [`aligned`](crate::aligned_tables::aligned) turns it into columns for a terminal.

/// The side of its column to which a cell is aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Alignment {
    Left,
    Right,
}

/// The heading and the rows, one line each, without a line end after the last one.
pub(crate) fn markdown_table<const N: usize>(
    heading: [&str; N],
    alignment: [Alignment; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let rule = alignment.map(|side| match side {
        Alignment::Left => "---",
        Alignment::Right => "---:",
    });
    let mut lines = vec![
        row_of(heading.map(cell_text)),
        format!("|{}|", rule.join("|")),
    ];
    lines.extend(
        rows.into_iter()
            .map(|row| row_of(row.map(|cell| cell_text(&cell)))),
    );
    lines.join("\n")
}

fn row_of<const N: usize>(cells: [String; N]) -> String {
    format!("| {} |", cells.join(" | "))
}

/// The text of a cell, without characters that would end the cell or its line.
fn cell_text(text: &str) -> String {
    let one_line: Vec<&str> = text.lines().collect();
    one_line.join(" ").replace('|', "\\|")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_stay_in_their_row_and_column() {
        let rows = [["a", "1", "x"], ["b|c", "23", "y\nz"]].map(|row| row.map(str::to_owned));
        let alignment = [Alignment::Left, Alignment::Right, Alignment::Left];
        let expected = "| name | n | text |\n|---|---:|---|\n| a | 1 | x |\n| b\\|c | 23 | y z |";
        assert_eq!(
            markdown_table(["name", "n", "text"], alignment, rows),
            expected
        );
    }
}
