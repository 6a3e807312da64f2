//! In which units and where in its assembly each root stands.
//!
//! A product is placed once, at its first occurrence in file order.

use super::assembly::Assembly;
use super::contexts::Contexts;
use super::representation::representations;
use super::roots::Root;
use super::source::Source;
use super::space::{Motion, Space};
use crate::model::{Component, Loss};
use crate::part21::Keyword;
use carrier::{Instance, Units};
use std::collections::BTreeMap;

/// The representations of a file, and what they say of the roots in them.
pub(super) struct Representations<'s, 'a> {
    source: &'s Source<'a>,
    /// The representation of each root: of those that list it, the first that stands in an assembly.
    of_root: BTreeMap<u64, u64>,
    contexts: Contexts<'s, 'a>,
    assembly: Assembly,
    /// The index of the component of each coordinate system; roots without one share the system 0.
    component_of: BTreeMap<u64, u32>,
    components: Vec<Component>,
}

impl<'s, 'a> Representations<'s, 'a> {
    /// Reads contexts, relationships and occurrences.
    pub(super) fn read(source: &'s Source<'a>, roots: &[Root]) -> Self {
        let mut all_of_root: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        let mut mapped_in = Vec::new();
        let is_root: BTreeMap<u64, ()> = roots.iter().map(|root| (root.record.id, ())).collect();
        let mut drawn_in = Vec::new();
        for representation in representations(source) {
            let id = representation.record.id;
            for item in representation.items.iter().filter_map(|item| item.ok()?.reference().ok()) {
                let is_mapped =
                    source.exchange.record(item).is_some_and(|record| record.keyword == Keyword::MappedItem);
                if !is_mapped && !is_root.contains_key(&item) {
                    continue;
                }
                match (representation.is_drawn(source), is_mapped) {
                    (true, true) => {}
                    (true, false) => drawn_in.push((item, id)),
                    (false, true) => mapped_in.push((item, id)),
                    (false, false) => all_of_root.entry(item).or_default().push(id),
                }
            }
        }
        // A drawing says where a root stands only where nothing else does.
        for (root, representation) in drawn_in {
            all_of_root.entry(root).or_default().push(representation);
        }
        let mut contexts = Contexts::new(source);
        // What names no context is read in the units of the first root that does.
        let first = roots.iter().find_map(|root| all_of_root.get(&root.record.id)?.first().copied());
        contexts.units(first);
        contexts.ensure_units();
        let assembly = Assembly::read(source, &mut contexts, &mapped_in);
        let of_root = all_of_root.into_iter().filter_map(|(root, all)| Some((root, assembly.most_placed(&all)?)));
        let of_root = of_root.collect();
        Self { source, of_root, contexts, assembly, component_of: BTreeMap::new(), components: Vec::new() }
    }

    /// The units of a root.
    pub(super) fn units(&mut self, root: u64) -> Units {
        self.contexts.units(self.of_root.get(&root).copied())
    }

    /// Units and placement of a root.
    pub(super) fn space(&mut self, root: u64) -> Space {
        let Units { mm_per_unit, rad_per_unit, .. } = self.units(root);
        let motion = self.of_root.get(&root).and_then(|&representation| self.assembly.motion(representation));
        Space { mm_per_unit, rad_per_unit, motion }
    }

    /// The name of the product that a root belongs to.
    pub(super) fn product_name(&self, root: u64) -> Option<String> {
        self.assembly.product_name(self.source, *self.of_root.get(&root)?)
    }

    /// The index of the component that a root belongs to.
    pub(super) fn component(&mut self, root: u64) -> u32 {
        let representation = self.of_root.get(&root).copied();
        let system = representation.map_or(0, |representation| self.assembly.system(representation));
        if let Some(&known) = self.component_of.get(&system) {
            return known;
        }
        let index = self.components.len() as u32;
        self.component_of.insert(system, index);
        let occurrences = self.occurrences(representation);
        self.components.push(Component { occurrences });
        index
    }

    /// The components, in the order in which they were asked for.
    pub(super) fn components(&mut self) -> Vec<Component> {
        std::mem::take(&mut self.components)
    }

    /// Where a representation stands; one that stands nowhere, or in itself, stands as it is written.
    fn occurrences(&mut self, representation: Option<u64>) -> Vec<Instance> {
        let found = representation.map(|representation| self.assembly.occurrences(representation)).unwrap_or_default();
        let product = representation.and_then(|representation| self.assembly.product_name(self.source, representation));
        let found = if found.is_empty() { vec![(Vec::new(), Motion::IDENTITY)] } else { found };
        let instance = |(path, motion): (Vec<u64>, Motion)| {
            let names = path.iter().map(|&system| self.name_on_path(system)).collect::<Vec<_>>();
            // A placement with infinite coordinates has no matrix that a file could keep.
            let transform = Some(motion.matrix()).filter(|rows| rows.iter().flatten().all(|cell| cell.is_finite()));
            let transform = transform.unwrap_or_else(|| Motion::IDENTITY.matrix());
            Instance { path: names.join("/"), product: product.clone(), transform }
        };
        found.into_iter().map(instance).collect()
    }

    /// A product's name as a component of a path; what has none is named by its number.
    fn name_on_path(&self, system: u64) -> String {
        let name = self.assembly.product_name(self.source, system);
        name.map_or_else(|| format!("#{system}"), |name| name.replace('/', "_"))
    }

    /// What is assumed for want of units in the file.
    pub(super) fn assumption(&self) -> Option<Loss> {
        self.contexts.assumption()
    }

    /// Contexts and occurrences that could not be read.
    pub(super) fn into_lost(self) -> Vec<Loss> {
        let mut lost = self.contexts.into_lost();
        lost.append(&mut self.assembly.into_lost());
        lost
    }
}
