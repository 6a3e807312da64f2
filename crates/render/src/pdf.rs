//! Writes a drawing as PDF: one page of its size.

use crate::drawing::{Item, Spot};
use crate::helvetica::text_width;
use crate::svg::BLEED;
use crate::{Drawing, Rgb};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, Str};
use std::io::{self, Write};

/// The name of the typeface on the page.
const FONT: Name<'static> = Name(b"F1");
/// The replacement of a character that the encoding does not have.
const UNKNOWN: u8 = b'?';

impl Drawing {
    /// The drawing as the bytes of a PDF file.
    ///
    /// Letters outside of Latin-1 are written as `?`, because the typeface of the page does not have them.
    ///
    /// # Errors
    /// If the page cannot be compressed.
    pub fn to_pdf(&self) -> io::Result<Vec<u8>> {
        let [catalog, pages, page, font, content] = [1, 2, 3, 4, 5].map(Ref::new);
        let mut pdf = Pdf::new();
        pdf.catalog(catalog).pages(pages);
        pdf.pages(pages).kids([page]).count(1);
        let mut description = pdf.page(page);
        description
            .media_box(Rect::new(0.0, 0.0, self.width as f32, self.height as f32))
            .parent(pages)
            .contents(content);
        description.resources().fonts().pair(FONT, font);
        description.finish();
        pdf.type1_font(font)
            .base_font(Name(b"Helvetica"))
            .encoding_predefined(Name(b"WinAnsiEncoding"));
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&self.page_content())?;
        let packed = encoder.finish()?;
        pdf.stream(content, &packed).filter(Filter::FlateDecode);
        Ok(pdf.finish())
    }

    fn page_content(&self) -> Vec<u8> {
        let mut content = Content::new();
        // The vertical coordinate increases downward in a drawing, and upward on a page.
        content.transform([1.0, 0.0, 0.0, -1.0, 0.0, self.height as f32]);
        content.set_line_join(LineJoinStyle::RoundJoin);
        content.set_line_cap(LineCapStyle::RoundCap);
        if let Some(color) = self.background.color() {
            set_fill(&mut content, color);
            content.rect(0.0, 0.0, self.width as f32, self.height as f32);
            content.fill_nonzero();
        }
        for item in &self.items {
            push_item(&mut content, item);
        }
        content.finish().into_vec()
    }
}

fn push_item(content: &mut Content, item: &Item) {
    match item {
        Item::Fill { color, borders } => {
            set_fill(content, *color);
            set_stroke(content, *color, BLEED);
            borders.iter().for_each(|border| {
                push_path(content, border);
                content.close_path();
            });
            content.fill_nonzero_and_stroke();
        }
        Item::Lines {
            color,
            width,
            lines,
        } => {
            set_stroke(content, *color, *width);
            for line in lines {
                match line.as_slice() {
                    [first, between @ .., last] if !between.is_empty() && first == last => {
                        push_path(content, &line[..line.len() - 1]);
                        content.close_path();
                    }
                    _ => push_path(content, line),
                }
            }
            content.stroke();
        }
        Item::Text {
            text,
            at: [x, y],
            anchor,
            size,
            color,
        } => {
            let left = x - anchor.share_before() * text_width(text, *size);
            set_fill(content, *color);
            content.begin_text();
            content.set_font(FONT, *size as f32);
            content.set_text_matrix([1.0, 0.0, 0.0, -1.0, rounded(left), rounded(*y)]);
            let latin: Vec<u8> = text.chars().map(byte_of).collect();
            content.show(Str(&latin));
            content.end_text();
        }
    }
}

fn push_path(content: &mut Content, points: &[Spot]) {
    for (place, point) in points.iter().enumerate() {
        let [x, y] = point.map(rounded);
        if place == 0 {
            content.move_to(x, y);
        } else {
            content.line_to(x, y);
        }
    }
}

fn set_fill(content: &mut Content, color: Rgb) {
    let [r, g, b] = color.map(channel);
    content.set_fill_rgb(r, g, b);
}

fn set_stroke(content: &mut Content, color: Rgb, width: f64) {
    let [r, g, b] = color.map(channel);
    content.set_stroke_rgb(r, g, b);
    content.set_line_width(width as f32);
}

/// A channel from 0 to 1 with three decimals.
fn channel(value: u8) -> f32 {
    (f32::from(value) / 255.0 * 1000.0).round() / 1000.0
}

/// A number with two decimals.
fn rounded(value: f64) -> f32 {
    ((value * 100.0).round() / 100.0) as f32
}

/// The byte of a character in WinAnsi, which agrees with Latin-1 except for the bytes from 128 to 159.
fn byte_of(character: char) -> u8 {
    match u32::from(character) {
        code @ (32..=126 | 160..=255) => code as u8,
        _ => UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Background;
    use crate::drawing::Anchor;

    #[test]
    fn a_page_has_the_size_and_the_items_of_the_drawing() {
        let mut drawing = Drawing::blank(200.0, 100.0, Background::Transparent);
        drawing.items = vec![
            Item::Fill {
                color: [255, 0, 51],
                borders: vec![vec![[0.0, 0.0], [10.0, 0.0], [0.0, 10.25]]],
            },
            Item::Text {
                text: "né→".to_owned(),
                at: [1.0, 2.0],
                anchor: Anchor::Start,
                size: 9.0,
                color: [0; 3],
            },
        ];
        let page = drawing.page_content();
        let page = String::from_utf8_lossy(&page);
        assert!(
            page.contains("1 0 0.2 rg") && page.contains("0 10.25 l"),
            "{page}"
        );
        assert!(!page.contains(" re\n"), "{page}");
        // The text in hexadecimal digits: n, é and the question mark for the arrow.
        assert!(page.to_ascii_uppercase().contains("<6EE93F>"), "{page}");
        let bytes = drawing.to_pdf().unwrap();
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.starts_with("%PDF-") && text.trim_end().ends_with("%%EOF"));
        assert!(text.contains("/MediaBox [0 0 200 100]"), "{text}");
        assert_eq!(bytes, drawing.to_pdf().unwrap());
    }
}
