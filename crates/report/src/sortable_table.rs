//! Writes tables that the page sorts by any column and filters by text.

use crate::html::escaped;
use std::fmt::Write as _;

/// A cell: its content, and the key by which it is sorted.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    html: String,
    key: Option<String>,
    /// The fraction of the cell that a bar fills.
    bar: Option<f64>,
    is_number: bool,
}

impl Cell {
    /// Text, sorted as text.
    pub(crate) fn text(text: &str) -> Self {
        Self::html(escaped(text))
    }

    /// HTML that is sorted by its text.
    pub(crate) fn html(html: String) -> Self {
        Self {
            html,
            key: None,
            bar: None,
            is_number: false,
        }
    }

    /// A number with its text. A cell without a number comes last in every order.
    pub(crate) fn number(value: Option<f64>, text: &str) -> Self {
        Self {
            html: escaped(text),
            // Scores that are read again from a file may differ in their last digits. Rounding gives the same page for them.
            key: value.map(|value| format!("{}", (value * 1e9).round() / 1e9)),
            bar: None,
            is_number: true,
        }
    }

    /// A number that is shown as HTML.
    pub(crate) fn number_html(value: f64, html: String) -> Self {
        Self {
            html,
            ..Self::number(Some(value), "")
        }
    }

    /// A score from 0 to 1 with three decimals.
    pub(crate) fn score(value: Option<f64>) -> Self {
        Self::number(value, &crate::html::score_text(value))
    }

    /// The same cell with a bar behind it.
    pub(crate) fn with_bar(self) -> Self {
        let value = self.key.as_ref().and_then(|key| key.parse().ok());
        Self { bar: value, ..self }
    }
}

/// A table under construction.
#[derive(Clone, Debug, Default)]
pub(crate) struct SortableTable {
    id: String,
    caption: String,
    /// The heading of each column, and whether it has numbers.
    columns: Vec<(String, bool)>,
    body: String,
    foot: String,
    n_rows: usize,
    filter: Option<String>,
    is_tall: bool,
}

impl SortableTable {
    /// A table without rows. The id must be unique on the page.
    pub(crate) fn new(id: &str, caption: &str) -> Self {
        Self {
            id: id.to_owned(),
            caption: caption.to_owned(),
            ..Self::default()
        }
    }

    /// The same table with one more column.
    pub(crate) fn column(mut self, heading: &str, is_number: bool) -> Self {
        self.columns.push((heading.to_owned(), is_number));
        self
    }

    /// The same table with a field that filters its rows.
    pub(crate) fn with_filter(mut self, what: &str) -> Self {
        self.filter = Some(what.to_owned());
        self
    }

    /// The same table in a box that scrolls.
    pub(crate) fn scrolling(mut self) -> Self {
        self.is_tall = true;
        self
    }

    /// Adds a row. `attributes` are written into its start tag without changes.
    pub(crate) fn row(&mut self, attributes: &str, cells: &[Cell]) {
        self.n_rows += 1;
        let space = if attributes.is_empty() { "" } else { " " };
        let _ = write!(self.body, "<tr{space}{attributes}>");
        for (idx, cell) in cells.iter().enumerate() {
            self.body.push_str(&cell_html(cell, idx == 0));
        }
        self.body.push_str("</tr>\n");
    }

    /// Adds a row below the others, which is neither sorted nor filtered.
    pub(crate) fn foot_row(&mut self, cells: &[Cell]) {
        self.foot.push_str("<tr>");
        for (idx, cell) in cells.iter().enumerate() {
            self.foot.push_str(&cell_html(cell, idx == 0));
        }
        self.foot.push_str("</tr>\n");
    }

    /// The table as HTML. It is empty if there is no row.
    pub(crate) fn to_html(&self) -> String {
        if self.n_rows == 0 {
            return String::new();
        }
        let Self { id, caption, .. } = self;
        let mut html = String::new();
        if let Some(what) = &self.filter {
            let _ = writeln!(
                html,
                "<p class=\"filter\"><label>Filter <input type=\"search\" data-filters=\"{id}\" placeholder=\"{}\"></label> \
                 <output data-counts=\"{id}\">{} rows</output></p>",
                escaped(what),
                self.n_rows
            );
        }
        let tall = if self.is_tall { " tall" } else { "" };
        let _ = write!(
            html,
            "<div class=\"scroll{tall}\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table id=\"{id}\" class=\"sortable\">\
             <caption>{0}</caption><thead><tr>",
            escaped(caption)
        );
        for (heading, is_number) in &self.columns {
            let class = if *is_number { " class=\"n\"" } else { "" };
            let _ = write!(
                html,
                "<th scope=\"col\"{class}><button type=\"button\">{}</button></th>",
                escaped(heading)
            );
        }
        let _ = write!(html, "</tr></thead><tbody>\n{}</tbody>", self.body);
        if !self.foot.is_empty() {
            let _ = write!(html, "<tfoot>{}</tfoot>", self.foot);
        }
        html.push_str("</table></div>\n");
        html
    }
}

fn cell_html(cell: &Cell, is_head: bool) -> String {
    let mut attributes = String::new();
    let mut class = if cell.is_number {
        "n".to_owned()
    } else {
        String::new()
    };
    if cell.bar.is_some() {
        class.push_str(" b");
    }
    if !class.is_empty() {
        let _ = write!(attributes, " class=\"{}\"", class.trim());
    }
    if let Some(key) = &cell.key {
        let _ = write!(attributes, " data-v=\"{}\"", escaped(key));
    }
    if let Some(bar) = cell.bar {
        let _ = write!(attributes, " style=\"--v:{:.3}\"", bar.clamp(0.0, 1.0));
    }
    let tag = if is_head { "th scope=\"row\"" } else { "td" };
    let end = if is_head { "th" } else { "td" };
    format!("<{tag}{attributes}>{}</{end}>", cell.html)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_carry_what_they_are_sorted_by() {
        let mut table = SortableTable::new("t", "Scores")
            .column("name", false)
            .column("mIoU", true)
            .with_filter("a name");
        assert_eq!(table.to_html(), "");
        table.row(
            "",
            &[Cell::text("<a>"), Cell::score(Some(0.51234)).with_bar()],
        );
        table.row("data-x=\"1\"", &[Cell::text("b"), Cell::score(None)]);
        let html = table.to_html();
        assert!(html.contains("<tr><th scope=\"row\">&lt;a&gt;</th><td class=\"n b\" data-v=\"0.51234\" style=\"--v:0.512\">0.512</td></tr>"), "{html}");
        assert!(
            html.contains("<tr data-x=\"1\"><th scope=\"row\">b</th><td class=\"n\">–</td></tr>"),
            "{html}"
        );
        assert!(
            html.contains("data-filters=\"t\"") && html.contains("2 rows"),
            "{html}"
        );
    }
}
