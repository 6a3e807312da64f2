//! Strings of Part 21: control directives in, Unicode out.

/// Decodes the inside of a quoted string: `''`, `\\`, `\X\`, `\X2\`, `\X4\`, `\S\`; bytes that are
/// no UTF-8 are read as Latin-1, and a directive that is none stays as it is written.
pub(crate) fn decode_text(raw: &[u8]) -> String {
    let plain = match std::str::from_utf8(raw) {
        Ok(text) => text.to_owned(),
        Err(_) => raw.iter().map(|&byte| char::from(byte)).collect(),
    };
    let mut decoded = String::with_capacity(plain.len());
    let mut rest = plain.as_str();
    while let Some(at) = rest.find(['\'', '\\']) {
        decoded.push_str(&rest[..at]);
        rest = &rest[at..];
        let taken = decode_directive(rest, &mut decoded);
        rest = &rest[taken..];
    }
    decoded.push_str(rest);
    decoded
}

/// Decodes what starts with a quote or a backslash; gives the number of bytes that it took.
fn decode_directive(rest: &str, decoded: &mut String) -> usize {
    if rest.starts_with("''") || rest.starts_with("\\\\") {
        decoded.push_str(&rest[..1]);
        return 2;
    }
    if let Some(taken) = decode_wide(rest, decoded) {
        return taken;
    }
    let latin_1 = rest.strip_prefix("\\X\\").and_then(|hex| u8::from_str_radix(hex.get(..2)?, 16).ok());
    if let Some(byte) = latin_1 {
        decoded.push(char::from(byte));
        return 5;
    }
    if let Some(byte @ 0x20..0x7f) = rest.strip_prefix("\\S\\").and_then(|text| text.bytes().next()) {
        decoded.push(char::from(byte + 128));
        return 4;
    }
    decoded.push_str(&rest[..1]);
    1
}

/// Decodes `\X2\…\X0\` (UTF-16) and `\X4\…\X0\` (UTF-32).
fn decode_wide(rest: &str, decoded: &mut String) -> Option<usize> {
    let n_digits = match rest.get(..4)? {
        "\\X2\\" => 4,
        "\\X4\\" => 8,
        _ => return None,
    };
    let hex = &rest[4..4 + rest[4..].find("\\X0\\")?];
    if !hex.is_ascii() {
        return None;
    }
    let codes = hex.as_bytes().chunks(n_digits).map(|digits| {
        let digits = std::str::from_utf8(digits).unwrap_or_default();
        u32::from_str_radix(digits, 16).ok()
    });
    let codes: Vec<u32> = codes.collect::<Option<_>>()?;
    if n_digits == 4 {
        decoded.push_str(&String::from_utf16_lossy(&codes.iter().map(|&code| code as u16).collect::<Vec<_>>()));
    } else {
        decoded.extend(codes.iter().map(|&code| char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)));
    }
    Some(4 + hex.len() + 4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(raw: &[u8], expected: &str) {
        assert_eq!(decode_text(raw), expected);
    }

    #[test]
    fn directives_become_unicode() {
        check(b"plain", "plain");
        check(b"it''s", "it's");
        check(b"a\\\\b", "a\\b");
        check(b"\\X\\E9t\\X\\e9", "été");
        check(b"\\X2\\00E400F6\\X0\\!", "äö!");
        check(b"\\X2\\D83DDE00\\X0\\", "😀");
        check(b"\\X4\\0001F600\\X0\\", "😀");
        check(b"\\S\\d", "ä");
        check(b"\\X2\\00E4", "\\X2\\00E4");
        check(b"\\Q\\", "\\Q\\");
        check("ü".as_bytes(), "ü");
        check(b"\xfc", "ü");
    }

    proptest! {
        #[test]
        fn any_bytes_decode(raw: Vec<u8>) {
            decode_text(&raw);
        }
    }
}
