//! Guesses the encoding of strings that are neither ASCII nor UTF-8, from the characters that they would contain.

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{
    BIG5, Encoding, GB18030, GBK, SHIFT_JIS, WINDOWS_1250, WINDOWS_1251, WINDOWS_1252,
};
use std::borrow::Cow;

/// With this number of bytes beyond ASCII, a statistical guess is trusted without further tests. The first number is for
/// encodings of one byte per character, the second for encodings of two.
const ENOUGH_BYTES: [usize; 2] = [12, 24];

/// The encoding of strings that are not UTF-8.
///
/// Names are short, so the statistics of a few bytes are not reliable. Therefore the encodings that CAD systems write most are
/// preferred if every string looks like words in them, and the statistical guess chooses among them. If there is enough text, the
/// guess decides alone.
pub(super) fn guessed_encoding(sample: &[&[u8]]) -> &'static Encoding {
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

/// The encodings that CAD systems write most. The one that is recognized most reliably comes first.
const COMMON: [&Encoding; 4] = [GB18030, SHIFT_JIS, WINDOWS_1251, WINDOWS_1252];

/// The encodings that are accepted as a guess from a few bytes.
const PLAUSIBLE: [&Encoding; 6] = [
    GB18030,
    SHIFT_JIS,
    BIG5,
    WINDOWS_1250,
    WINDOWS_1251,
    WINDOWS_1252,
];

/// Whether the strings decode without an error and without characters for private use.
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
        return decodes(encoding, sample) && common_fraction(sample, common_in_gb) >= 0.6;
    }
    if encoding == SHIFT_JIS {
        return decodes(encoding, sample) && common_fraction(sample, common_in_sjis) >= 0.6;
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
    // A single letter may belong to any alphabet.
    all_fit && (longest > 1 || encoding == WINDOWS_1252)
}

/// The fraction of common characters among those beyond ASCII. `is_common` gets the bytes of a string that begin with the
/// character, and the byte before it.
fn common_fraction(sample: &[&[u8]], is_common: impl Fn(&[u8], u8) -> Kind) -> f64 {
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
    /// A character of one byte beyond ASCII.
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

/// Wide and narrow kana, symbols, and the more frequent half of the ideographs of JIS X 0208. A single narrow kana between ASCII
/// characters does not count.
fn common_in_sjis(text: &[u8], before: u8) -> Kind {
    match text {
        [0xa1..=0xdf, rest @ ..] => Kind::Narrow {
            is_common: !before.is_ascii() || rest.first().is_some_and(|next| !next.is_ascii()),
        },
        [0x81..=0x83 | 0x88..=0x98, ..] => Kind::Common,
        _ => Kind::Rare,
    }
}

/// Whether a word is Cyrillic, and is written in capitals, in small letters, or with a capital first letter.
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

/// Whether a word may belong to a western language: it has one or two letters with diacritics among ASCII letters, or it is a
/// single sign.
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
