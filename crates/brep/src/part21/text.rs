//! Decodes strings of Part 21: replaces control directives by Unicode characters.

use encoding_rs::{
    Encoding, ISO_8859_2, ISO_8859_3, ISO_8859_4, ISO_8859_5, ISO_8859_6, ISO_8859_7, ISO_8859_8,
    WINDOWS_1252, WINDOWS_1254,
};

/// The parts of ISO 8859 that `\PA\` to `\PI\` choose. The tables of Windows are used for parts 1 and 9, because they have the
/// same upper halves.
const PAGES: [&Encoding; 9] = [
    WINDOWS_1252,
    ISO_8859_2,
    ISO_8859_3,
    ISO_8859_4,
    ISO_8859_5,
    ISO_8859_6,
    ISO_8859_7,
    ISO_8859_8,
    WINDOWS_1254,
];

/// Decodes the inside of a quoted string: `''`, `\\`, `\X\`, `\X2\`, `\X4\`, `\S\`, `\P?\`.
///
/// Line ends inside a string do not belong to it. An invalid directive stays as it is written. Bytes that are not UTF-8 are
/// read as Latin-1.
#[must_use]
pub fn decode_text(raw: &[u8]) -> String {
    let is_kept = |byte: &u8| !matches!(byte, b'\n' | b'\r');
    let raw: Vec<u8> = raw.iter().copied().filter(is_kept).collect();
    let plain = String::from_utf8(raw)
        .unwrap_or_else(|error| error.as_bytes().iter().copied().map(char::from).collect());
    let mut decoded = DecodedText {
        text: String::with_capacity(plain.len()),
        page: PAGES[0],
    };
    let mut rest = plain.as_str();
    while let Some(at) = rest.find(['\'', '\\']) {
        decoded.text.push_str(&rest[..at]);
        rest = &rest[at..];
        let taken = decoded.directive(rest);
        rest = &rest[taken..];
    }
    decoded.text.push_str(rest);
    decoded.text
}

/// A string that is being decoded.
struct DecodedText {
    text: String,
    /// The table from which `\S\` chooses characters.
    page: &'static Encoding,
}

impl DecodedText {
    /// Decodes a directive that starts with a quote or a backslash. Returns the number of its bytes.
    fn directive(&mut self, rest: &str) -> usize {
        if rest.starts_with("''") || rest.starts_with("\\\\") {
            self.text.push_str(&rest[..1]);
            return 2;
        }
        let taken = self
            .wide(rest)
            .or_else(|| self.byte(rest))
            .or_else(|| self.page(rest))
            .or_else(|| self.shifted(rest));
        taken.unwrap_or_else(|| {
            self.text.push_str(&rest[..1]);
            1
        })
    }

    /// `\X2\…\X0\` (UTF-16) and `\X4\…\X0\` (UTF-32).
    fn wide(&mut self, rest: &str) -> Option<usize> {
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
            let units: Vec<u16> = codes.iter().map(|&code| code as u16).collect();
            self.text.push_str(&String::from_utf16_lossy(&units));
        } else {
            let characters = codes
                .iter()
                .map(|&code| char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER));
            self.text.extend(characters);
        }
        Some(4 + hex.len() + 4)
    }

    /// `\X\E9`: a character of Latin-1.
    fn byte(&mut self, rest: &str) -> Option<usize> {
        let digits = rest.strip_prefix("\\X\\")?.get(..2)?;
        self.text
            .push(char::from(u8::from_str_radix(digits, 16).ok()?));
        Some(5)
    }

    /// `\PE\`: from here on, characters after `\S\` are from part 5 of ISO 8859.
    fn page(&mut self, rest: &str) -> Option<usize> {
        let [letter, b'\\', ..] = *rest.strip_prefix("\\P")?.as_bytes() else {
            return None;
        };
        self.page = PAGES.get(usize::from(letter.checked_sub(b'A')?))?;
        Some(4)
    }

    /// `\S\d`: the character 128 positions further in the table.
    fn shifted(&mut self, rest: &str) -> Option<usize> {
        let shifted = rest.strip_prefix("\\S\\")?;
        let byte @ 0x20..0x7f = *shifted.as_bytes().first()? else {
            return None;
        };
        let upper = [byte + 128];
        self.text
            .push_str(&self.page.decode_without_bom_handling(&upper).0);
        // Some writers double the quote here too.
        Some(if shifted.starts_with("''") { 5 } else { 4 })
    }
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
        check(b"\\X\\E9t\\X\\e9", "\u{e9}t\u{e9}");
        check(b"\\X2\\00E400F6\\X0\\!", "\u{e4}\u{f6}!");
        check(b"\\X2\\D83DDE00\\X0\\", "\u{1f600}");
        check(b"\\X4\\0001F600\\X0\\", "\u{1f600}");
        check(b"\\S\\d", "\u{e4}");
        check("\u{fc}".as_bytes(), "\u{fc}");
        check(b"\xfc", "\u{fc}");
    }

    #[test]
    fn pages_are_the_parts_of_iso_8859() {
        check(b"\\PA\\\\S\\d", "ä");
        check(b"\\PB\\\\S\\h", "č");
        check(b"\\PC\\\\S\\&", "Ĥ");
        check(b"\\PD\\\\S\\9", "š");
        check(b"\\PE\\\\S\\:\\S\\^", "Ко");
        check(b"\\PF\\\\S\\G", "ا");
        check(b"\\PG\\\\S\\a", "α");
        check(b"\\PH\\\\S\\`", "א");
        check(b"\\PI\\\\S\\p", "ğ");
        check(b"\\PE\\\\S\\:\\PA\\\\S\\d", "Кä");
        check(b"\\S\\' 5", "§ 5");
        check(b"\\S\\'' 5", "§ 5");
        check(b"\\S\\\\", "Ü");
        check(b"\\PJ\\", "\\PJ\\");
    }

    #[test]
    fn what_is_not_a_directive_stays() {
        check(b"\\X2\\00E4", "\\X2\\00E4");
        check(b"\\Q\\", "\\Q\\");
        check(b"C:\\parts\\new", "C:\\parts\\new");
        check(b"end\\", "end\\");
        check(b"\\P", "\\P");
        check(b"\\S\\", "\\S\\");
        check(b"\\X\\G0", "\\X\\G0");
        check(b"\\X2\\00\xc3\xa4\\X0\\", "\\X2\\00ä\\X0\\");
    }

    #[test]
    fn line_ends_are_not_part_of_a_string() {
        check(b"pa\r\nrt", "part");
        check(b"long na\n  me", "long na  me");
        check(b"\\X2\\00E4\n00F6\\X\r\n0\\", "äö");
        check(b"\xc3\n\xa4", "ä");
    }

    proptest! {
        #[test]
        fn any_bytes_decode(raw: Vec<u8>) {
            let _ = decode_text(&raw);
        }
    }
}
