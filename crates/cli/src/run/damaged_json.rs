//! Makes the message for a JSON file that cannot be read: the place of the damage, and advice. The parser's own message is not
//! shown, because it is about Rust types.

use serde_json::error::Category;
use std::path::Path;

/// The message for a file that a parser has refused. The advice tells the user what to do.
pub(super) fn damaged_json(path: &Path, error: &serde_json::Error, advice: &str) -> String {
    let reason = match error.classify() {
        Category::Eof => "the file ends too early",
        Category::Syntax => "this is not JSON",
        Category::Data => "a value is missing, or is of another kind than expected",
        Category::Io => "the file cannot be read to its end",
    };
    let (line, column) = (error.line(), error.column());
    format!(
        "{} is damaged at line {line}, column {column}: {reason}; {advice}",
        path.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn the_position_and_the_reason_are_named() {
        for (text, expected) in [
            (
                "",
                "x.json is damaged at line 1, column 0: the file ends too early; put it back",
            ),
            (
                "{\n\"a\": [1,",
                "x.json is damaged at line 2, column 8: the file ends too early; put it back",
            ),
            (
                "{\n a}",
                "x.json is damaged at line 2, column 2: this is not JSON; put it back",
            ),
            (
                "{\"a\": [1, \"b\"]}",
                "line 1, column 13: a value is missing, or is of another kind than expected; put it back",
            ),
        ] {
            let error = serde_json::from_str::<BTreeMap<String, Vec<u32>>>(text).unwrap_err();
            let message = damaged_json(Path::new("x.json"), &error, "put it back");
            assert!(message.ends_with(expected), "{message}");
        }
    }
}
