//! Shows the facts of a run: versions, data, machine and times, and its settings.

use crate::html::{escaped, section};
use std::fmt::Write as _;

/// A name with its value, for example `commit` and its hash.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// Its name.
    pub name: String,
    /// Its value as text.
    pub value: String,
}

impl Fact {
    /// A fact of this name and value.
    #[must_use]
    pub fn new(name: &str, value: impl Into<String>) -> Self {
        Self {
            name: name.to_owned(),
            value: value.into(),
        }
    }
}

/// The section with the facts and the config. It is empty without them.
pub(crate) fn facts(facts: &[Fact], config: &str) -> String {
    let mut body = String::new();
    if !facts.is_empty() {
        body.push_str("<dl class=\"facts\">\n");
        for Fact { name, value } in facts {
            let _ = writeln!(
                body,
                "<dt>{}</dt><dd>{}</dd>",
                escaped(name),
                escaped(value)
            );
        }
        body.push_str("</dl>\n");
    }
    if !config.is_empty() {
        let _ = writeln!(
            body,
            "<details><summary>Every setting (<code>config.toml</code>)</summary><pre tabindex=\"0\">{}</pre></details>",
            escaped(config)
        );
    }
    section("facts", "The run", "", &body)
}
