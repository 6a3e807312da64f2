//! Reads the colors, with their transparency, that styles give to faces, shells, solids, mapped items and representations.

use super::file::StepFile;
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::Color;
use std::collections::{BTreeMap, BTreeSet};

/// The largest length of a chain of styles that refer to styles. The chain in the standard has six links.
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

/// The color of each item that a `STYLED_ITEM` styles.
#[derive(Debug, Default)]
pub(super) struct Colors {
    by_item: BTreeMap<u64, Color>,
}

impl Colors {
    /// The color of this item itself.
    pub(super) fn of(&self, item: u64) -> Option<Color> {
        self.by_item.get(&item).copied()
    }

    /// Reads every styled item of the file. Items without a surface color are left out.
    pub(super) fn read(source: &StepFile<'_>) -> Self {
        let mut search = StyleSearch {
            source,
            known: BTreeMap::new(),
        };
        let mut of_item: BTreeMap<u64, Vec<ItemStyle>> = BTreeMap::new();
        for &record in source.exchange.records() {
            let Some(StyledItem {
                styles,
                item,
                overrides,
            }) = styled_item(source, record)
            else {
                continue;
            };
            let (Ok(item), Ok(styles)) = (item.reference(), styles.list()) else {
                continue;
            };
            if let Some(color) = search
                .first_look(styles.references().unwrap_or_default(), 0)
                .rgba()
            {
                of_item.entry(item).or_default().push(ItemStyle {
                    id: record.id,
                    color,
                    overrides,
                });
            }
        }
        Self {
            by_item: of_item
                .into_iter()
                .filter_map(|(item, styled)| Some((item, strongest(&styled)?)))
                .collect(),
        }
    }
}

/// The attributes of a styled item, from a plain or complex instance.
pub(super) struct StyledItem<'a> {
    styles: Param<'a>,
    pub(super) item: Param<'a>,
    /// The style that this one overrides, if it is an `OVER_RIDING_STYLED_ITEM`.
    overrides: Option<u64>,
}

/// Reads a styled item. Returns `None` for any other entity, and for a style that applies in one context only.
pub(super) fn styled_item<'a>(source: &StepFile<'a>, record: Record) -> Option<StyledItem<'a>> {
    match record.keyword {
        Keyword::StyledItem => {
            let [_, styles, item] = source.params(record).ok()?;
            Some(StyledItem {
                styles,
                item,
                overrides: None,
            })
        }
        Keyword::OverRidingStyledItem => {
            let [_, styles, item] = source.params(record).ok()?;
            let overridden = source
                .class_params(record, "", 3)
                .ok()
                .and_then(|rest| rest.first::<1>().ok());
            // If no overridden style is named, the number 0 is used, which is no instance.
            let overrides = overridden
                .and_then(|[style]| style.reference().ok())
                .unwrap_or(0);
            Some(StyledItem {
                styles,
                item,
                overrides: Some(overrides),
            })
        }
        Keyword::Complex if !source.is_spline_or_context(record) => {
            let partial = |name| source.exchange.partial(record, name);
            let [styles, item] = partial("STYLED_ITEM")?.first().ok()?;
            if partial("CONTEXT_DEPENDENT_OVER_RIDING_STYLED_ITEM").is_some() {
                return None;
            }
            let overriding = partial("OVER_RIDING_STYLED_ITEM");
            let overridden = |part: crate::part21::Params<'a>| {
                let style = part
                    .first::<1>()
                    .ok()
                    .and_then(|[style]| style.reference().ok());
                style.unwrap_or(0)
            };
            Some(StyledItem {
                styles,
                item,
                overrides: overriding.map(overridden),
            })
        }
        _ => None,
    }
}

/// One of the styles of an item.
struct ItemStyle {
    id: u64,
    color: Color,
    overrides: Option<u64>,
}

/// The color that applies. Styles that no other style of the same item overrides are preferred. Among them, an overriding style
/// is preferred to a plain one. If several remain, the first one in the file counts.
fn strongest(styles: &[ItemStyle]) -> Option<Color> {
    let overridden: BTreeSet<u64> = styles.iter().filter_map(|style| style.overrides).collect();
    let holds = |style: &&ItemStyle| !overridden.contains(&style.id);
    let overriding = |style: &&ItemStyle| style.overrides.is_some();
    let held = || styles.iter().filter(holds);
    held()
        .find(overriding)
        .or_else(|| held().next())
        .or(styles.first())
        .map(|style| style.color)
}

/// The color and the transparency that a style gives to a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Look {
    color: Option<Color>,
    /// From 0 (opaque) to 1 (fully transparent).
    transparency: Option<f64>,
}

impl Look {
    /// The color, with the opacity in its last byte. The number 0 is avoided, because it means that there is no color.
    fn rgba(self) -> Option<Color> {
        let Color(rgba) = self.color?;
        let opacity = 1.0 - self.transparency.unwrap_or(0.0).clamp(0.0, 1.0);
        let rgba = rgba & 0xffff_ff00 | (255.0 * opacity).round() as u32;
        Some(Color(rgba.max(1)))
    }

    /// The values of this look, completed by those of the other one.
    fn or(self, other: Self) -> Self {
        Self {
            color: self.color.or(other.color),
            transparency: self.transparency.or(other.transparency),
        }
    }
}

/// A search for the look of a style. It remembers its results.
struct StyleSearch<'s, 'a> {
    source: &'s StepFile<'a>,
    known: BTreeMap<u64, Look>,
}

impl StyleSearch<'_, '_> {
    /// The first color and the first transparency that these styles lead to.
    fn first_look(&mut self, styles: Vec<u64>, n_links: u32) -> Look {
        styles.into_iter().fold(Look::default(), |look, style| {
            look.or(self.look(style, n_links))
        })
    }

    fn look(&mut self, id: u64, n_links: u32) -> Look {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        // If a style refers back to itself, the search finds nothing there.
        self.known.insert(id, Look::default());
        let Ok(record) = self.source.record(id) else {
            return Look::default();
        };
        let look = match record.keyword {
            _ if n_links > MAX_CHAIN => Look::default(),
            Keyword::ColorRgb => Look {
                color: self.rgb(record),
                transparency: None,
            },
            Keyword::DraughtingPreDefinedColor | Keyword::PreDefinedColor => Look {
                color: self.pre_defined(record),
                transparency: None,
            },
            Keyword::SurfaceStyleTransparent => Look {
                color: None,
                transparency: self.transparency(record),
            },
            Keyword::PresentationStyleAssignment
            | Keyword::PresentationStyleByContext
            | Keyword::SurfaceStyleUsage
            | Keyword::SurfaceSideStyle
            | Keyword::SurfaceStyleFillArea
            | Keyword::SurfaceStyleRendering
            | Keyword::SurfaceStyleRenderingWithProperties
            | Keyword::FillAreaStyle
            | Keyword::FillAreaStyleColor => self.look_of_links(record, n_links),
            _ => Look::default(),
        };
        self.known.insert(id, look);
        look
    }

    fn look_of_links(&mut self, record: Record, n_links: u32) -> Look {
        let mut look = Look::default();
        for param in self.source.exchange.params(record).iter() {
            let links = match param {
                Ok(Param::Reference(id)) => vec![id],
                Ok(Param::List(list)) => list.references().unwrap_or_default(),
                Ok(_) => continue,
                Err(_) => break,
            };
            look = look.or(self.first_look(links, n_links + 1));
        }
        look
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
        PRE_DEFINED
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(name))
            .map(|&(_, rgba)| Color(rgba))
    }

    fn transparency(&self, record: Record) -> Option<f64> {
        let [transparency] = self.source.params(record).ok()?;
        transparency.number().ok()
    }
}
