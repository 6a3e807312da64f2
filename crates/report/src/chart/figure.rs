//! Turns a drawing into a figure of the page, or into the text of an SVG file.

use super::{Drawing, Entry, file_style::file_style};
use crate::html::escaped;
use std::fmt::Write as _;

/// The space around the drawing of a file.
const MARGIN: f64 = 10.0;
/// The height of a line of the caption or of the legend.
const LINE: f64 = 18.0;
/// The mean width of a letter of the caption, which is drawn with 13 pixels.
const LETTER: f64 = 6.9;

/// A chart of the page.
#[derive(Clone, Debug)]
pub struct Chart {
    /// A short name for its file, without an ending: lower-case letters, digits and hyphens.
    pub name: String,
    /// What it shows, in words.
    pub caption: String,
    drawing: Drawing,
    /// The series that the drawing does not name itself.
    legend: Vec<Entry>,
}

impl Chart {
    /// A chart of a drawing. Characters that do not suit the name of a file become hyphens.
    pub(crate) fn new(name: &str, caption: impl Into<String>, drawing: Drawing) -> Self {
        Self {
            name: file_name(name),
            caption: caption.into(),
            drawing,
            legend: Vec::new(),
        }
    }

    /// The chart with a list of its series, which only its file shows.
    pub(crate) fn with_legend(self, legend: Vec<Entry>) -> Self {
        Self { legend, ..self }
    }

    /// The chart with its caption, which assistive technology can also read.
    pub(crate) fn to_html(&self) -> String {
        format!(
            "<figure class=\"chart\"><figcaption>{}</figcaption>\n{}</figure>\n",
            escaped(&self.caption),
            self.drawing.to_svg()
        )
    }

    /// The text of an SVG file: the caption, the drawing and its legend, dark on white. Its colors need no support for variables
    /// of CSS, which programs that convert SVG files to PDF often lack.
    #[must_use]
    pub fn to_svg_file(&self) -> String {
        let [width, height] = self.drawing.size;
        let letters = (width / LETTER) as usize;
        let caption = wrapped(&self.caption, letters);
        let legend = self.legend_lines(width);

        let top = MARGIN + LINE * caption.len() as f64 + 4.0;
        let full = [
            width + 2.0 * MARGIN,
            top + height + LINE * legend.len() as f64 + MARGIN,
        ];
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\">\n\
             <style>\n{2}</style>\n<rect width=\"{0}\" height=\"{1}\" fill=\"#fff\"/>\n",
            full[0],
            full[1],
            file_style()
        );
        for (idx, line) in caption.iter().enumerate() {
            let y = MARGIN + LINE * (idx as f64 + 0.75);
            let _ = writeln!(
                svg,
                "<text class=\"caption\" x=\"{MARGIN}\" y=\"{y}\">{}</text>",
                escaped(line)
            );
        }
        svg.push_str(&self.drawing.to_svg_at(MARGIN, top));
        for (idx, line) in legend.iter().enumerate() {
            let y = top + height + LINE * (idx as f64 + 0.5);
            svg.push_str(&legend_svg(line, y));
        }
        svg + "</svg>\n"
    }

    /// The entries of the legend, in as many lines as they need.
    fn legend_lines(&self, width: f64) -> Vec<Vec<&Entry>> {
        let mut lines: Vec<Vec<&Entry>> = Vec::new();
        let mut used = 0.0;
        for entry in &self.legend {
            used += entry_width(entry);
            match lines.last_mut() {
                Some(line) if used <= width => line.push(entry),
                _ => {
                    lines.push(vec![entry]);
                    used = entry_width(entry);
                }
            }
        }
        lines
    }
}

/// The figures of some charts in a grid of this class. It is empty without charts.
pub(crate) fn grid(class: &str, charts: &[Chart]) -> String {
    if charts.is_empty() {
        return String::new();
    }
    let figures: String = charts.iter().map(Chart::to_html).collect();
    format!("<div class=\"{class}\">{figures}</div>\n")
}

fn entry_width(entry: &Entry) -> f64 {
    44.0 + LETTER * entry.name.chars().count() as f64
}

fn legend_svg(entries: &[&Entry], y: f64) -> String {
    let mut svg = String::new();
    let mut x = MARGIN;
    for entry in entries {
        let _ = writeln!(
            svg,
            "<path class=\"line {}\" d=\"M{x:.1} {y:.1}h22\"/><text class=\"name\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            super::series_class(entry.color),
            x + 28.0,
            y + 4.0,
            escaped(&entry.name)
        );
        x += entry_width(entry);
    }
    svg
}

/// Words in lines of at most this many letters, unless one word is longer.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn file_name(name: &str) -> String {
    let letters = name.chars().map(|letter| match letter {
        letter if letter.is_ascii_alphanumeric() => letter.to_ascii_lowercase(),
        _ => '-',
    });
    letters.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart::{Line, LineChart};

    fn chart() -> Chart {
        let drawing = LineChart {
            x_label: "update".to_owned(),
            y_label: "loss".to_owned(),
            lines: vec![Line {
                name: "a".to_owned(),
                points: vec![(0.0, 1.0), (1.0, 2.0)],
                ..Line::default()
            }],
            from_zero: true,
        };
        let entry = |color: usize| Entry {
            name: format!("a rather long name & {color}"),
            color,
        };
        Chart::new("Loss/term", "Loss & more", drawing.draw().unwrap())
            .with_legend((0..4).map(entry).collect())
    }

    #[test]
    fn a_file_has_a_caption_a_legend_and_no_variables() {
        let chart = chart();
        let svg = chart.to_svg_file();
        assert_eq!(chart.name, "loss-term");
        assert!(svg.starts_with("<svg xmlns=") && svg.ends_with("</svg>\n"));
        assert!(svg.contains(">Loss &amp; more</text>") && !svg.contains("var("));
        // One line of the chart, and four of the legend.
        assert_eq!(svg.matches("class=\"line ").count(), 5);
        assert_eq!(chart.legend_lines(430.0).len(), 2);
    }

    #[test]
    fn long_captions_are_wrapped_at_words() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("incomprehensible", 7), ["incomprehensible"]);
        assert_eq!(wrapped("", 7), [""; 0]);
    }
}
