//! Writes file names as text from which their bytes can be restored. File names are bytes, and not all of them are UTF-8.
//!
//! A UTF-8 name is its own text. In any other name, each byte that is not text is written as `%` and two capital hexadecimal
//! digits, and each `%` is written as `%25`. A UTF-8 name that looks like such a text is also written in this way, so that
//! different names have different texts.

use std::borrow::Cow;

/// The text of a name.
#[must_use]
pub fn text_of_name(name: &[u8]) -> String {
    match std::str::from_utf8(name) {
        Ok(text) if !looks_escaped(text) => text.to_owned(),
        _ => escaped(name),
    }
}

/// The bytes of the name that has this text.
#[must_use]
pub fn name_of_text(text: &str) -> Cow<'_, [u8]> {
    let bytes = unescaped(text.as_bytes());
    let is_name_of_another = std::str::from_utf8(&bytes).is_ok_and(|bytes| !looks_escaped(bytes));
    if is_name_of_another {
        Cow::Borrowed(text.as_bytes())
    } else {
        Cow::Owned(bytes)
    }
}

/// Whether this text could be the escaped form of a name.
fn looks_escaped(text: &str) -> bool {
    let mut text = Cow::Borrowed(text);
    loop {
        let bytes = unescaped(text.as_bytes());
        if bytes == text.as_bytes() {
            return false;
        }
        // Each iteration shortens the text.
        match String::from_utf8(bytes) {
            Ok(shorter) => text = Cow::Owned(shorter),
            Err(_) => return true,
        }
    }
}

fn escaped(name: &[u8]) -> String {
    let mut text = String::with_capacity(name.len() + 8);
    for chunk in name.utf8_chunks() {
        text.push_str(&chunk.valid().replace('%', "%25"));
        chunk
            .invalid()
            .iter()
            .for_each(|byte| text.push_str(&format!("%{byte:02X}")));
    }
    text
}

/// Replaces the escapes of [`escaped`] by their bytes. Any other `%` is kept.
fn unescaped(text: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut at = 0;
    while at < text.len() {
        let byte = escape_at(&text[at..]);
        bytes.push(byte.unwrap_or(text[at]));
        at += if byte.is_some() { 3 } else { 1 };
    }
    bytes
}

/// The byte of an escape at the beginning of the text.
fn escape_at(text: &[u8]) -> Option<u8> {
    let [b'%', high, low, ..] = text else {
        return None;
    };
    let digit = |byte: u8| {
        (!byte.is_ascii_lowercase())
            .then(|| char::from(byte).to_digit(16))
            .flatten()
    };
    let byte = u8::try_from(digit(*high)? * 16 + digit(*low)?).ok()?;
    (byte >= 0x80 || byte == b'%').then_some(byte)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn names_that_are_utf_8_stay_and_others_are_escaped() {
        let cases: [(&[u8], &str); 8] = [
            ("größe 50%.step".as_bytes(), "größe 50%.step"),
            (b"My%20Part.step", "My%20Part.step"),
            (b"%C3%A4.step", "%C3%A4.step"),
            (b"caf\xE9.step", "caf%E9.step"),
            (b"50%\xFF", "50%25%FF"),
            (b"a%FF", "a%25FF"),
            (b"a%25FF", "a%2525FF"),
            (b"a%25b", "a%25b"),
        ];
        for (name, text) in cases {
            assert_eq!(text_of_name(name), text);
            assert_eq!(name_of_text(text), name, "{text}");
        }
    }

    proptest! {
        #[test]
        fn every_name_round_trips(name in proptest::collection::vec(prop_oneof![
            Just(b'%'), Just(b'2'), Just(b'5'), Just(b'F'), Just(b'C'), Just(b'3'), Just(b'a'), any::<u8>(),
        ], 0..12)) {
            prop_assert_eq!(name_of_text(&text_of_name(&name)).into_owned(), name);
        }
    }
}
