//! Gives each supervision of a run its color, and distinguishes trained rows from other rows.

use crate::chart::class_of;
use crate::html::escaped;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The supervisions that were trained, in the order of the config: the order is that of the colors.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Names<'a> {
    trained: &'a [String],
}

impl<'a> Names<'a> {
    pub(crate) fn new(trained: &'a [String]) -> Self {
        Self { trained }
    }

    /// Whether backbones were trained on it.
    pub(crate) fn is_trained(&self, supervision: &str) -> bool {
        self.trained.iter().any(|name| name == supervision)
    }

    /// The index of its color. Rows without a training share one color.
    pub(crate) fn color(&self, supervision: &str) -> usize {
        let found = self.trained.iter().position(|name| name == supervision);
        found.unwrap_or(self.trained.len())
    }

    /// The class of its color, which is gray for rows without a training.
    pub(crate) fn class(&self, supervision: &str) -> String {
        class_of(
            self.is_trained(supervision)
                .then(|| self.color(supervision)),
        )
    }

    /// The name after a spot in its color.
    pub(crate) fn swatch(&self, supervision: &str) -> String {
        format!(
            "<span class=\"swatch {}\"></span>{}",
            self.class(supervision),
            escaped(supervision)
        )
    }

    /// A list of these names with their colors, in the order of the config.
    pub(crate) fn legend<'b>(&self, shown: impl Iterator<Item = &'b str>) -> String {
        let shown: BTreeSet<&str> = shown.collect();
        let mut list = String::from("<ul class=\"legend\">");
        for name in self
            .trained
            .iter()
            .filter(|name| shown.contains(name.as_str()))
        {
            let _ = write!(list, "<li>{}</li>", self.swatch(name));
        }
        list + "</ul>\n"
    }
}
