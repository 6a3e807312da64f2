//! Writes what is next to the tables of scores: statistics, settings, the paper's tables and the tables of endpoints.
//!
//! Markdown goes in, as in the files of the run folder, and a section of the page comes out. Nothing is computed here.

use crate::html::section;
use partprobe_eval::Tables;
use pulldown_cmark::{Event, Options, Parser, html};

/// The section with the statistics of the tables, and then each further text. It is empty if there is no text.
pub(crate) fn statistics(tables: &Tables, further: &[String]) -> String {
    let mut body = html_of(&tables.statistics_markdown());
    for text in further {
        body.push_str(&html_of(text));
    }
    section("statistics", "Statistics and settings", "", &body)
}

/// Markdown as HTML. Wide tables scroll, and HTML in the text is shown as text.
fn html_of(markdown: &str) -> String {
    let plain = |event| match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    };
    let events = Parser::new_ext(markdown, Options::ENABLE_TABLES).map(plain);
    let mut body = String::new();
    html::push_html(&mut body, events);
    body.replace(
        "<table>",
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table\"><table>",
    )
    .replace("</table>", "</table></div>")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_scroll_and_html_is_text() {
        let html = html_of("See `a` <b>x</b>:\n\n| p |\n|---:|\n| 0.1 |\n");
        assert!(
            html.contains("<code>a</code> &lt;b&gt;x&lt;/b&gt;"),
            "{html}"
        );
        assert!(
            html.contains("role=\"region\" aria-label=\"Table\"><table>"),
            "{html}"
        );
        assert!(
            html.contains("0.1</td></tr>\n</tbody></table></div>"),
            "{html}"
        );
        assert_eq!(html_of(""), "");
    }
}
