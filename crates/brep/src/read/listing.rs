//! Separates the items that the representations of a file list as the shape of a product from the others: supplemental geometry,
//! presentation, and items that no representation lists.

use super::file::StepFile;
use super::representation::{is_drawn, representations};
use super::roots::{Root, RootKind, bare_kind, root_kind};
use crate::model::Note;
use crate::part21::{Keyword, Record, full_name};
use std::collections::{BTreeMap, BTreeSet};

/// The shapes of a file, and notes about items that are not shapes.
pub(super) struct Shapes {
    /// The roots in file order: first bodies of faces, then items without a body in a representation, and then tessellated
    /// bodies.
    pub(super) roots: Vec<Root>,
    /// The items that were left out, and the reasons.
    pub(super) notes: Vec<Note>,
}

/// The reasons why an item is not part of a shape.
const SUPPLEMENTAL: &str =
    "it is supplemental geometry and no shape of the part, so its faces are left out";
const PRESENTATION: &str = "only a presentation lists it, so its faces are left out";
const UNLISTED: &str = "no representation lists it, so its faces are left out";

/// Separates the bodies of a file into shapes and other items.
///
/// If nothing is listed as a shape, or if entities of the file are damaged (`is_damaged`), then items that are not listed count
/// as shapes, and so do items that only a drawing lists. The file has no better information.
pub(super) fn shapes(source: &StepFile<'_>, candidates: Vec<Root>, is_damaged: bool) -> Shapes {
    let listing = Listing::read(source);
    let is_listed =
        |root: &Root| listing.listed.get(&root.record.id) == Some(&ListingKind::AsShape);
    let counts_unlisted =
        is_damaged || (listing.bare.is_empty() && !candidates.iter().any(is_listed));
    let mut shapes = Shapes {
        roots: Vec::new(),
        notes: Vec::new(),
    };
    for root in candidates {
        let reason = match listing.listed.get(&root.record.id) {
            Some(ListingKind::AsShape) => None,
            Some(ListingKind::Beside(PRESENTATION)) if counts_unlisted => None,
            Some(ListingKind::Beside(reason)) => Some(*reason),
            None => (!counts_unlisted).then_some(UNLISTED),
        };
        match reason {
            None => shapes.roots.push(root),
            Some(reason) => shapes.notes.push(Note {
                step_id: root.record.id,
                text: reason.to_owned(),
            }),
        }
    }
    shapes.roots.extend(listing.bare);
    // The sort is stable, so the order within each group does not change.
    shapes.roots.sort_by_key(|root| match root.kind {
        RootKind::Bare => 1,
        RootKind::Tessellated | RootKind::BareFacets => 2,
        _ => 0,
    });
    shapes
}

/// How an item is listed. An item that is listed as a shape and also in another way is a shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ListingKind {
    AsShape,
    Beside(&'static str),
}

/// The items of all representations that are bodies, or faces and shells without a body.
struct Listing {
    listed: BTreeMap<u64, ListingKind>,
    bare: Vec<Root>,
}

impl Listing {
    fn read(source: &StepFile<'_>) -> Self {
        let supplemental = supplemental(source);
        let mut listing = Self {
            listed: BTreeMap::new(),
            bare: Vec::new(),
        };
        for listed in representations(source) {
            let representation = listed.record;
            let items = listed
                .items
                .iter()
                .filter_map(|item| source.exchange.record(item.ok()?.reference().ok()?));
            let items: Vec<(Record, RootKind)> = items
                .filter_map(|item| Some((item, item_kind(source, item)?)))
                .collect();
            if items.is_empty() {
                continue;
            }
            let how = match reason_not_a_shape(source, representation) {
                _ if supplemental.contains(&representation.id) => ListingKind::Beside(SUPPLEMENTAL),
                Some(reason) => ListingKind::Beside(reason),
                None => ListingKind::AsShape,
            };
            listing.add(representation, &items, how);
        }
        listing.bare.sort_by_key(|root| root.record.at);
        listing
    }

    fn add(&mut self, representation: Record, items: &[(Record, RootKind)], how: ListingKind) {
        let mut bare = BTreeSet::new();
        for &(item, kind) in items {
            if matches!(kind, RootKind::Bare | RootKind::BareFacets) {
                bare.insert(kind);
                continue;
            }
            let known = self.listed.entry(item.id).or_insert(how);
            if how == ListingKind::AsShape {
                *known = how;
            }
        }
        if how == ListingKind::AsShape {
            self.bare.extend(bare.into_iter().map(|kind| Root {
                record: representation,
                kind,
            }));
        }
    }
}

/// The kind of an item of a representation. Returns `None` if it is neither a body nor an item without a body.
fn item_kind(source: &StepFile<'_>, item: Record) -> Option<RootKind> {
    if item.keyword == Keyword::Complex && source.is_spline_or_context(item) {
        return None;
    }
    root_kind(source, item).or_else(|| bare_kind(source, item))
}

/// The representations that a relationship declares to be supplemental geometry of another one.
fn supplemental(source: &StepFile<'_>) -> BTreeSet<u64> {
    let related = source.exchange.records().iter().filter_map(|&record| {
        let params = match record.keyword {
            Keyword::ConstructiveGeometryRepresentationRelationship => {
                source.exchange.params(record)
            }
            Keyword::Complex if !source.is_spline_or_context(record) => {
                source
                    .exchange
                    .partial(record, "CONSTRUCTIVE_GEOMETRY_REPRESENTATION_RELATIONSHIP")?;
                source
                    .exchange
                    .partial(record, "REPRESENTATION_RELATIONSHIP")?
            }
            _ => return None,
        };
        let [_, _, first, second] = params.first().ok()?;
        let (first, second) = (first.reference().ok()?, second.reference().ok()?);
        // Some writers exchange the two representations. The class decides, or else the second one is supplemental.
        let is_named = |id| {
            source
                .exchange
                .record(id)
                .is_some_and(|record| reason_not_a_shape(source, record) == Some(SUPPLEMENTAL))
        };
        Some(if is_named(first) && !is_named(second) {
            first
        } else {
            second
        })
    });
    related.collect()
}

/// The reason why the items of a representation of this class are not a shape. Returns `None` if they are a shape.
fn reason_not_a_shape(source: &StepFile<'_>, representation: Record) -> Option<&'static str> {
    let is_supplemental = source.exchange.partials(representation).any(|(class, _)| {
        let class = full_name(class).to_ascii_uppercase();
        let contains = |name: &[u8]| class.windows(name.len()).any(|window| window == name);
        contains(b"CONSTRUCTIVE_GEOMETRY") || contains(b"SUPPLEMENTAL_GEOMETRY")
    });
    if is_supplemental {
        return Some(SUPPLEMENTAL);
    }
    is_drawn(source, representation).then_some(PRESENTATION)
}
