//! Finds the ends of tokens: blanks, names, strings and balanced lists, without recursion.
//!
//! Every function takes the text and a position in it, and returns the position after the token.

/// The reason why a token has no end: the text ends inside it, or something is in a position where it is not allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum ScanError {
    #[error("the file ends inside it")]
    Truncated,
    #[error("its parentheses do not balance")]
    Unbalanced,
    #[error("a string runs into other text")]
    BrokenString,
    #[error("it is not an instance of an entity")]
    NoInstance,
    #[error("its number has more than 64 bits")]
    LargeId,
    #[error("its scope does not end")]
    OpenScope,
    #[error("a scope ends here that has not begun")]
    NoScope,
}

/// Skips white space, comments and the print directives `\N\` and `\F\`. A comment without an end extends to the end of the text.
#[inline(always)]
pub(super) fn skip_blank(text: &[u8], at: usize) -> usize {
    // There is nearly always no blank here. This test finds that quickly.
    match text.get(at) {
        Some(b'\0'..=b' ' | b'/' | b'\\') => skip_blanks(text, at),
        _ => at,
    }
}

/// Skips all blanks from a position at which there may be some.
fn skip_blanks(text: &[u8], mut at: usize) -> usize {
    loop {
        match text.get(at) {
            Some(b' ' | b'\t' | b'\r' | b'\n' | b'\x0b' | b'\x0c' | b'\0') => at += 1,
            Some(b'/' | b'\\') => match skip_remark(text, at) {
                end if end == at => return at,
                end => at = end,
            },
            _ => return at,
        }
    }
}

/// Skips one comment or print directive. Returns the same position if neither begins there.
#[cold]
fn skip_remark(text: &[u8], at: usize) -> usize {
    match text.get(at..at + 2) {
        Some(b"/*") => skip_comment(text, at),
        Some(b"\\N" | b"\\F") if text.get(at + 2) == Some(&b'\\') => at + 3,
        _ => at,
    }
}

fn skip_comment(text: &[u8], at: usize) -> usize {
    let body = &text[at + 2..];
    body.windows(2)
        .position(|pair| pair == b"*/")
        .map_or(text.len(), |end| at + 2 + end + 2)
}

/// Skips the letters, digits and underscores of a keyword.
pub(super) fn skip_name(text: &[u8], at: usize) -> usize {
    let mut end = at;
    while text
        .get(end)
        .is_some_and(|&byte| IN_NAME[usize::from(byte)])
    {
        end += 1;
    }
    end
}

/// For each byte, whether it may be in a keyword.
const IN_NAME: [bool; 256] = {
    let mut is_in_name = [false; 256];
    let mut byte = 0;
    while byte < 256 {
        is_in_name[byte] =
            (byte as u8).is_ascii_alphanumeric() || matches!(byte as u8, b'_' | b'-' | b'!');
        byte += 1;
    }
    is_in_name
};

/// Skips a string from its opening quote to the position after its closing quote. A doubled quote belongs to the string. So does
/// the quote in `\S\'`, which is the code of another character.
#[inline]
pub(super) fn skip_string(text: &[u8], at: usize) -> Result<usize, ScanError> {
    // Most strings are empty.
    if let Some([b'\'', after]) = text.get(at + 1..at + 3)
        && *after != b'\''
    {
        return Ok(at + 2);
    }
    let mut end = at + 1;
    loop {
        end += text[end..]
            .iter()
            .position(|&byte| byte == b'\'')
            .ok_or(ScanError::Truncated)?
            + 1;
        if text.get(end) != Some(&b'\'') && text[end - 2] != b'\\' {
            return Ok(end);
        }
        match skip_quote(text, at, end) {
            (end, true) => return Ok(end),
            (next, false) => end = next,
        }
    }
}

/// The position after a quote that may be part of its string, and whether it ends the string nevertheless.
#[cold]
fn skip_quote(text: &[u8], start: usize, end: usize) -> (usize, bool) {
    let is_doubled = text.get(end) == Some(&b'\'');
    if !text[start + 1..end - 1].ends_with(b"\\S\\") {
        return (end + usize::from(is_doubled), !is_doubled);
    }
    // Some writers double this quote, too. The text after the last quote decides.
    let end = end + usize::from(is_doubled);
    (end, ends_parameter(text, end))
}

/// Whether a parameter ends at this position.
fn ends_parameter(text: &[u8], at: usize) -> bool {
    matches!(text.get(skip_blank(text, at)), Some(b',' | b')'))
}

/// Skips a binary literal from its opening quotation mark to the position after its closing one.
pub(super) fn skip_binary(text: &[u8], at: usize) -> Result<usize, ScanError> {
    let digits = text[at + 1..]
        .iter()
        .take_while(|byte| byte.is_ascii_hexdigit())
        .count();
    let end = at + 1 + digits;
    if text.get(end) == Some(&b'"') {
        Ok(end + 1)
    } else {
        Err(ScanError::BrokenString)
    }
}

/// Skips `<…>`, an anchor or an address, which may contain any character. If a `<` is not closed on its line, only the `<` is
/// skipped.
pub(super) fn skip_resource(text: &[u8], at: usize) -> usize {
    let end = text[at + 1..]
        .iter()
        .position(|byte| matches!(byte, b'>' | b'\n' | b'\r'))
        .map(|offset| at + 1 + offset);
    end.filter(|&end| text[end] == b'>').map_or(at, |end| end) + 1
}

/// For each byte, whether a list must be examined there. All other bytes are skipped.
const STOPS: [bool; 256] = {
    let mut stops = [false; 256];
    let bytes = b"()'\"/;=";
    let mut i = 0;
    while i < bytes.len() {
        stops[bytes[i] as usize] = true;
        i += 1;
    }
    stops
};

/// Skips a list from its opening parenthesis to the position after its closing one. An error contains the position that was
/// reached.
pub(super) fn skip_list(text: &[u8], mut at: usize) -> Result<usize, (ScanError, usize)> {
    let mut depth = 0_usize;
    while let Some(&byte) = text.get(at) {
        if !STOPS[usize::from(byte)] {
            at += 1;
            continue;
        }
        match byte {
            b'(' => depth += 1,
            b')' => {
                if depth <= 1 {
                    return if depth == 1 {
                        Ok(at + 1)
                    } else {
                        Err((ScanError::Unbalanced, at))
                    };
                }
                depth -= 1;
            }
            b'\'' => {
                at = skip_string(text, at).map_err(|error| (error, text.len()))?;
                // A superfluous quote is detected here, because a string is followed by a comma or the end of the list.
                if ends_parameter(text, at) {
                    continue;
                }
                return Err((ScanError::BrokenString, at));
            }
            b'"' => {
                at = skip_binary(text, at).map_err(|error| (error, at))?;
                continue;
            }
            b'/' if text.get(at + 1) == Some(&b'*') => {
                at = skip_comment(text, at);
                continue;
            }
            b';' | b'=' => return Err((ScanError::Unbalanced, at)),
            _ => {}
        }
        at += 1;
    }
    Err((ScanError::Truncated, text.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: Result<usize, ScanError>) {
        assert_eq!(
            skip_list(text.as_bytes(), 0).map_err(|(error, _)| error),
            expected
        );
    }

    #[test]
    fn lists_end_where_their_parenthesis_closes() {
        check("()x", Ok(2));
        check("(1,(2,3),'a)b''c')", Ok(18));
        check("(/* ) */)", Ok(9));
        check("(\"0A\")", Ok(6));
        check("(1;", Err(ScanError::Unbalanced));
        check(")(1)", Err(ScanError::Unbalanced));
        check("((1)", Err(ScanError::Truncated));
        check("('abc", Err(ScanError::Truncated));
        check("('abc,#3);#4=A('x')", Err(ScanError::BrokenString));
        check("(\"0A", Err(ScanError::BrokenString));
        check("(/* ", Err(ScanError::Truncated));
        check("('a\\S\\'b')", Ok(10));
        check("('a\\S\\''b')", Ok(11));
        check("('a\\S\\'')", Ok(9));
        check("('a\\S\\')", Ok(8));
    }

    #[test]
    fn a_million_parentheses_do_not_recurse() {
        let text = "(".repeat(1_000_000) + &")".repeat(1_000_000);
        check(&text, Ok(2_000_000));
    }

    #[test]
    fn blanks_are_white_space_and_comments() {
        assert_eq!(skip_blank(b" \r\n/* a *//**/\tx", 0), 15);
        assert_eq!(skip_blank(b"/* open", 0), 7);
        assert_eq!(skip_blank(b"/x", 0), 0);
        assert_eq!(skip_blank(b"/*/ */x", 0), 6);
        assert_eq!(skip_blank(b" \\N\\\\F\\x", 0), 7);
        assert_eq!(skip_blank(b"\\X", 0), 0);
    }

    #[test]
    fn any_character_may_stand_in_an_address() {
        assert_eq!(skip_resource(b"<a'b;(/*>;", 0), 9);
        assert_eq!(skip_resource(b"<a\nb>", 0), 1);
        assert_eq!(skip_resource(b"<a", 0), 1);
    }
}
