//! The colours that styles give faces, shells and solids.

use super::source::Source;
use crate::part21::{Keyword, Param, Record};
use carrier::Color;
use std::collections::BTreeMap;

/// A style may refer to styles so many times; the standard's own chain has six links.
const MAX_CHAIN: u32 = 10;

const PRE_DEFINED: [(&[u8], u32); 8] = [
    (b"red", 0xff00_00ff),
    (b"green", 0x00ff_00ff),
    (b"blue", 0x0000_ffff),
    (b"yellow", 0xffff_00ff),
    (b"magenta", 0xff00_ffff),
    (b"cyan", 0x00ff_ffff),
    (b"black", 0x0000_00ff),
    (b"white", 0xffff_ffff),
];

/// The colour of each item that a `STYLED_ITEM` styles.
#[derive(Debug, Default)]
pub(super) struct Colors {
    /// By item; an overriding style replaces a plain one.
    by_item: BTreeMap<u64, Color>,
}

impl Colors {
    /// The colour that was given to this item itself.
    pub(super) fn of(&self, item: u64) -> Option<Color> {
        self.by_item.get(&item).copied()
    }

    /// Reads every styled item of the file; what has no surface colour is left out.
    pub(super) fn read(source: &Source<'_>) -> Self {
        let mut search = ColorSearch { source, known: BTreeMap::new() };
        let mut plain = BTreeMap::new();
        let mut overriding = BTreeMap::new();
        for &record in source.exchange.records() {
            let colors = match record.keyword {
                Keyword::StyledItem => &mut plain,
                Keyword::OverRidingStyledItem => &mut overriding,
                _ => continue,
            };
            if let Some((item, color)) = search.styled_item(record) {
                colors.entry(item).or_insert(color);
            }
        }
        plain.extend(overriding);
        Self { by_item: plain }
    }
}

/// A search for the colour behind a style, which remembers what it has found.
struct ColorSearch<'s, 'a> {
    source: &'s Source<'a>,
    known: BTreeMap<u64, Option<Color>>,
}

impl ColorSearch<'_, '_> {
    fn styled_item(&mut self, record: Record) -> Option<(u64, Color)> {
        let [_, styles, item] = self.source.params(record).ok()?;
        let item = item.reference().ok()?;
        let styles = styles.list().ok()?.references().ok()?;
        styles.into_iter().find_map(|style| self.color(style, 0)).map(|color| (item, color))
    }

    /// The first colour that a style leads to.
    fn color(&mut self, id: u64, n_links: u32) -> Option<Color> {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        // A style that leads back to itself finds no colour there.
        self.known.insert(id, None);
        let record = self.source.record(id).ok()?;
        let color = match record.keyword {
            _ if n_links > MAX_CHAIN => None,
            Keyword::ColourRgb => self.rgb(record),
            Keyword::DraughtingPreDefinedColour | Keyword::PreDefinedColour => self.pre_defined(record),
            Keyword::PresentationStyleAssignment
            | Keyword::PresentationStyleByContext
            | Keyword::SurfaceStyleUsage
            | Keyword::SurfaceSideStyle
            | Keyword::SurfaceStyleFillArea
            | Keyword::SurfaceStyleRendering
            | Keyword::SurfaceStyleRenderingWithProperties
            | Keyword::FillAreaStyle
            | Keyword::FillAreaStyleColour => self.first_color(record, n_links),
            _ => None,
        };
        self.known.insert(id, color);
        color
    }

    fn first_color(&mut self, record: Record, n_links: u32) -> Option<Color> {
        for param in self.source.exchange.params(record).iter() {
            let links = match param.ok()? {
                Param::Reference(id) => vec![id],
                Param::List(list) => list.references().unwrap_or_default(),
                _ => continue,
            };
            if let Some(color) = links.into_iter().find_map(|link| self.color(link, n_links + 1)) {
                return Some(color);
            }
        }
        None
    }

    fn rgb(&self, record: Record) -> Option<Color> {
        let [_, red, green, blue] = self.source.params(record).ok()?;
        let mut rgba = 0;
        for channel in [red, green, blue] {
            let level = channel.number().ok()?.clamp(0.0, 1.0);
            rgba = rgba << 8 | (level * 255.0).round() as u32;
        }
        Some(Color(rgba << 8 | 0xff))
    }

    fn pre_defined(&self, record: Record) -> Option<Color> {
        let [name] = self.source.params(record).ok()?;
        let name = name.text()?;
        PRE_DEFINED.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|&(_, rgba)| Color(rgba))
    }
}
