//! Writes a drawing as SVG.

use crate::drawing::{Anchor, Item, Spot};
use crate::{Drawing, Rgb};
use std::fmt::Write as _;

/// Areas have a border in their own color with this width, so that no gap is visible between two of them.
pub(crate) const BLEED: f64 = 0.4;

impl Drawing {
    /// The drawing as the text of an SVG file.
    #[must_use]
    pub fn to_svg(&self) -> String {
        let [width, height] = [self.width, self.height].map(number);
        let mut text = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n"
        );
        if let Some(color) = self.background.color() {
            let color = hexadecimal(color);
            let _ = writeln!(
                text,
                "<rect width=\"{width}\" height=\"{height}\" fill=\"{color}\"/>"
            );
        }
        for item in &self.items {
            push_item(&mut text, item);
        }
        text + "</svg>\n"
    }
}

fn push_item(text: &mut String, item: &Item) {
    let _ = match item {
        Item::Fill { color, borders } => {
            let color = hexadecimal(*color);
            let path: String = borders.iter().map(|border| path(border) + "Z").collect();
            writeln!(
                text,
                "<path fill=\"{color}\" stroke=\"{color}\" stroke-width=\"{BLEED}\" d=\"{path}\"/>"
            )
        }
        Item::Lines {
            color,
            width,
            lines,
        } => {
            let (color, width) = (hexadecimal(*color), number(*width));
            let path: String = lines.iter().map(|line| open_or_closed(line)).collect();
            writeln!(
                text,
                "<path fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\" d=\"{path}\"/>"
            )
        }
        Item::Text {
            text: written,
            at,
            anchor,
            size,
            color,
        } => {
            let anchor = match anchor {
                Anchor::Start => "start",
                Anchor::Middle => "middle",
                Anchor::End => "end",
            };
            let ([x, y], size) = (at.map(number), number(*size));
            let (color, written) = (hexadecimal(*color), escaped(written));
            writeln!(
                text,
                "<text x=\"{x}\" y=\"{y}\" text-anchor=\"{anchor}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"{size}\" \
                 fill=\"{color}\">{written}</text>"
            )
        }
    };
}

fn open_or_closed(line: &[Spot]) -> String {
    match line {
        [first, between @ .., last] if !between.is_empty() && first == last => {
            path(&line[..line.len() - 1]) + "Z"
        }
        _ => path(line),
    }
}

fn path(points: &[Spot]) -> String {
    let mut text = String::new();
    for (place, point) in points.iter().enumerate() {
        let [x, y] = point.map(number);
        let letter = if place == 0 { "M" } else { "L" };
        let _ = write!(text, "{letter}{x} {y}");
    }
    text
}

/// A number with at most two decimals.
fn number(value: f64) -> String {
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

fn hexadecimal([r, g, b]: Rgb) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A text in which no character is markup; control characters are left out, because XML does not allow them.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for character in text.chars().filter(|character| !character.is_control()) {
        match character {
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '&' => escaped += "&amp;",
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Background;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (-0.001, "0"),
            (1.5, "1.5"),
            (10.0, "10"),
            (2.346, "2.35"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn a_drawing_is_written_item_by_item() {
        let mut drawing = Drawing::blank(10.0, 5.0, Background::Color([1, 2, 255]));
        drawing.items = vec![
            Item::Fill {
                color: [255, 0, 0],
                borders: vec![vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]],
            },
            Item::Lines {
                color: [0; 3],
                width: 0.75,
                lines: vec![
                    vec![[0.0, 0.0], [2.0, 2.0]],
                    vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 0.0]],
                ],
            },
            Item::Text {
                text: "a<b\u{7}&".to_owned(),
                at: [1.0, 2.0],
                anchor: Anchor::End,
                size: 9.0,
                color: [40; 3],
            },
        ];
        let text = drawing.to_svg();
        for part in [
            "viewBox=\"0 0 10 5\"",
            "fill=\"#0102ff\"",
            "d=\"M0 0L1 0L0 1Z\"",
            "d=\"M0 0L2 2M0 0L2 2L2 0Z\"",
            "text-anchor=\"end\"",
            ">a&lt;b&amp;</text>",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        drawing.background = Background::Transparent;
        assert!(!drawing.to_svg().contains("<rect"));
    }
}
