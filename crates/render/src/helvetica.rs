//! Measures text in Helvetica, which every PDF reader has and every browser replaces by a typeface of equal widths.

/// The width of the characters from the space to `~`, in thousandths of the size of the letters.
#[rustfmt::skip]
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278,
    556, 556, 556, 556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556,
    1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833, 722, 778,
    667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556,
    333, 556, 556, 500, 556, 556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556,
    556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334, 260, 334, 584,
];
/// The width of any other character.
const OTHER: u16 = 556;

/// The length of a text whose letters have this size.
pub(crate) fn text_width(text: &str, size: f64) -> f64 {
    let width = |character: char| {
        let place = (character as usize).checked_sub(' ' as usize);
        let known = place.and_then(|place| WIDTHS.get(place));
        f64::from(known.copied().unwrap_or(OTHER))
    };
    text.chars().map(width).sum::<f64>() * size / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_their_widths() {
        for (text, width) in [
            ("", 0.0),
            ("W", 9.44),
            ("i.", 5.0),
            ("07", 11.12),
            ("é~", 11.4),
        ] {
            assert!((text_width(text, 10.0) - width).abs() < 1e-9, "{text}");
        }
    }
}
