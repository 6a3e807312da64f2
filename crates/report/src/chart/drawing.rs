//! Holds the shapes of a chart with its size, so that it can stand in the page or in a file.

use crate::html::escaped;

/// A drawn chart.
#[derive(Clone, Debug)]
pub(crate) struct Drawing {
    /// Width and height in units of the view box.
    pub(crate) size: [f64; 2],
    /// What it shows, for assistive technology.
    pub(crate) label: String,
    /// Further attributes, with a leading space: its classes, and the ranges of its axes.
    pub(crate) attributes: String,
    /// The shapes and the texts.
    pub(crate) body: String,
}

/// An entry of a legend.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Entry {
    pub(crate) name: String,
    /// The index of its color.
    pub(crate) color: usize,
}

impl Drawing {
    /// An element of an HTML page, as wide as its place.
    pub(crate) fn to_svg(&self) -> String {
        self.element("")
    }

    /// An element of an SVG file, with its corner at a place.
    pub(crate) fn to_svg_at(&self, x: f64, y: f64) -> String {
        let [width, height] = self.size;
        self.element(&format!(
            "x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" "
        ))
    }

    fn element(&self, place: &str) -> String {
        let [width, height] = self.size;
        format!(
            "<svg {place}viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{}\"{}>{}</svg>\n",
            escaped(&self.label),
            self.attributes,
            self.body
        )
    }
}
