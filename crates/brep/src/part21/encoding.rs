//! Converts bytes of any encoding to UTF-8, once per file: UTF-16 is recognized by its byte order, other encodings by the
//! characters of their strings.
//!
//! A text of ASCII or UTF-8 is returned as it is. Two-byte encodings may contain bytes that look like a backslash. After this
//! conversion there are none, so later steps need not know these encodings. Control directives of Part 21 are not touched here.

use super::encoding_guess::guessed_encoding;
use encoding_rs::{Encoding, UTF_16BE, UTF_16LE};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// The largest number of bytes of a file's strings that are used for a guess.
const MAX_SAMPLE: usize = 1 << 16;

/// The text in UTF-8.
pub(crate) fn in_utf8(text: &[u8]) -> Cow<'_, [u8]> {
    if let Some(encoding) = wide_encoding(text) {
        let (decoded, _) = encoding.decode_with_bom_removal(text);
        return Cow::Owned(decoded.into_owned().into_bytes());
    }
    if text.is_ascii() || std::str::from_utf8(text).is_ok() {
        return Cow::Borrowed(text);
    }
    let encoding = guessed_encoding(&sample(text));
    let mut decoded = Vec::with_capacity(text.len() + text.len() / 8);
    for (piece, is_last) in pieces(text) {
        if piece.is_ascii() {
            decoded.extend_from_slice(piece);
        } else {
            decoded.extend_from_slice(decoded_piece(piece, encoding).as_bytes());
        }
        if !is_last {
            decoded.push(b'\'');
        }
    }
    Cow::Owned(decoded)
}

/// UTF-16, by its byte order mark or by the zeros in `ISO-10303-21`.
fn wide_encoding(text: &[u8]) -> Option<&'static Encoding> {
    match text {
        [0xff, 0xfe, ..] | [b'I' | b'i', 0, b'S' | b's', 0, ..] => Some(UTF_16LE),
        [0xfe, 0xff, ..] | [0, b'I' | b'i', 0, b'S' | b's', ..] => Some(UTF_16BE),
        _ => None,
    }
}

/// The pieces of a text between quotes, inside and outside of strings. No encoding that is known here has a quote byte inside a
/// character.
fn pieces(text: &[u8]) -> impl Iterator<Item = (&[u8], bool)> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let quote = text.iter().position(|&byte| byte == b'\'');
        rest = quote.map(|quote| &text[quote + 1..]);
        Some((&text[..quote.unwrap_or(text.len())], quote.is_none()))
    })
}

/// The distinct pieces that are not UTF-8.
fn sample(text: &[u8]) -> Vec<&[u8]> {
    let mut known = BTreeSet::new();
    let mut n_bytes = 0;
    let mut sample = Vec::new();
    for (piece, _) in pieces(text) {
        if piece.is_ascii() || std::str::from_utf8(piece).is_ok() || !known.insert(piece) {
            continue;
        }
        n_bytes += piece.len();
        sample.push(piece);
        if n_bytes > MAX_SAMPLE {
            break;
        }
    }
    sample
}

/// A piece, decoded from the file's encoding. It is read as UTF-8 if it is valid UTF-8 and the encoding does not exclude it.
fn decoded_piece<'a>(piece: &'a [u8], encoding: &'static Encoding) -> Cow<'a, str> {
    let undoubled = if encoding.is_single_byte() {
        Cow::Borrowed(piece)
    } else {
        without_doubled_tails(piece)
    };
    let decoded = encoding.decode_without_bom_handling_and_without_replacement(&undoubled);
    if (encoding.is_single_byte() || decoded.is_none())
        && let Ok(text) = std::str::from_utf8(piece)
    {
        return Cow::Borrowed(text);
    }
    let lossy = || {
        encoding
            .decode_without_bom_handling(&undoubled)
            .0
            .into_owned()
    };
    Cow::Owned(decoded.map_or_else(lossy, Cow::into_owned))
}

/// Undoes a doubled backslash byte in the second half of a character. Writers that do not know the encoding double it.
fn without_doubled_tails(piece: &[u8]) -> Cow<'_, [u8]> {
    if !piece.windows(2).any(|pair| pair == b"\\\\") {
        return Cow::Borrowed(piece);
    }
    let mut kept = Vec::with_capacity(piece.len());
    let mut bytes = piece.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        kept.push(byte);
        // In the encodings with a backslash byte in second halves, all first halves are above ASCII.
        if byte.is_ascii() {
            continue;
        }
        let Some(tail) = bytes.next() else { break };
        kept.push(tail);
        if tail == b'\\' {
            bytes.next_if_eq(&b'\\');
        }
    }
    Cow::Owned(kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use encoding_rs::EUC_KR;
    use encoding_rs::{BIG5, GB18030, SHIFT_JIS, WINDOWS_1250, WINDOWS_1251, WINDOWS_1252};
    use proptest::prelude::*;

    #[track_caller]
    fn check_names(encoding: &'static Encoding, names: &[&str]) {
        for name in names {
            check_file(encoding, &[name]);
        }
        check_file(encoding, names);
    }

    /// Checks that a file with these names in this encoding is read like the same file in UTF-8.
    #[track_caller]
    fn check_file(encoding: &'static Encoding, names: &[&str]) {
        let text = names
            .iter()
            .map(|name| format!("#1=PRODUCT('x1','{name}',$);\n"))
            .collect::<String>();
        let (encoded, _, has_errors) = encoding.encode(&text);
        assert!(!has_errors, "{text}");
        assert_eq!(
            String::from_utf8_lossy(&in_utf8(&encoded)),
            text,
            "{}",
            encoding.name()
        );
    }

    #[test]
    fn names_in_the_encodings_of_cad_systems() {
        check_names(
            GB18030,
            &[
                "平面",
                "孔",
                "零件",
                "底板",
                "轴",
                "齿轮",
                "弹簧",
                "装配体1",
                "倒角 2x45°",
                "螺栓M6-左",
            ],
        );
        check_names(
            SHIFT_JIS,
            &[
                "部品",
                "表示ソ",
                "穴",
                "ボルト",
                "ﾌﾞﾗｹｯﾄ",
                "ねじ",
                "平面",
                "軸",
                "筐体 上",
                "能力表",
            ],
        );
        check_names(
            WINDOWS_1251,
            &[
                "Деталь",
                "Сборка1",
                "вал",
                "КОРПУС ВАЛА",
                "болт М6",
                "отверстие",
                "шайба 10",
            ],
        );
        check_names(
            WINDOWS_1252,
            &[
                "Gehäuse",
                "Ø8",
                "Größe",
                "45°",
                "pièce n°1",
                "é",
                "Fläche",
                "Façade",
                "µm",
                "boîtier",
                "±0,1",
            ],
        );
    }

    #[test]
    fn rarer_encodings_need_more_text() {
        check_file(
            BIG5,
            &[
                "零件",
                "圓柱",
                "組合件",
                "螺絲",
                "上蓋板",
                "彈簧座",
                "齒輪箱",
            ],
        );
        check_file(
            EUC_KR,
            &[
                "부품",
                "평면",
                "조립품",
                "볼트",
                "나사",
                "하우징",
                "기어박스",
            ],
        );
        check_file(
            WINDOWS_1250,
            &[
                "část číslo jedna",
                "šroub nejdelší",
                "tuleja łożyska",
                "płyta górna",
                "deska přední",
                "koło zębate",
                "pružina",
                "příruba čerpadla",
                "těleso převodovky",
            ],
        );
    }

    #[test]
    fn texts_in_utf_8_are_handed_back() {
        for text in ["#1=A('x');", "#1=A('äöü 零件');"] {
            assert!(
                matches!(in_utf8(text.as_bytes()), Cow::Borrowed(same) if same == text.as_bytes())
            );
        }
    }

    #[test]
    fn wide_texts_by_their_byte_order() {
        let text = "ISO-10303-21;DATA;#1=PRODUCT('平面 ä',$);";
        let little: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let big: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        for wide in [
            [&[0xff, 0xfe], &*little].concat(),
            little,
            [&[0xfe, 0xff], &*big].concat(),
            big,
        ] {
            assert_eq!(in_utf8(&wide), text.as_bytes());
        }
    }

    #[test]
    fn a_string_in_utf_8_among_others() {
        let mixed = [&b"#1=A('Geh\xe4use','"[..], "Größe".as_bytes(), b"');"].concat();
        assert_eq!(in_utf8(&mixed), "#1=A('Gehäuse','Größe');".as_bytes());
    }

    #[test]
    fn second_halves_that_look_like_a_backslash() {
        for (bytes, expected) in [
            (&b"'\x95\x5c\x8e\xa6\x83\x5c'"[..], "'表示ソ'"),
            (b"'\x95\x5c\x5c\x8e\xa6'", "'表示'"),
            (b"'\x83\x5c\x5c\x5c\x95\x94\x95\x69'", r"'ソ\部品'"),
        ] {
            assert_eq!(String::from_utf8_lossy(&in_utf8(bytes)), expected);
        }
    }

    proptest! {
        #[test]
        fn any_bytes_become_utf_8(text: Vec<u8>) {
            prop_assert!(std::str::from_utf8(&in_utf8(&text)).is_ok());
        }
    }
}
