//! Finds the units of each root, and its position in the assembly.
//!
//! A product is placed once, at its first occurrence in file order.

use super::assembly::{Assembly, Occurrence};
use super::contexts::Contexts;
use super::file::StepFile;
use super::layers::Layers;
use super::representation::{is_drawn, representations};
use super::roots::{Root, RootKind};
use super::space::{Motion, Space};
use super::styles::Colors;
use crate::model::{Component, InstanceStyle, LostEntity};
use crate::part21::Keyword;
use partprobe_shape::{Instance, Units};
use std::collections::{BTreeMap, BTreeSet};

/// The key of a product. Two bodies belong to the same product if they have the same coordinate system or the same product
/// definition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ProductKey {
    pub(super) system: Option<u64>,
    pub(super) definition: Option<u64>,
    /// Whether the body belongs to no product and to no assembly.
    pub(super) is_alone: bool,
}

/// The representations of a file, with the units and positions that they give to the roots.
pub(super) struct Representations<'s, 'a> {
    source: &'s StepFile<'a>,
    /// The representation of each root. If several list it, it is the first one that is placed in an assembly.
    of_root: BTreeMap<u64, u64>,
    contexts: Contexts<'s, 'a>,
    assembly: Assembly,
    /// The index of the component of each coordinate system. Roots without a system share the system 0.
    component_of: BTreeMap<u64, u32>,
    components: Vec<Component>,
    colors: &'s Colors,
    layers: &'s Layers,
}

/// Which representations list the roots of a file and its mapped items.
struct Listings {
    /// The representations that list each root. Drawings come last, because they give the position of a root only if no other
    /// representation does.
    of_root: BTreeMap<u64, Vec<u64>>,
    /// Each mapped item, and the representation that lists it.
    mapped_in: Vec<(u64, u64)>,
}

impl Listings {
    fn of(source: &StepFile<'_>, roots: &[Root]) -> Self {
        let mut listings = Self {
            of_root: bare_roots(roots),
            mapped_in: Vec::new(),
        };
        let known: BTreeSet<u64> = roots.iter().map(|root| root.record.id).collect();
        let mut drawn_in = Vec::new();
        for representation in representations(source) {
            let id = representation.record.id;
            let items = representation.items.iter();
            for item in items.filter_map(|item| item.ok()?.reference().ok()) {
                let is_mapped = is_mapped_item(source, item);
                if !is_mapped && !known.contains(&item) {
                    continue;
                }
                match (is_drawn(source, representation.record), is_mapped) {
                    (true, true) => {}
                    (true, false) => drawn_in.push((item, id)),
                    (false, true) => listings.mapped_in.push((item, id)),
                    (false, false) => listings.add(item, id),
                }
            }
        }
        for (root, representation) in drawn_in {
            listings.add(root, representation);
        }
        listings
    }

    fn add(&mut self, root: u64, representation: u64) {
        self.of_root.entry(root).or_default().push(representation);
    }
}

/// The representations of roots that are representations themselves.
fn bare_roots(roots: &[Root]) -> BTreeMap<u64, Vec<u64>> {
    roots
        .iter()
        .filter(|root| matches!(root.kind, RootKind::Bare | RootKind::BareFacets))
        .map(|root| (root.record.id, vec![root.record.id]))
        .collect()
}

fn is_mapped_item(source: &StepFile<'_>, item: u64) -> bool {
    source
        .exchange
        .record(item)
        .is_some_and(|record| record.keyword == Keyword::MappedItem)
}

impl<'s, 'a> Representations<'s, 'a> {
    /// Reads contexts, relationships and occurrences.
    pub(super) fn read(
        source: &'s StepFile<'a>,
        roots: &[Root],
        colors: &'s Colors,
        layers: &'s Layers,
    ) -> Self {
        let Listings {
            of_root: all_of_root,
            mapped_in,
        } = Listings::of(source, roots);
        let mut contexts = Contexts::new(source);
        // Representations without a context are read in the units of the first root with a representation.
        let first = roots
            .iter()
            .find_map(|root| all_of_root.get(&root.record.id)?.first().copied());
        contexts.units(first);
        contexts.ensure_units();
        let assembly = Assembly::read(source, &mut contexts, &mapped_in);
        let of_root = all_of_root
            .into_iter()
            .filter_map(|(root, all)| Some((root, assembly.preferred_representation(&all)?)))
            .collect();
        Self {
            source,
            of_root,
            contexts,
            assembly,
            component_of: BTreeMap::new(),
            components: Vec::new(),
            colors,
            layers,
        }
    }

    /// The units of a root.
    pub(super) fn units(&mut self, root: u64) -> Units {
        self.contexts.units(self.of_root.get(&root).copied())
    }

    /// Units and placement of a root.
    pub(super) fn space(&mut self, root: u64) -> Space {
        let Units {
            mm_per_unit,
            rad_per_unit,
            ..
        } = self.units(root);
        let motion = self
            .of_root
            .get(&root)
            .and_then(|&representation| self.assembly.motion(representation));
        Space {
            mm_per_unit,
            rad_per_unit,
            motion,
        }
    }

    /// The name of the product that a root belongs to.
    pub(super) fn product_name(&self, root: u64) -> Option<String> {
        self.assembly
            .product_name(self.source, *self.of_root.get(&root)?)
    }

    /// The representation of a root.
    pub(super) fn representation(&self, root: u64) -> Option<u64> {
        self.of_root.get(&root).copied()
    }

    /// The product whose shape a root is.
    pub(super) fn product(&self, root: u64) -> ProductKey {
        let system = self
            .representation(root)
            .map(|representation| self.assembly.system(representation));
        let definition = system.and_then(|system| self.assembly.definition(system));
        let is_placed = system.is_some_and(|system| self.assembly.is_placed(system));
        ProductKey {
            system,
            definition,
            is_alone: definition.is_none() && !is_placed,
        }
    }

    /// The index of the component that a root belongs to.
    pub(super) fn component(&mut self, root: u64) -> u32 {
        let representation = self.of_root.get(&root).copied();
        let system =
            representation.map_or(0, |representation| self.assembly.system(representation));
        if let Some(&known) = self.component_of.get(&system) {
            return known;
        }
        let index = self.components.len() as u32;
        self.component_of.insert(system, index);
        let component = self.component_of_system(representation);
        self.components.push(component);
        index
    }

    /// The components, in the order in which they were requested.
    pub(super) fn components(&mut self) -> Vec<Component> {
        std::mem::take(&mut self.components)
    }

    /// The occurrences of a representation. If it has no occurrence, or only occurs in itself, it keeps its coordinates.
    fn component_of_system(&mut self, representation: Option<u64>) -> Component {
        let found = representation
            .map(|representation| self.assembly.occurrences(representation))
            .unwrap_or_default();
        let product = representation
            .and_then(|representation| self.assembly.product_name(self.source, representation));
        let as_written = || Occurrence {
            systems: Vec::new(),
            items: Vec::new(),
            motion: Motion::IDENTITY,
        };
        let found = if found.is_empty() {
            vec![as_written()]
        } else {
            found
        };
        let style = |Occurrence { items, .. }: &Occurrence| InstanceStyle {
            color: items.iter().find_map(|&item| self.colors.of(item)),
            layer: items
                .iter()
                .find_map(|&item| self.layers.of(item))
                .map(str::to_owned),
        };
        let styles = found.iter().map(style).collect();
        let instance = |Occurrence {
                            systems, motion, ..
                        }: Occurrence| {
            let names = systems
                .iter()
                .map(|&system| self.name_on_path(system))
                .collect::<Vec<_>>();
            // A placement with infinite coordinates has no matrix that can be written to a file.
            let transform = Some(motion.matrix())
                .filter(|rows| rows.iter().flatten().all(|cell| cell.is_finite()));
            let transform = transform.unwrap_or_else(|| Motion::IDENTITY.matrix());
            Instance {
                path: names.join("/"),
                product: product.clone(),
                transform,
            }
        };
        Component {
            occurrences: found.into_iter().map(instance).collect(),
            styles,
        }
    }

    /// The name of a product in a path. A product without a name is named by its number.
    fn name_on_path(&self, system: u64) -> String {
        let name = self.assembly.product_name(self.source, system);
        name.map_or_else(|| format!("#{system}"), |name| name.replace('/', "_"))
    }

    /// The message about an assumed unit, if the file has no units.
    pub(super) fn assumption(&self) -> Option<LostEntity> {
        self.contexts.assumption()
    }

    /// Contexts and occurrences that could not be read.
    pub(super) fn into_lost(self) -> Vec<LostEntity> {
        let mut lost = self.contexts.into_lost();
        lost.append(&mut self.assembly.into_lost());
        lost
    }
}
