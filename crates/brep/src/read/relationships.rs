//! Reads the relationships between representations, and the items that place one representation in another.

use super::contexts::Contexts;
use super::error::EntityError;
use super::file::StepFile;
use super::representation::representation_of;
use super::space::{Motion, Reader, Space};
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::Units;

/// A relationship between two representations, as the file gives it.
pub(super) struct Relationship<'a> {
    pub(super) record: Record,
    pub(super) first: u64,
    pub(super) second: u64,
    pub(super) transformation: Option<Param<'a>>,
}

pub(super) fn relationships<'a>(source: &StepFile<'a>) -> Vec<Relationship<'a>> {
    let read = |&record: &Record| {
        let (params, transformation) = match record.keyword {
            Keyword::ShapeRepresentationRelationship => (source.exchange.params(record), None),
            Keyword::RelationshipWithTransformation => {
                let [_, _, _, _, transformation] = source.params(record).ok()?;
                (source.exchange.params(record), Some(transformation))
            }
            Keyword::Complex if !source.is_spline_or_context(record) => {
                let params = source
                    .exchange
                    .partial(record, "REPRESENTATION_RELATIONSHIP")?;
                let with = source
                    .exchange
                    .partial(record, "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION");
                (
                    params,
                    with.and_then(|with| with.first::<1>().ok())
                        .map(|[transformation]| transformation),
                )
            }
            _ => return None,
        };
        let [_, _, first, second] = params.first().ok()?;
        Some(Relationship {
            record,
            first: first.reference().ok()?,
            second: second.reference().ok()?,
            transformation,
        })
    };
    source.exchange.records().iter().filter_map(read).collect()
}

/// The product definition or the occurrence whose shape a `PRODUCT_DEFINITION_SHAPE` is.
pub(super) fn defined_by_shape(source: &StepFile<'_>, shape: u64) -> Option<u64> {
    let [_, _, definition] = source.params(source.record(shape).ok()?).ok()?;
    definition.reference().ok()
}

/// The motion from the first representation's coordinates to the second's.
///
/// Some exporters exchange the two axes. The representations that list the axes decide which axis belongs to which
/// representation.
pub(super) fn item_transformation(
    source: &StepFile<'_>,
    id: u64,
    [first, second]: [u64; 2],
    [first_units, second_units]: [Units; 2],
) -> Result<Motion, EntityError> {
    source.entity(id, |record| {
        if record.keyword != Keyword::ItemDefinedTransformation {
            return unplaced(source, &second_units).transformation_operator(record);
        }
        let [_, _, from, to] = source.params(record)?;
        let (from, to) = (from.reference()?, to.reference()?);
        let is_exchanged =
            lists(source, first, to) && lists(source, second, from) && !lists(source, first, from);
        let (from, to) = if is_exchanged { (to, from) } else { (from, to) };
        let from = unplaced(source, &first_units).frame(from)?;
        let to = unplaced(source, &second_units).frame(to)?;
        Ok(Motion::onto(&to).after(&Motion::onto(&from).inverse()))
    })
}

/// Whether a representation lists an item.
pub(super) fn lists(source: &StepFile<'_>, representation: u64, item: u64) -> bool {
    let items = || {
        let record = source.record(representation).ok()?;
        representation_of(source, record)?.items.references().ok()
    };
    items().is_some_and(|items| items.contains(&item))
}

/// The position in the file, the mapped representation and the motion of a `MAPPED_ITEM`.
pub(super) fn mapped_item(
    source: &StepFile<'_>,
    contexts: &mut Contexts<'_, '_>,
    item: u64,
    parent: u64,
) -> Result<(u32, u64, Motion), EntityError> {
    source.entity(item, |record| {
        let [_, map, target] = source.params(record)?;
        let (origin, child) = source.entity(map.reference()?, |map| {
            let [origin, child] = source.params(map)?;
            Ok((origin.reference()?, child.reference()?))
        })?;
        let from = unplaced(source, &contexts.units(Some(child))).frame(origin)?;
        let parent_units = contexts.units(Some(parent));
        let target = target.reference()?;
        let to = source.entity(target, |record| match record.keyword {
            Keyword::Axis2Placement3d => Ok(Motion::onto(
                &unplaced(source, &parent_units).frame(target)?,
            )),
            _ => unplaced(source, &parent_units).transformation_operator(record),
        })?;
        Ok((record.at, child, to.after(&Motion::onto(&from).inverse())))
    })
}

/// A reader in a representation's own coordinates.
pub(super) fn unplaced<'s, 'a>(source: &'s StepFile<'a>, units: &Units) -> Reader<'s, 'a> {
    let space = Space {
        mm_per_unit: units.mm_per_unit,
        rad_per_unit: units.rad_per_unit,
        motion: None,
    };
    Reader::new(source, space)
}
