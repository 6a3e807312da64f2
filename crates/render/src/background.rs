//! Defines the background of a picture: white, a color, or nothing.

use crate::Rgb;
use std::fmt;
use std::str::FromStr;

/// Text is light if the background is darker than this.
const DARK: f64 = 128.0;
/// The color of text on a light background.
const DARK_INK: Rgb = [40; 3];
/// The color of text on a dark background.
const LIGHT_INK: Rgb = [235; 3];

/// The background of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Background {
    /// White.
    #[default]
    White,
    /// No background: the page behind the picture is visible.
    Transparent,
    /// A color.
    Color(Rgb),
}

/// The reason why a text is not a background.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is not a background; choose white, transparent, or a color such as #f0f0f0")]
pub struct NotABackground(String);

impl FromStr for Background {
    type Err = NotABackground;

    fn from_str(text: &str) -> Result<Self, NotABackground> {
        match text {
            "white" => Ok(Self::White),
            "transparent" => Ok(Self::Transparent),
            _ => {
                let color = text.strip_prefix('#').and_then(rgb_of);
                color
                    .map(Self::Color)
                    .ok_or_else(|| NotABackground(text.to_owned()))
            }
        }
    }
}

/// The color of six hexadecimal digits, or of three digits, each of which is repeated.
fn rgb_of(digits: &str) -> Option<Rgb> {
    let values: Option<Vec<u8>> = digits
        .chars()
        .map(|digit| {
            digit
                .to_digit(16)
                .and_then(|value| u8::try_from(value).ok())
        })
        .collect();
    match *values?.as_slice() {
        [r, g, b] => Some([r, g, b].map(|value| value * 17)),
        [a, b, c, d, e, f] => Some([16 * a + b, 16 * c + d, 16 * e + f]),
        _ => None,
    }
}

impl fmt::Display for Background {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::White => f.write_str("white"),
            Self::Transparent => f.write_str("transparent"),
            Self::Color([r, g, b]) => write!(f, "#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

impl Background {
    /// The color, or `None` if there is no background.
    #[must_use]
    pub fn color(self) -> Option<Rgb> {
        match self {
            Self::White => Some([255; 3]),
            Self::Transparent => None,
            Self::Color(color) => Some(color),
        }
    }

    /// The color of text that is readable on this background. Transparent pictures are mostly placed on white.
    #[must_use]
    pub(crate) fn ink(self) -> Rgb {
        let [r, g, b] = self.color().unwrap_or([255; 3]).map(f64::from);
        if 0.299 * r + 0.587 * g + 0.114 * b < DARK {
            LIGHT_INK
        } else {
            DARK_INK
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for text in ["white", "transparent", "#0a1bff"] {
            assert_eq!(text.parse::<Background>().unwrap().to_string(), text);
        }
        assert_eq!("#fA0".parse(), Ok(Background::Color([255, 170, 0])));
        for text in ["", "#", "#12", "#12345g", "fff", "none", "#+12345"] {
            assert!(text.parse::<Background>().is_err(), "{text}");
        }
    }

    #[test]
    fn text_is_seen_on_its_background() {
        for (text, ink) in [
            ("white", DARK_INK),
            ("transparent", DARK_INK),
            ("#000", LIGHT_INK),
            ("#00f", LIGHT_INK),
            ("#ff0", DARK_INK),
        ] {
            assert_eq!(text.parse::<Background>().unwrap().ink(), ink, "{text}");
        }
    }
}
