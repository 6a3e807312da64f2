//! Reads the assembly tree: which representation contains which other one, and with which motion.

use super::contexts::Contexts;
use super::error::EntityError;
use super::file::{StepFile, name_of};
use super::relationships::{
    Relationship, defined_by_shape, item_transformation, mapped_item, relationships,
};
use super::space::Motion;
use crate::model::{LostEntity, LostKind};
use crate::part21::{Keyword, Param};
use std::collections::{BTreeMap, BTreeSet};

/// The positions of representations in one another.
///
/// Representations that are joined by a relationship without a transformation share one coordinate system. It is named by the
/// lowest `#` number among them.
#[derive(Default)]
pub(super) struct Assembly {
    system_of: BTreeMap<u64, u64>,
    /// The occurrences of each system in others, in file order.
    placed: BTreeMap<u64, Vec<Placing>>,
    /// The product definition whose shape each system is.
    definition_of: BTreeMap<u64, u64>,
    lost: Vec<LostEntity>,
}

/// The largest number of occurrences of one product that are listed. Further ones are only counted, because nested assemblies
/// multiply them.
const MAX_OCCURRENCES: usize = 100_000;
/// The largest depth of an assembly. Real assemblies have about a dozen levels at most.
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
    /// The systems on the path, from the root down.
    pub(super) systems: Vec<u64>,
    /// The mapped items and relationships on the path, from the shape up.
    pub(super) items: Vec<u64>,
    /// The motion along the path.
    pub(super) motion: Motion,
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

    /// Chooses one of the representations that list the same item: the first that is placed in another one, or else the first
    /// that is the shape of a product. Exporters list a solid again where they attach a property to it.
    pub(super) fn preferred_representation(&self, representations: &[u64]) -> Option<u64> {
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

    /// The motion from a representation to the root of its assembly. Returns `None` if its coordinates are those of the root.
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

    /// Every path from a representation to a root of its assembly. The first occurrence comes first.
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
            // The placing that is pushed last is taken first.
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

    /// The name of the product whose shape a representation is.
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

    /// The product definition whose shape a coordinate system is.
    pub(super) fn definition(&self, system: u64) -> Option<u64> {
        self.definition_of.get(&system).copied()
    }

    /// Whether a coordinate system is placed in another one.
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

    /// Joins the systems that are connected by relationships without a transformation. Each connected set gets its lowest number.
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

    /// Reads the product definition of each `SHAPE_DEFINITION_REPRESENTATION`.
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
        // The first representation is that of the component, unless the occurrence contradicts this.
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
