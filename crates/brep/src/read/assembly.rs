//! The assembly tree: which representation stands in which, and by what motion.

use super::contexts::Contexts;
use super::error::EntityError;
use super::file::{StepFile, name_of};
use super::representation::representation_of;
use super::space::{Motion, Reader, Space};
use crate::model::{LostEntity, LostKind};
use crate::part21::{Keyword, Param, Record};
use partprobe_shape::Units;
use std::collections::{BTreeMap, BTreeSet};

/// Where representations stand in each other.
///
/// Representations that a relationship without a transformation joins share one coordinate system, which is
/// named by the lowest `#` number among them.
#[derive(Default)]
pub(super) struct Assembly {
    system_of: BTreeMap<u64, u64>,
    /// The occurrences of each system in others, in file order.
    placed: BTreeMap<u64, Vec<Placing>>,
    /// The product definition that each system is the shape of.
    definition_of: BTreeMap<u64, u64>,
    lost: Vec<LostEntity>,
}

/// More occurrences of one product than this are counted and not listed: nested assemblies multiply.
const MAX_OCCURRENCES: usize = 100_000;
/// An assembly may be nested so deep; real ones stop at a dozen.
const MAX_DEPTH: usize = 64;

/// An occurrence of one representation in another.
struct Placing {
    /// The `MAPPED_ITEM` or the relationship.
    item: u64,
    at: u32,
    parent: u64,
    motion: Motion,
}

/// One path from a representation to a root of its assembly.
pub(super) struct Occurrence {
    /// The systems on it, from the root down.
    pub(super) systems: Vec<u64>,
    /// The mapped items and relationships on it, from the shape up.
    pub(super) items: Vec<u64>,
    /// The motion along it.
    pub(super) motion: Motion,
}

/// A relationship between two representations, as the file has it.
struct Relationship<'a> {
    record: Record,
    first: u64,
    second: u64,
    transformation: Option<Param<'a>>,
}

impl Assembly {
    /// Reads all relationships, product definitions and mapped items of the file.
    ///
    /// `mapped_in` holds each mapped item with the representation that lists it.
    pub(super) fn read(
        source: &StepFile<'_>,
        contexts: &mut Contexts<'_, '_>,
        mapped_in: &[(u64, u64)],
    ) -> Self {
        let mut assembly = Self::default();
        let relationships = relationships(source);
        assembly.join_systems(&relationships);
        assembly.read_definitions(source);
        let children = assembly.occurrence_systems(source);
        for relationship in &relationships {
            let Some(transformation) = relationship.transformation else {
                continue;
            };
            let child = children.get(&relationship.record.id).copied();
            assembly.add_relationship(source, contexts, relationship, transformation, child);
        }
        for &(item, parent) in mapped_in {
            assembly.add_mapped_item(source, contexts, item, parent);
        }
        assembly
            .placed
            .values_mut()
            .for_each(|placings| placings.sort_by_key(|placing| placing.at));
        assembly
    }

    /// Of representations that list one item, the first that stands in another, or else that is a product's shape;
    /// exporters list a solid again where they attach a property to it.
    pub(super) fn most_placed(&self, representations: &[u64]) -> Option<u64> {
        let is_placed =
            |&&representation: &&u64| self.placed.contains_key(&self.system(representation));
        let is_product = |&&representation: &&u64| {
            self.definition_of
                .contains_key(&self.system(representation))
        };
        let all = || representations.iter();
        all()
            .find(is_placed)
            .or_else(|| all().find(is_product))
            .or(representations.first())
            .copied()
    }

    /// The motion from a representation to the root of its assembly; none where it stands as it is written.
    pub(super) fn motion(&mut self, representation: u64) -> Option<Motion> {
        let mut system = self.system(representation);
        let mut total: Option<Motion> = None;
        let mut seen = BTreeSet::from([system]);
        while let Some(placing) = self
            .placed
            .get(&system)
            .and_then(|placings| placings.first())
        {
            system = placing.parent;
            total = Some(total.map_or(placing.motion, |inner| placing.motion.after(&inner)));
            if !seen.insert(system) {
                let reason =
                    "the assembly contains itself, its shapes are left unplaced".to_owned();
                self.lost.push(LostEntity {
                    kind: LostKind::Entity,
                    step_id: system,
                    reason,
                });
                return None;
            }
        }
        total.filter(|motion| *motion != Motion::IDENTITY)
    }

    /// Every path from a representation to a root of its assembly, the first occurrence first.
    pub(super) fn occurrences(&mut self, representation: u64) -> Vec<Occurrence> {
        let mut found = Vec::new();
        let mut open = vec![(
            vec![self.system(representation)],
            Vec::new(),
            Motion::IDENTITY,
        )];
        while let Some((path, items, motion)) = open.pop() {
            let system = path[path.len() - 1];
            let placings = self.placed.get(&system).map_or(&[][..], Vec::as_slice);
            if placings.is_empty() {
                found.push(Occurrence {
                    systems: path.into_iter().rev().collect(),
                    items,
                    motion,
                });
                continue;
            }
            if found.len() + open.len() + placings.len() > MAX_OCCURRENCES || path.len() > MAX_DEPTH
            {
                let reason = format!(
                    "it has more than {MAX_OCCURRENCES} occurrences, or is nested too deep"
                );
                self.lost.push(LostEntity {
                    kind: LostKind::Entity,
                    step_id: system,
                    reason,
                });
                break;
            }
            // The last one that is pushed is taken first.
            for placing in placings
                .iter()
                .rev()
                .filter(|placing| !path.contains(&placing.parent))
            {
                let path = path.iter().copied().chain([placing.parent]).collect();
                let items = items.iter().copied().chain([placing.item]).collect();
                open.push((path, items, placing.motion.after(&motion)));
            }
        }
        found
    }

    /// The name of the product that a representation is the shape of.
    pub(super) fn product_name(
        &self,
        source: &StepFile<'_>,
        representation: u64,
    ) -> Option<String> {
        let definition = source
            .record(*self.definition_of.get(&self.system(representation))?)
            .ok()?;
        let [_, _, formation] = source.params(definition).ok()?;
        let formation = source.record(formation.reference().ok()?).ok()?;
        let [_, _, product] = source.params(formation).ok()?;
        let product = source.record(product.reference().ok()?).ok()?;
        let [id, name] = source.params(product).ok()?;
        name_of(name).or_else(|| name_of(id))
    }

    /// The product definition that a coordinate system is the shape of.
    pub(super) fn definition(&self, system: u64) -> Option<u64> {
        self.definition_of.get(&system).copied()
    }

    /// Whether a coordinate system stands in another one.
    pub(super) fn is_placed(&self, system: u64) -> bool {
        self.placed.contains_key(&system)
    }

    /// Occurrences that could not be read.
    pub(super) fn into_lost(self) -> Vec<LostEntity> {
        self.lost
    }

    /// The number that names the coordinate system of a representation.
    pub(super) fn system(&self, representation: u64) -> u64 {
        self.system_of
            .get(&representation)
            .copied()
            .unwrap_or(representation)
    }

    /// Walks the relationships without transformation, each connected set from its lowest number.
    fn join_systems(&mut self, relationships: &[Relationship<'_>]) {
        let mut neighbors: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        for joint in relationships
            .iter()
            .filter(|relationship| relationship.transformation.is_none())
        {
            neighbors.entry(joint.first).or_default().push(joint.second);
            neighbors.entry(joint.second).or_default().push(joint.first);
        }
        for &lowest in neighbors.keys() {
            let mut open = vec![lowest];
            while let Some(representation) = open.pop() {
                if self.system_of.contains_key(&representation) {
                    continue;
                }
                self.system_of.insert(representation, lowest);
                open.extend(neighbors.get(&representation).into_iter().flatten());
            }
        }
    }

    /// Notes the product definition behind each `SHAPE_DEFINITION_REPRESENTATION`.
    fn read_definitions(&mut self, source: &StepFile<'_>) {
        for &record in source.exchange.records() {
            if record.keyword != Keyword::ShapeDefinitionRepresentation {
                continue;
            }
            let Ok([definition, representation]) = source.params(record) else {
                continue;
            };
            let (Ok(shape), Ok(representation)) =
                (definition.reference(), representation.reference())
            else {
                continue;
            };
            if let Some(definition) = defined_by_shape(source, shape) {
                self.definition_of
                    .entry(self.system(representation))
                    .or_insert(definition);
            }
        }
    }

    /// The coordinate system of the component that each relationship places, by the relationship's number.
    fn occurrence_systems(&self, source: &StepFile<'_>) -> BTreeMap<u64, u64> {
        let system_of_definition: BTreeMap<u64, u64> = self
            .definition_of
            .iter()
            .rev()
            .map(|(&system, &definition)| (definition, system))
            .collect();
        let occurrences = source.exchange.records().iter().filter_map(|&record| {
            if record.keyword != Keyword::ContextDependentShapeRepresentation {
                return None;
            }
            let [relation, shape] = source.params(record).ok()?;
            let occurrence = source
                .record(defined_by_shape(source, shape.reference().ok()?)?)
                .ok()?;
            let [_, _, _, _, component] = source.params(occurrence).ok()?;
            let system = system_of_definition.get(&component.reference().ok()?)?;
            Some((relation.reference().ok()?, *system))
        });
        occurrences.collect()
    }

    fn add_relationship(
        &mut self,
        source: &StepFile<'_>,
        contexts: &mut Contexts<'_, '_>,
        relationship: &Relationship<'_>,
        transformation: Param<'_>,
        child: Option<u64>,
    ) {
        let Relationship {
            record,
            first,
            second,
            ..
        } = *relationship;
        let units = [contexts.units(Some(first)), contexts.units(Some(second))];
        let motion = transformation
            .reference()
            .map_err(EntityError::from)
            .and_then(|transformation| {
                item_transformation(source, transformation, [first, second], units)
            });
        let motion = match motion {
            Ok(motion) => motion,
            Err(error) => return self.lose(record.id, &error),
        };
        // The first representation is the component's, unless the occurrence says otherwise.
        let (first, second) = (self.system(first), self.system(second));
        if child == Some(second) && child != Some(first) {
            self.place(
                second,
                Placing {
                    item: record.id,
                    at: record.at,
                    parent: first,
                    motion: motion.inverse(),
                },
            );
        } else {
            self.place(
                first,
                Placing {
                    item: record.id,
                    at: record.at,
                    parent: second,
                    motion,
                },
            );
        }
    }

    fn add_mapped_item(
        &mut self,
        source: &StepFile<'_>,
        contexts: &mut Contexts<'_, '_>,
        item: u64,
        parent: u64,
    ) {
        match mapped_item(source, contexts, item, parent) {
            Ok((at, child, motion)) => {
                let (child, parent) = (self.system(child), self.system(parent));
                self.place(
                    child,
                    Placing {
                        item,
                        at,
                        parent,
                        motion,
                    },
                );
            }
            Err(error) => self.lose(item, &error),
        }
    }

    fn place(&mut self, child: u64, placing: Placing) {
        if child != placing.parent {
            self.placed.entry(child).or_default().push(placing);
        }
    }

    fn lose(&mut self, step_id: u64, error: &EntityError) {
        let reason = format!("it places nothing: {}", error.reason(step_id));
        self.lost.push(LostEntity {
            kind: LostKind::Entity,
            step_id,
            reason,
        });
    }
}

fn relationships<'a>(source: &StepFile<'a>) -> Vec<Relationship<'a>> {
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

/// What a `PRODUCT_DEFINITION_SHAPE` is the shape of: a product definition or an occurrence.
fn defined_by_shape(source: &StepFile<'_>, shape: u64) -> Option<u64> {
    let [_, _, definition] = source.params(source.record(shape).ok()?).ok()?;
    definition.reference().ok()
}

/// The motion from the first representation's coordinates to the second's.
///
/// Some exporters name the two axes in the other order; the representations that list them tell which is whose.
fn item_transformation(
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

/// Whether an item stands in the list of a representation.
fn lists(source: &StepFile<'_>, representation: u64, item: u64) -> bool {
    let items = || {
        let record = source.record(representation).ok()?;
        representation_of(source, record)?.items.references().ok()
    };
    items().is_some_and(|items| items.contains(&item))
}

/// Place in the file, mapped representation and motion of a `MAPPED_ITEM`.
fn mapped_item(
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
fn unplaced<'s, 'a>(source: &'s StepFile<'a>, units: &Units) -> Reader<'s, 'a> {
    let space = Space {
        mm_per_unit: units.mm_per_unit,
        rad_per_unit: units.rad_per_unit,
        motion: None,
    };
    Reader::new(source, space)
}
