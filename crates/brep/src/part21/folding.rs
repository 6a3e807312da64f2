//! Joins the lines of texts that were cut into lines of one fixed length, as writers of the first edition do.
//!
//! A line end has no meaning in Part 21, so such a writer may cut a name or a number in two. A text whose lines end between
//! tokens is returned as it is.

use std::borrow::Cow;

/// No writer folds a text into lines that are shorter than this.
const NARROWEST: usize = 20;

/// The text without its line ends if it is cut into lines of one length. Any other text is returned as it is.
pub(crate) fn unfolded(text: Cow<'_, [u8]>) -> Cow<'_, [u8]> {
    if is_folded(&text) {
        let is_kept = |byte: &u8| !matches!(byte, b'\n' | b'\r');
        return Cow::Owned(text.iter().copied().filter(is_kept).collect());
    }
    text
}

/// Whether most of the lines that end inside a token have the same length, and no line of the data is longer.
fn is_folded(text: &[u8]) -> bool {
    // Old Macintosh files have carriage returns only.
    let line_end = if memchr::memchr(b'\n', text).is_some() {
        b'\n'
    } else {
        b'\r'
    };
    // Most texts have no such line, which is found quickly.
    if !memchr::memchr_iter(line_end, text).any(|end| is_cut(text, end)) {
        return false;
    }
    let mut cuts = Cuts::default();
    let mut start = 0;
    for end in memchr::memchr_iter(line_end, text) {
        cuts.add(&text[start..end], is_cut(text, end));
        start = end + 1;
    }
    cuts.widest >= NARROWEST && 2 * cuts.n_at_widest > cuts.n
}

/// Whether a token continues after the line end at this position.
fn is_cut(text: &[u8], end: usize) -> bool {
    text.get(end + 1).is_some_and(|&byte| is_in_token(byte)) && {
        let line = text[..end].strip_suffix(b"\r").unwrap_or(&text[..end]);
        line.last()
            .is_some_and(|&byte| byte == b'#' || is_in_token(byte))
    }
}

/// Lines that end inside a token.
#[derive(Default)]
struct Cuts {
    n: usize,
    /// The number of those that are as long as the longest line.
    n_at_widest: usize,
    widest: usize,
}

impl Cuts {
    fn add(&mut self, line: &[u8], is_cut: bool) {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        if line.len() > self.widest {
            self.widest = line.len();
            self.n_at_widest = 0;
        }
        // The lines of the header do not count, because a writer need not fold it.
        if line == b"DATA;" {
            *self = Self::default();
        }
        self.n += usize::from(is_cut);
        self.n_at_widest += usize::from(is_cut && line.len() == self.widest);
    }
}

fn is_in_token(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        assert_eq!(
            String::from_utf8_lossy(&unfolded(Cow::Borrowed(text.as_bytes()))),
            expected
        );
    }

    /// The text with a line end after every `width` characters.
    fn folded(text: &str, width: usize, line_end: &str) -> String {
        let lines: Vec<&str> = text
            .as_bytes()
            .chunks(width)
            .map(|line| std::str::from_utf8(line).unwrap())
            .collect();
        lines.join(line_end)
    }

    const DATA: &str = "#1=CARTESIAN_POINT('a name',(10.0,-20.5,30.25));#2=CARTESIAN_POINT('',(1.,2.,3.));#30=POLYLINE('',(#1,#2));";

    #[test]
    fn lines_of_one_length_are_joined() {
        for width in [20, 30, 60, 72] {
            for line_end in ["\n", "\r\n", "\r"] {
                check(&folded(DATA, width, line_end), DATA);
                let header = "HEADER;FILE_NAME('a long line before the data begins, longer than all that follow it, by far');";
                let text = format!(
                    "{header}{line_end}DATA;{line_end}{}",
                    folded(DATA, width, line_end)
                );
                check(&text, &format!("{header}DATA;{DATA}"));
            }
        }
    }

    #[test]
    fn other_texts_are_left_alone() {
        for text in [
            DATA,
            "#1=POLYLINE('',\n(#1,\n#2));\n#2=CIRCLE('',#3,\n2.);\n",
            "/* a comment of\nseveral lines */\n#1=CARTESIAN_POINT('',(1.,2.,3.));\n",
            "#1=&SCOPE\n#2=A();\nENDSCOPE\nCLOSED_SHELL('a name that is long',());\n",
            "#1=\nA\n(1\n,2\n);",
            "",
        ] {
            check(text, text);
        }
    }
}
