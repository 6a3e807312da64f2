//! Reads the parameters of an import: a text and its name go in, and a checked value comes out.
//!
//! A message names the key, its value, and the valid values.

use crate::import::ImportError;
use partprobe_sources::{SourceContext, SourceFiles};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// The way to read files.
///
/// # Errors
/// If the program does not provide it.
pub fn files(context: &SourceContext) -> Result<Arc<dyn SourceFiles>, ImportError> {
    let without =
        || ImportError::Unreadable("this program gives its label sources no files".to_owned());
    context.files().cloned().ok_or_else(without)
}

/// A switch. It is off if it is not set.
///
/// # Errors
/// If the value is neither `true` nor `false`.
pub fn switch(context: &SourceContext, key: &'static str) -> Result<bool, ImportError> {
    match context.parameter(key) {
        None | Some("false") => Ok(false),
        Some("true") => Ok(true),
        Some(other) => Err(refused(key, other, "true or false".to_owned())),
    }
}

/// A number within a range.
///
/// # Errors
/// If the value is not one.
pub fn number(
    context: &SourceContext,
    key: &'static str,
    range: RangeInclusive<f64>,
    default: f64,
) -> Result<f64, ImportError> {
    let Some(text) = context.parameter(key) else {
        return Ok(default);
    };
    let parsed: Option<f64> = text.parse().ok();
    parsed
        .filter(|number| range.contains(number))
        .ok_or_else(|| {
            let expected = format!("a number from {} to {}", range.start(), range.end());
            refused(key, text, expected)
        })
}

/// A whole number within a range.
///
/// # Errors
/// If the value is not one.
pub fn integer_parameter(
    context: &SourceContext,
    key: &'static str,
    range: RangeInclusive<u64>,
    default: u64,
) -> Result<u64, ImportError> {
    let Some(text) = context.parameter(key) else {
        return Ok(default);
    };
    let parsed: Option<u64> = text.parse().ok();
    parsed
        .filter(|number| range.contains(number))
        .ok_or_else(|| {
            let expected = format!("a whole number from {} to {}", range.start(), range.end());
            refused(key, text, expected)
        })
}

/// One of several words. It is the first one if it is not set.
///
/// # Errors
/// If the value is another word.
pub fn choice<T: Copy>(
    context: &SourceContext,
    key: &'static str,
    choices: &[(&str, T)],
) -> Result<T, ImportError> {
    let first = choices.first().map_or("", |&(word, _)| word);
    let text = context.parameter(key).unwrap_or(first);
    let chosen = choices.iter().find(|&&(word, _)| word == text);
    chosen.map(|&(_, value)| value).ok_or_else(|| {
        let words: Vec<&str> = choices.iter().map(|&(word, _)| word).collect();
        refused(key, text, format!("one of {}", words.join(", ")))
    })
}

/// A color in the form `#rrggbb`, or `none`.
///
/// # Errors
/// If the value is neither.
pub(crate) fn color(
    context: &SourceContext,
    key: &'static str,
    default: Option<[u8; 3]>,
) -> Result<Option<[u8; 3]>, ImportError> {
    match context.parameter(key) {
        None => Ok(default),
        Some("none") => Ok(None),
        Some(text) => {
            let expected = || "none, or a color such as #000000".to_owned();
            let color = color_of(text).ok_or_else(|| refused(key, text, expected()))?;
            Ok(Some(color))
        }
    }
}

fn color_of(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    let is_whole = digits.len() == 6 && digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    let number = u32::from_str_radix(digits, 16).ok().filter(|_| is_whole)?;
    let [_, red, green, blue] = number.to_be_bytes();
    Some([red, green, blue])
}

fn refused(key: &'static str, value: &str, expected: String) -> ImportError {
    ImportError::Value {
        key,
        value: value.to_owned(),
        expected,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_color_has_six_digits() {
        assert_eq!(color_of("#0080fF"), Some([0, 128, 255]));
        for text in ["0080ff", "#0080f", "#+080ff", "#0080fg", "#éé", "black"] {
            assert_eq!(color_of(text), None, "{text}");
        }
    }
}
