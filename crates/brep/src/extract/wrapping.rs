//! Writes the entities around an extract that readers need to find it: shells, a surface model, a representation with the units
//! of the original file, and a product without a name.

use super::Writer;
use super::kinds::{Kind, kind, lists_shapes, representation};
use super::references::References;
use crate::part21::{Exchange, Keyword, Record};
use std::collections::{BTreeMap, BTreeSet};

/// The largest number of faces that are shown for one entity that they use.
const MOST_USERS: usize = 8;

/// The instances that new representations must list, by context.
#[derive(Debug, Default)]
pub(super) struct Content {
    /// The items, shells and faces of each context. The key is `None` if the large file has no context for them.
    pub(super) listed: BTreeMap<Option<u64>, Vec<u64>>,
    /// The number of faces that use the requested entities and are not shown.
    pub(super) n_left_out: usize,
}

impl Content {
    /// Finds the instances that show each of the entities.
    pub(super) fn of(exchange: &Exchange<'_>, references: &References, ids: &[u64]) -> Self {
        let mut content = Self::default();
        for slot in ids.iter().filter_map(|&id| exchange.slot(id)) {
            let shown = content.shown(exchange, references, slot);
            let Some(&first) = shown.first() else {
                continue;
            };
            let context = context_of(exchange, references, first);
            let listed = content.listed.entry(context).or_default();
            for id in shown.into_iter().map(|slot| exchange.records()[slot].id) {
                if !listed.contains(&id) {
                    listed.push(id);
                }
            }
        }
        content
    }

    /// The instances that show an entity: the highest instances with faces among those to which it refers, or else the faces that
    /// use it. The list is empty if the entity refers to a representation that lists shapes.
    fn shown(
        &mut self,
        exchange: &Exchange<'_>,
        references: &References,
        slot: usize,
    ) -> Vec<usize> {
        let kind_of = |slot: usize| kind(exchange, exchange.records()[slot]);
        let own = kind_of(slot);
        if own != Kind::Other {
            return vec![slot];
        }
        let below = references.closure([slot]);
        if below.iter().any(|&slot| is_listing(exchange, slot)) {
            return Vec::new();
        }
        let of = |fits: fn(Kind) -> bool| {
            below
                .iter()
                .copied()
                .filter(|&slot| fits(kind_of(slot)))
                .collect::<Vec<_>>()
        };
        let highest = [
            of(Kind::is_item),
            of(Kind::is_shell),
            of(|kind| kind == Kind::Face),
        ];
        if let Some(highest) = highest.into_iter().find(|found| !found.is_empty()) {
            return highest;
        }
        let users = references.all_users(slot, |user| kind_of(user) != Kind::Other);
        let (mut faces, items): (Vec<usize>, Vec<usize>) = users
            .into_iter()
            .filter(|&user| kind_of(user) != Kind::Other)
            .partition(|&user| kind_of(user) == Kind::Face);
        if faces.is_empty() {
            return items.into_iter().take(1).collect();
        }
        self.n_left_out += faces.len().saturating_sub(MOST_USERS);
        faces.truncate(MOST_USERS);
        faces
    }
}

fn is_listing(exchange: &Exchange<'_>, slot: usize) -> bool {
    representation(exchange, exchange.records()[slot])
        .is_some_and(|(items, _)| lists_shapes(exchange, items))
}

/// The context of the nearest representation that lists an instance, or else the first context of the file.
fn context_of(exchange: &Exchange<'_>, references: &References, slot: usize) -> Option<u64> {
    let users = references.all_users(slot, |user| is_listing(exchange, user));
    let context = |slot: usize| {
        let (items, context) = representation(exchange, exchange.records()[slot])?;
        (lists_shapes(exchange, items) && exchange.slot(context).is_some()).then_some(context)
    };
    users.into_iter().find_map(context).or_else(|| {
        let mut records: Vec<_> = exchange
            .records()
            .iter()
            .filter(|record| record.keyword == Keyword::Complex)
            .collect();
        records.sort_by_key(|record| record.at);
        let assigns_units = |record: &&&Record| {
            exchange
                .partial(***record, "GLOBAL_UNIT_ASSIGNED_CONTEXT")
                .is_some()
        };
        records.iter().find(assigns_units).map(|record| record.id)
    })
}

/// Writes shells, models, representations and products around the kept instances.
pub(super) fn wrap(
    exchange: &Exchange<'_>,
    references: &References,
    listed: &BTreeMap<Option<u64>, Vec<u64>>,
    kept: &BTreeSet<u64>,
    text: &mut Writer,
) {
    let mut representations: Vec<u64> = listed
        .iter()
        .map(|(context, ids)| new_representation(exchange, *context, ids, text))
        .collect();
    // A requested representation that no product of the extract uses.
    let slots: Vec<usize> = kept.iter().filter_map(|&id| exchange.slot(id)).collect();
    let is_used = |slot: usize| {
        references
            .users(slot)
            .any(|user| kept.contains(&exchange.records()[user].id))
    };
    let bare = slots
        .into_iter()
        .filter(|&slot| is_listing(exchange, slot) && !is_used(slot));
    representations.extend(bare.map(|slot| text.number(exchange.records()[slot].id)));
    if representations.is_empty() {
        return;
    }
    let application = text.add("APPLICATION_CONTEXT('automotive design')");
    text.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
    ));
    let product_context = text.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
    let design = text.add(&format!(
        "PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"
    ));
    for representation in representations {
        let product = text.add(&format!("PRODUCT('part','part','',(#{product_context}))"));
        let formation = text.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let definition = text.add(&format!(
            "PRODUCT_DEFINITION('design','',#{formation},#{design})"
        ));
        let shape = text.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        text.add(&format!(
            "SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"
        ));
    }
}

/// Writes a representation of some items, shells and faces, and returns its number.
fn new_representation(
    exchange: &Exchange<'_>,
    context: Option<u64>,
    ids: &[u64],
    text: &mut Writer,
) -> u64 {
    let kind_of = |id: u64| {
        exchange
            .record(id)
            .map_or(Kind::Other, |record| kind(exchange, record))
    };
    let of = |fits: &dyn Fn(Kind) -> bool, text: &Writer| {
        ids.iter()
            .filter(|&&id| fits(kind_of(id)))
            .map(|&id| text.number(id))
            .collect::<Vec<u64>>()
    };
    let mut items = of(&Kind::is_item, text);
    let mut kinds: BTreeSet<Kind> = ids
        .iter()
        .map(|&id| kind_of(id))
        .filter(|kind| kind.is_item())
        .collect();
    let mut shells = of(&|kind| kind == Kind::Shell, text);
    let faces = of(&|kind| kind == Kind::Face, text);
    if !faces.is_empty() {
        shells.push(text.add(&format!("OPEN_SHELL('',({}))", list(&faces))));
    }
    let face_sets = of(&|kind| kind == Kind::FaceSet, text);
    for (class, sets) in [
        ("SHELL_BASED_SURFACE_MODEL", shells),
        ("FACE_BASED_SURFACE_MODEL", face_sets),
    ] {
        if !sets.is_empty() {
            items.push(text.add(&format!("{class}('',({}))", list(&sets))));
            kinds.insert(Kind::SurfaceModel);
        }
    }
    let context = match context {
        Some(context) => text.number(context),
        None => text.add("(GEOMETRIC_REPRESENTATION_CONTEXT(3)REPRESENTATION_CONTEXT('',''))"),
    };
    let kinds: Vec<Kind> = kinds.into_iter().collect();
    let class = match kinds[..] {
        [Kind::Solid] => "ADVANCED_BREP_SHAPE_REPRESENTATION",
        [Kind::FacetedSolid] => "FACETED_BREP_SHAPE_REPRESENTATION",
        [Kind::SurfaceModel] => "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
        [Kind::GeometricSet] => "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION",
        _ => "SHAPE_REPRESENTATION",
    };
    text.add(&format!("{class}('',({}),#{context})", list(&items)))
}

fn list(numbers: &[u64]) -> String {
    numbers
        .iter()
        .map(|number| format!("#{number}"))
        .collect::<Vec<_>>()
        .join(",")
}
