//! Writes what is next to the tables of scores: statistics, settings, the paper's tables and the tables of endpoints.
//!
//! Markdown goes in, as in the files of the run folder, and a section of the page comes out. Nothing is computed here.

use crate::html::{escaped, section};
use partprobe_eval::Tables;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html};

/// The section with the statistics of the tables, and then each further text. It is empty if there is no text.
pub(crate) fn statistics(tables: &Tables, further: &[String]) -> String {
    let mut body = html_of(&tables.statistics_markdown());
    for text in further {
        body.push_str(&html_of(text));
    }
    section("statistics", "Statistics and settings", "", &body)
}

/// Markdown as HTML. Wide tables scroll, and HTML, links and images in the text are shown as text.
fn html_of(markdown: &str) -> String {
    let plain = |event| match event {
        Event::Text(text) | Event::Html(text) | Event::InlineHtml(text) => {
            Some(Event::InlineHtml(escaped(&text).into()))
        }
        Event::Code(text) => {
            let code = format!("<code>{}</code>", escaped(&text));
            Some(Event::InlineHtml(code.into()))
        }
        Event::Start(Tag::Link { .. } | Tag::Image { .. })
        | Event::End(TagEnd::Link | TagEnd::Image) => None,
        other => Some(other),
    };
    let events = Parser::new_ext(markdown, Options::ENABLE_TABLES).filter_map(plain);
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
        assert_eq!(html_of("![a](https://x.org) [b](c)"), "<p>a b</p>\n");
        assert_eq!(html_of(""), "");
    }
}
