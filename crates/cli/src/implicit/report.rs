//! Writes the report page of a run: its tables and pictures.

use super::pictures::picture_path;
use super::tables::ProbeTables;

/// The beginning of the page.
const HEAD: &str = r#"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>The implicit probe</title>
<style>
body { font: 15px sans-serif; margin: 2em; }
table { border-collapse: collapse; margin: 1em 0; }
td, th { border: 1px solid #ccc; padding: 2px 8px; text-align: right; }
td:first-child, th:first-child { text-align: left; }
</style></head><body>
"#;

/// The page. Pictures are in the same run folder.
pub(super) fn html(tables: &ProbeTables, shapes: &[String], arms: &[String]) -> String {
    let mut text = format!("{HEAD}<h1>The implicit probe</h1>\n");
    for block in tables.markdown.trim().split("\n\n") {
        text += &if block.starts_with('|') {
            table(block)
        } else {
            format!("<p>{}</p>\n", escaped(block))
        };
    }
    for shape in shapes {
        text += &format!("<h2>{}</h2>\n", escaped(shape));
        for arm in arms {
            text += &format!(
                "<img src=\"{}\" alt=\"{}\"><br>\n",
                escaped(&picture_path(shape, arm)),
                escaped(arm)
            );
        }
    }
    text + "</body></html>\n"
}

/// A Markdown table as HTML.
fn table(block: &str) -> String {
    let mut text = String::from("<table>\n");
    for (row, line) in block.lines().enumerate().filter(|&(row, _)| row != 1) {
        let tag = if row == 0 { "th" } else { "td" };
        let cells = line.trim_matches('|').split('|');
        let cells: String = cells
            .map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell.trim())))
            .collect();
        text += &format!("<tr>{cells}</tr>\n");
    }
    text + "</table>\n"
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_and_names_become_html() {
        let tables = ProbeTables {
            markdown: "One < two.\n\n| a | b |\n|---|---|\n| x | 1 |\n".to_owned(),
            json: serde_json::Value::Null,
        };
        let page = html(&tables, &["s".to_owned()], &["control".to_owned()]);
        for expected in [
            "<p>One &lt; two.</p>",
            "<tr><th>a</th><th>b</th></tr>",
            "<tr><td>x</td><td>1</td></tr>",
            "<img src=\"pictures/s/control.png\" alt=\"control\">",
        ] {
            assert!(page.contains(expected), "{expected} in {page}");
        }
        assert!(!page.contains("---"));
    }
}
