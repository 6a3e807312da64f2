//! Bytes in whatever encoding become UTF-8, once for a file: UTF-16 by its byte order, others by what their strings look
//! like.
//!
//! A text of ASCII or UTF-8 is handed back as it is. Bytes of two-byte encodings that look like a backslash are gone
//! afterwards, so that nothing that follows has to know of them. Control directives are not touched here.

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{
    BIG5, Encoding, GB18030, GBK, SHIFT_JIS, UTF_16BE, UTF_16LE, WINDOWS_1250, WINDOWS_1251,
    WINDOWS_1252,
};
use std::borrow::Cow;
use std::collections::BTreeSet;

/// With so many bytes beyond ASCII a statistical guess is trusted alone, if it is an encoding of one byte per character, or
/// of two.
const ENOUGH_BYTES: [usize; 2] = [12, 24];
/// No more than this of a file's strings is looked at for a guess.
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

/// The text between quotes, in and out of strings: no encoding that is known here has a quote inside a character.
fn pieces(text: &[u8]) -> impl Iterator<Item = (&[u8], bool)> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let quote = text.iter().position(|&byte| byte == b'\'');
        rest = quote.map(|quote| &text[quote + 1..]);
        Some((&text[..quote.unwrap_or(text.len())], quote.is_none()))
    })
}

/// The pieces that are not UTF-8, each once.
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

/// A piece in the file's encoding; UTF-8 where it is that and the encoding cannot tell.
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

/// Writers that know nothing of characters double the backslash byte in the second half of one.
fn without_doubled_tails(piece: &[u8]) -> Cow<'_, [u8]> {
    if !piece.windows(2).any(|pair| pair == b"\\\\") {
        return Cow::Borrowed(piece);
    }
    let mut kept = Vec::with_capacity(piece.len());
    let mut bytes = piece.iter().copied().peekable();
    while let Some(byte) = bytes.next() {
        kept.push(byte);
        // Of the encodings with a backslash byte in second halves, all first halves are above ASCII.
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

/// The encoding of strings that are not UTF-8.
///
/// Names are short, and statistics of a few bytes say little. Of the encodings that CAD systems write most, those come
/// first in which every string looks like words; the guess decides among them, and alone where there is enough text.
fn guessed_encoding(sample: &[&[u8]]) -> &'static Encoding {
    let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
    for piece in sample {
        detector.feed(piece, false);
        detector.feed(b"\n", false);
    }
    detector.feed(b"", true);
    let guess = match detector.guess(None, Utf8Detection::Deny) {
        encoding if encoding == GBK => GB18030,
        encoding => encoding,
    };
    let n_bytes = sample
        .iter()
        .flat_map(|piece| piece.iter())
        .filter(|byte| !byte.is_ascii())
        .count();
    let enough = ENOUGH_BYTES[usize::from(!guess.is_single_byte())];
    let is_sure = n_bytes >= enough && (!guess.is_single_byte() || PLAUSIBLE.contains(&guess));
    let fitting: Vec<&Encoding> = COMMON
        .into_iter()
        .filter(|encoding| fits(encoding, sample))
        .collect();
    match fitting.as_slice() {
        _ if fitting.contains(&guess) => guess,
        _ if is_sure && decodes(guess, sample) => guess,
        [first, ..] => first,
        [] if decodes(guess, sample) && PLAUSIBLE.contains(&guess) => guess,
        [] => WINDOWS_1252,
    }
}

/// The encodings that CAD systems write most, the surest to be recognized first.
const COMMON: [&Encoding; 4] = [GB18030, SHIFT_JIS, WINDOWS_1251, WINDOWS_1252];
/// Those that a few bytes may still be taken for.
const PLAUSIBLE: [&Encoding; 6] = [
    GB18030,
    SHIFT_JIS,
    BIG5,
    WINDOWS_1250,
    WINDOWS_1251,
    WINDOWS_1252,
];

/// Whether the strings decode without an error, and without characters that are nobody's.
fn decodes(encoding: &'static Encoding, sample: &[&[u8]]) -> bool {
    let is_assigned =
        |text: Cow<'_, str>| !text.contains(|letter| matches!(letter, '\u{e000}'..='\u{f8ff}'));
    let decode = |piece: &&[u8]| {
        encoding
            .decode_without_bom_handling_and_without_replacement(piece)
            .is_some_and(is_assigned)
    };
    sample.iter().all(decode)
}

/// Whether the strings look like words in one of the [`COMMON`] encodings.
fn fits(encoding: &'static Encoding, sample: &[&[u8]]) -> bool {
    if encoding == GB18030 {
        return decodes(encoding, sample) && share(sample, common_in_gb) >= 0.6;
    }
    if encoding == SHIFT_JIS {
        return decodes(encoding, sample) && share(sample, common_in_sjis) >= 0.6;
    }
    let mut longest = 0;
    let all_fit = sample.iter().all(|piece| {
        let (text, _) = encoding.decode_without_bom_handling(piece);
        let words = text.split(|letter: char| !letter.is_alphabetic() && letter.is_ascii());
        words.filter(|word| !word.is_ascii()).all(|word| {
            longest = longest.max(word.chars().count());
            if encoding == WINDOWS_1251 {
                is_russian(word)
            } else {
                is_western(word)
            }
        })
    });
    // A letter alone may be one of any alphabet.
    all_fit && (longest > 1 || encoding == WINDOWS_1252)
}

/// The fraction of the characters beyond ASCII that are common ones; of a string, `is_common` gets the bytes from the
/// character on and the byte before it.
fn share(sample: &[&[u8]], is_common: impl Fn(&[u8], u8) -> Kind) -> f64 {
    let (mut n_common, mut n_characters) = (0_u32, 0_u32);
    for piece in sample {
        let (mut at, mut before) = (0, 0);
        while let Some(&lead) = piece.get(at) {
            let kind = if lead.is_ascii() {
                Kind::Ascii
            } else {
                is_common(&piece[at..], before)
            };
            before = lead;
            at += if matches!(kind, Kind::Ascii | Kind::Narrow { .. }) {
                1
            } else {
                2
            };
            n_common += u32::from(matches!(
                kind,
                Kind::Common | Kind::Narrow { is_common: true }
            ));
            n_characters += u32::from(kind != Kind::Ascii);
        }
    }
    f64::from(n_common) / f64::from(n_characters.max(1))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Ascii,
    /// One byte beyond ASCII.
    Narrow {
        is_common: bool,
    },
    Common,
    Rare,
}

/// The symbols and the more frequent half of the ideographs of GB 2312.
fn common_in_gb(text: &[u8], _: u8) -> Kind {
    match text {
        [0xa1..=0xa3 | 0xb0..=0xd7, 0xa1..=0xff, ..] => Kind::Common,
        _ => Kind::Rare,
    }
}

/// Kana, of either width, symbols, and the more frequent half of the ideographs of JIS X 0208. Narrow kana do not stand
/// alone.
fn common_in_sjis(text: &[u8], before: u8) -> Kind {
    match text {
        [0xa1..=0xdf, rest @ ..] => Kind::Narrow {
            is_common: !before.is_ascii() || rest.first().is_some_and(|next| !next.is_ascii()),
        },
        [0x81..=0x83 | 0x88..=0x98, ..] => Kind::Common,
        _ => Kind::Rare,
    }
}

/// Whether a word is Cyrillic and written as words are: in capitals, in small letters, or with the first one a capital.
fn is_russian(word: &str) -> bool {
    let letters = || word.chars().filter(|letter| letter.is_alphabetic());
    let is_cyrillic = letters().all(|letter| matches!(letter, 'А'..='я' | 'Ё' | 'ё'));
    let rest_is = |is: fn(char) -> bool| letters().skip(1).all(is);
    let is_word = rest_is(char::is_lowercase) || letters().all(char::is_uppercase);
    let n_letters = letters().count();
    let is_sign = n_letters == 0
        && word
            .chars()
            .all(|sign| matches!(sign, '°' | '±' | '№' | '«' | '»' | 'µ' | '–' | '—'));
    is_sign || (is_cyrillic && is_word)
}

/// Whether a word is one of a western language: a letter or two with signs among those of ASCII, or a sign alone.
fn is_western(word: &str) -> bool {
    let beyond: Vec<char> = word.chars().filter(|letter| !letter.is_ascii()).collect();
    let is_known = |letter: &char| matches!(letter, '\u{a0}'..='ÿ' | 'Š' | 'š' | 'Ž' | 'ž' | 'Œ' | 'œ' | 'Ÿ' | '€' | '‘'..='”' | '–' | '—' | '…' | '•' | '™');
    let longest_run = word
        .split(|letter: char| letter.is_ascii())
        .map(|run| run.chars().count())
        .max()
        .unwrap_or(0);
    beyond.iter().all(is_known)
        && (longest_run == 1 || (longest_run == 2 && beyond.len() < word.chars().count()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use encoding_rs::EUC_KR;
    use proptest::prelude::*;

    #[track_caller]
    fn check_names(encoding: &'static Encoding, names: &[&str]) {
        for name in names {
            check_file(encoding, &[name]);
        }
        check_file(encoding, names);
    }

    /// A file with these names in this encoding reads as the same file in UTF-8.
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
