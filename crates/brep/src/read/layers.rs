//! Reads the layers to which faces, shells and solids are assigned.

use super::file::{StepFile, name_of};
use super::styles::styled_item;
use crate::part21::{Keyword, Record};
use std::collections::BTreeMap;

/// The layer of each item that a `PRESENTATION_LAYER_ASSIGNMENT` lists.
#[derive(Debug, Default)]
pub(super) struct Layers {
    /// The layer of each item. The first assignment in the file counts.
    by_item: BTreeMap<u64, String>,
}

impl Layers {
    /// The layer to which this item itself is assigned.
    pub(super) fn of(&self, item: u64) -> Option<&str> {
        self.by_item.get(&item).map(String::as_str)
    }

    /// Reads every assignment of the file. If a styled item is assigned, the item that it styles gets the layer.
    pub(super) fn read(source: &StepFile<'_>) -> Self {
        let mut layers = Self::default();
        for &record in source.exchange.records() {
            if record.keyword == Keyword::PresentationLayerAssignment {
                layers.add(source, record);
            }
        }
        layers
    }

    fn add(&mut self, source: &StepFile<'_>, record: Record) -> Option<()> {
        let [name, _, items] = source.params(record).ok()?;
        let name = name_of(name)?;
        for item in items.list().ok()?.references().ok()? {
            let styled = source
                .record(item)
                .ok()
                .and_then(|record| styled_by(source, record));
            self.by_item
                .entry(styled.unwrap_or(item))
                .or_insert_with(|| name.clone());
        }
        Some(())
    }
}

fn styled_by(source: &StepFile<'_>, record: Record) -> Option<u64> {
    styled_item(source, record)?.item.reference().ok()
}
