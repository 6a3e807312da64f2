//! Writes a table as lines of text whose columns are aligned.

/// The side of its column that a cell is written at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Alignment {
    Left,
    Right,
}

/// The heading and the rows, one line each, without a line end after the last one. The last column is not padded.
pub(crate) fn text_table<const N: usize>(
    heading: [&str; N],
    alignment: [Alignment; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let heading = heading.map(str::to_owned);
    let lines: Vec<[String; N]> = std::iter::once(heading).chain(rows).collect();
    let width = |column: usize| {
        lines
            .iter()
            .map(|line| line[column].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: [usize; N] = std::array::from_fn(width);

    let padded = |(column, cell): (usize, &String)| {
        let width = widths[column];
        match alignment[column] {
            Alignment::Right => format!("{cell:>width$}"),
            Alignment::Left if column + 1 < N => format!("{cell:width$}"),
            Alignment::Left => cell.clone(),
        }
    };
    let text_of = |line: &[String; N]| {
        let cells: Vec<String> = line.iter().enumerate().map(padded).collect();
        cells.join("  ")
    };
    lines.iter().map(text_of).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let rows = [["a", "1", "x"], ["long", "23", "y z"]].map(|row| row.map(str::to_owned));
        let alignment = [Alignment::Left, Alignment::Right, Alignment::Left];
        let expected = "name   n  text\na      1  x\nlong  23  y z";
        assert_eq!(text_table(["name", "n", "text"], alignment, rows), expected);
    }
}
