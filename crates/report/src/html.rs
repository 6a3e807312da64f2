//! Escapes text for HTML, and writes numbers for readers.

/// The text in a form that cannot end an element or an attribute.
pub(crate) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// The id of a shape, in a form whose last part stays readable if there is little space.
pub(crate) fn id_html(id: &str) -> String {
    let cut = id.rfind("__").map_or(0, |at| at + 2);
    let (head, tail) = id.split_at(cut);
    let [head, tail] = [head, tail].map(escaped);
    format!(
        "<span class=\"id\" title=\"{head}{tail}\"><span>{head}</span><span>{tail}</span></span>"
    )
}

/// JSON for the inside of a `script` element: no text in it can end the element.
pub(crate) fn json_for_script(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// A score with three decimals, or a dash.
pub(crate) fn score_text(value: Option<f64>) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{value:.3}"))
}

/// Text with its parts between backticks as code.
pub(crate) fn with_code(text: &str) -> String {
    let mut html = String::new();
    for (idx, part) in escaped(text).split('`').enumerate() {
        match idx % 2 {
            0 => html.push_str(part),
            _ => html.push_str(&format!("<code>{part}</code>")),
        }
    }
    html
}

/// A section of the page. An empty body gives no section.
pub(crate) fn section(id: &str, heading: &str, lead: &str, body: &str) -> String {
    if body.is_empty() {
        return String::new();
    }
    let lead = match lead {
        "" => String::new(),
        lead => format!("<p class=\"lead\">{lead}</p>\n"),
    };
    format!(
        "<section id=\"{id}\" aria-labelledby=\"{id}-h\">\n<h2 id=\"{id}-h\">{heading}</h2>\n{lead}{body}</section>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_break_out_of_the_page() {
        assert_eq!(
            escaped("<a href=\"x\" id='y'>&"),
            "&lt;a href=&quot;x&quot; id=&#39;y&#39;&gt;&amp;"
        );
        assert_eq!(with_code("a `b<c` d"), "a <code>b&lt;c</code> d");
        let json = json_for_script(&serde_json::json!({"id": "</script><b>"}));
        assert_eq!(json, r#"{"id":"\u003c/script>\u003cb>"}"#);
    }
}
