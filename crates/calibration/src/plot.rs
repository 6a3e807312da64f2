//! Draws the elements of a plot as SVG text: a panel with axes, ticks, lines and text. Plots of other verbs use it, too.

use std::fmt::Write as _;

/// A blue and an orange that most color-blind readers can distinguish on white.
pub const COLORS: [&str; 2] = ["#0072b2", "#d55e00"];

/// The start of an SVG file of this size, in pixels.
#[must_use]
pub fn opening(width: f64, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"system-ui, sans-serif\" font-size=\"12\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#fff\"/>\n"
    )
}

/// A rectangle of the picture, and the values at its sides.
#[derive(Clone, Copy, Debug)]
pub struct Panel {
    /// Distance from the left side of the picture, in pixels.
    pub left: f64,
    /// Distance from the upper side of the picture, in pixels.
    pub top: f64,
    /// Width, in pixels.
    pub width: f64,
    /// Height, in pixels.
    pub height: f64,
    /// Values at the left and the right side.
    pub x: (f64, f64),
    /// Values at the lower and the upper side.
    pub y: (f64, f64),
}

impl Panel {
    /// The distance of a value from the left side of the picture, in pixels.
    #[must_use]
    pub fn pixel_x(&self, value: f64) -> f64 {
        self.left + self.width * (value - self.x.0) / (self.x.1 - self.x.0)
    }

    /// The distance of a value from the upper side of the picture, in pixels.
    #[must_use]
    pub fn pixel_y(&self, value: f64) -> f64 {
        self.top + self.height * (1.0 - (value - self.y.0) / (self.y.1 - self.y.0))
    }

    /// The two axes.
    #[must_use]
    pub fn axes(&self) -> String {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        format!(
            "<path d=\"M{:.1} {:.1}V{bottom:.1}H{right:.1}\" fill=\"none\" stroke=\"#888\"/>\n",
            self.left, self.top
        )
    }

    /// A tick with its label below the horizontal axis.
    #[must_use]
    pub fn tick_x(&self, value: f64, label: &str) -> String {
        let (x, bottom) = (self.pixel_x(value), self.top + self.height);
        format!(
            "<path d=\"M{x:.1} {bottom:.1}v5\" stroke=\"#888\"/><text x=\"{x:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{label}</text>\n",
            bottom + 18.0
        )
    }

    /// A tick with its label next to the vertical axis.
    #[must_use]
    pub fn tick_y(&self, value: f64, label: &str) -> String {
        let y = self.pixel_y(value);
        format!(
            "<path d=\"M{:.1} {y:.1}h-5\" stroke=\"#888\"/><text x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"end\">{label}</text>\n",
            self.left,
            self.left - 8.0,
            y + 4.0
        )
    }

    /// A line through points, which are given as values.
    #[must_use]
    pub fn line(&self, points: &[(f64, f64)], style: &str) -> String {
        let mut line = String::from("<polyline fill=\"none\" points=\"");
        for &(x, y) in points {
            let _ = write!(line, "{:.1},{:.1} ", self.pixel_x(x), self.pixel_y(y));
        }
        let _ = writeln!(line, "\" {style}/>");
        line
    }
}

/// Text at a point of the picture, in pixels.
#[must_use]
pub fn text(x: f64, y: f64, attributes: &str, content: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" {attributes}>{content}</text>\n")
}
