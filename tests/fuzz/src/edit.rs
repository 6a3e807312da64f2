//! Edits of single tokens: STEP text in, STEP text out whose syntax still holds, so that the geometry behind it is reached.

use std::ops::Range;

/// Numbers that break what was not thought of.
const NUMBERS: [&str; 14] = [
    "0.", "-0.", "1.", "-1.", "1E-7", "-1E-12", "1E12", "1E300", "-1E308", "1E-300", "3.141592653589793", "90.", "0.5", "7",
];

/// What a token is, by its first byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Reference,
    Number,
    Keyword,
    Enumeration,
    Instance,
}

/// The text with one token edited; `None` if there is no token to edit.
#[must_use]
pub fn edited(text: &[u8], seed: u32) -> Option<Vec<u8>> {
    let mut random = Random(u64::from(seed) | 1 << 40);
    let tokens = tokens(text);
    let (kind, range) = random.pick(&tokens)?.clone();
    let same_kind: Vec<&[u8]> =
        tokens.iter().filter(|token| token.0 == kind).map(|(_, range)| &text[range.clone()]).collect();
    let other = *random.pick(&same_kind)?;
    let replacement: Vec<u8> = match kind {
        Kind::Number if random.below(3) > 0 => random.pick(&NUMBERS)?.as_bytes().to_vec(),
        Kind::Number | Kind::Reference | Kind::Keyword => other.to_vec(),
        Kind::Enumeration if text[range.clone()] == *b".T." => b".F.".to_vec(),
        Kind::Enumeration if text[range.clone()] == *b".F." => b".T.".to_vec(),
        Kind::Enumeration => other.to_vec(),
        Kind::Instance if random.below(2) == 0 => Vec::new(),
        Kind::Instance => [&text[range.clone()], b"\n", other].concat(),
    };
    Some([&text[..range.start], &replacement, &text[range.end..]].concat())
}

/// Every token of the data section, and every line of it as an instance.
fn tokens(text: &[u8]) -> Vec<(Kind, Range<usize>)> {
    let start = text.windows(5).position(|window| window == b"DATA;").map_or(0, |at| at + 5);
    let mut found = Vec::new();
    let mut line_start = start;
    let mut at = start;
    while at < text.len() {
        let Some(kind) = kind(text, at) else {
            if text[at] == b'\n' {
                found.push((Kind::Instance, line_start..at));
                line_start = at + 1;
            }
            at += 1;
            continue;
        };
        let inside = |byte: &u8| byte.is_ascii_alphanumeric() || b"_.+-".contains(byte);
        let len = text[at + 1..].iter().take_while(|byte| inside(byte)).count() + 1;
        found.push((kind, at..at + len));
        at += len;
    }
    found
}

fn kind(text: &[u8], at: usize) -> Option<Kind> {
    let next_is_digit = text.get(at + 1).is_some_and(u8::is_ascii_digit);
    match text[at] {
        b'#' if next_is_digit => Some(Kind::Reference),
        b'0'..=b'9' => Some(Kind::Number),
        b'-' | b'+' if next_is_digit => Some(Kind::Number),
        b'A'..=b'Z' => Some(Kind::Keyword),
        b'.' => Some(Kind::Enumeration),
        _ => None,
    }
}

/// A small generator: libFuzzer gives a seed for each edit.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % n.max(1)
    }

    fn pick<'a, T>(&mut self, from: &'a [T]) -> Option<&'a T> {
        from.get(self.below(from.len()))
    }
}
