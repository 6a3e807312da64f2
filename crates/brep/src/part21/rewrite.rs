//! Writes an instance again with other numbers, without blanks and comments, and with neutral strings. Numeric values and class
//! names are copied byte by byte.

use super::params::parse_id;
use super::scan::{skip_binary, skip_blank, skip_string};

/// Strings that belong to the format: names of units and other names that readers search for. All other strings are emptied.
const NEUTRAL: &[&str] = &[
    "2d",
    "2d space",
    "3d",
    "3d space",
    "black",
    "blue",
    "centimeter",
    "centimetre",
    "cm",
    "confusion accuracy",
    "continuous",
    "cyan",
    "deg",
    "degree",
    "degrees",
    "distance_accuracy_value",
    "feet",
    "foot",
    "ft",
    "gon",
    "grad",
    "green",
    "in",
    "inch",
    "inches",
    "km",
    "m",
    "magenta",
    "meter",
    "metre",
    "micrometre",
    "micron",
    "mil",
    "mile",
    "millimeter",
    "millimetre",
    "mm",
    "none",
    "rad",
    "radian",
    "radians",
    "red",
    "white",
    "yard",
    "yellow",
];

/// Schemas that many programs write. Any other schema may belong to a single company.
const SCHEMAS: &[&str] = &[
    "AUTOMOTIVE_DESIGN",
    "CONFIG_CONTROL_DESIGN",
    "AP203",
    "AP209",
    "AP210",
    "AP214",
    "AP242",
];

/// One piece of an instance's text.
enum Token<'a> {
    Reference(u64),
    Text(&'a [u8]),
    Blank,
    Other(&'a [u8]),
}

/// The numbers to which an instance refers, in the order of the text. A number that is used twice is included twice.
pub(crate) fn references_in(written: &[u8]) -> impl Iterator<Item = u64> + '_ {
    tokens(written).filter_map(|token| {
        if let Token::Reference(id) = token {
            Some(id)
        } else {
            None
        }
    })
}

/// Appends an instance to a text. `number_of` gives the new number of each reference.
pub(crate) fn rewritten(written: &[u8], number_of: impl Fn(u64) -> u64, text: &mut Vec<u8>) {
    let is_word =
        |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
    let mut is_apart = false;
    for token in tokens(written) {
        match token {
            Token::Blank => {
                is_apart = true;
                continue;
            }
            Token::Reference(id) => {
                text.extend_from_slice(format!("#{}", number_of(id)).as_bytes())
            }
            Token::Text(inside) => {
                text.push(b'\'');
                text.extend_from_slice(if is_neutral(inside) { inside } else { b"" });
                text.push(b'\'');
            }
            Token::Other(bytes) => {
                // Two words that are separated by a blank remain separated.
                if is_apart && is_word(text.last()) && is_word(bytes.first()) {
                    text.push(b' ');
                }
                text.extend_from_slice(bytes);
            }
        }
        is_apart = false;
    }
}

/// Whether a string belongs to the format itself.
fn is_neutral(inside: &[u8]) -> bool {
    let lower = inside.to_ascii_lowercase();
    NEUTRAL.iter().any(|known| known.as_bytes() == lower)
}

/// The schema that a header names, if it is one that many programs write.
pub(crate) fn schema_of(header: &[u8]) -> Option<&str> {
    let at = header
        .windows(11)
        .position(|bytes| bytes.eq_ignore_ascii_case(b"FILE_SCHEMA"))?;
    let quote = at + header[at..].iter().position(|&byte| byte == b'\'')?;
    let end = skip_string(header, quote).ok()?;
    let name = std::str::from_utf8(&header[quote + 1..end - 1]).ok()?;
    let is_plain = name
        .bytes()
        .all(|byte| byte.is_ascii_alphanumeric() || b" _{}-".contains(&byte));
    (is_plain && SCHEMAS.iter().any(|known| name.starts_with(known))).then_some(name)
}

/// The pieces of an instance's text, up to the first one that does not parse.
fn tokens(text: &[u8]) -> impl Iterator<Item = Token<'_>> {
    let mut at = 0;
    std::iter::from_fn(move || {
        let &byte = text.get(at)?;
        let begin = at;
        let blank = skip_blank(text, at);
        if blank > at {
            at = blank;
            return Some(Token::Blank);
        }
        match byte {
            b'\'' => {
                at = skip_string(text, at).ok()?;
                return Some(Token::Text(&text[begin + 1..at - 1]));
            }
            b'"' => at = skip_binary(text, at).ok()?,
            b'#' => match parse_id(text, at + 1) {
                Some((id, end)) => {
                    at = end;
                    return Some(Token::Reference(id));
                }
                None => at += 1,
            },
            _ => {
                let is_plain =
                    |byte: &u8| byte.is_ascii_alphanumeric() || b"_.+-,()$*!".contains(byte);
                let n_plain = text[at..].iter().take_while(|byte| is_plain(byte)).count();
                at += n_plain.max(1);
            }
        }
        Some(Token::Other(&text[begin..at]))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(written: &str, expected: &str) {
        let mut text = Vec::new();
        rewritten(written.as_bytes(), |id| id + 100, &mut text);
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }

    #[test]
    fn numbers_are_changed_and_names_removed() {
        check(
            "ADVANCED_FACE ( 'ACME top' , ( #2,#3 ) ,#4 , .T. )",
            "ADVANCED_FACE('',(#102,#103),#104,.T.)",
        );
        check(
            "CARTESIAN_POINT('',(1.50,-2.E-3,\n 0.))",
            "CARTESIAN_POINT('',(1.50,-2.E-3,0.))",
        );
        check("(A('x')/* by ACME */B(\"0FF\")C())", "(A('')B(\"0FF\")C())");
        check(
            "P('it''s #5',$,*,!ACME(LABEL('x')))",
            "P('',$,*,!ACME(LABEL('')))",
        );
        check(
            "CONVERSION_BASED_UNIT('INCH',#7)",
            "CONVERSION_BASED_UNIT('INCH',#107)",
        );
        check("A(1 2,.T .)", "A(1 2,.T.)");
    }

    #[test]
    fn references_are_found_outside_of_strings_and_comments() {
        let found: Vec<u64> = references_in(b"A(#1,'#2',/*#3*/(#4,B(#1)),\"0A\")").collect();
        assert_eq!(found, [1, 4, 1]);
    }

    #[test]
    fn only_known_schemas_are_named() {
        let schema = |name: &str| {
            schema_of(format!("X('a');FILE_SCHEMA(('{name}'));").as_bytes()).map(str::to_owned)
        };
        let automotive = "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }";
        assert_eq!(schema(automotive).as_deref(), Some(automotive));
        assert_eq!(
            (
                schema("ACME_DESIGN"),
                schema("AP242; by ACME"),
                schema_of(b"no header")
            ),
            (None, None, None)
        );
    }

    proptest! {
        #[test]
        fn any_bytes_end_in_an_answer(text: Vec<u8>) {
            rewritten(&text, |id| id, &mut Vec::new());
        }
    }
}
