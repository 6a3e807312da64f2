//! Reads the entities of a STEP file into a B-Rep.
//!
//! Geometry is read when it is needed. Topology is shared where the file shares it. Nothing is repaired or sewn. Nothing here
//! evaluates a mesh.

mod assembly;
mod bounded_surfaces;
mod bsplines;
mod construction_classes;
mod constructions;
mod contexts;
mod curves;
mod edges;
mod error;
mod face_attributes;
mod face_surface;
mod facet_bodies;
mod facet_edges;
mod file;
mod implicit_bounds;
mod layers;
mod listing;
mod memo;
mod patches;
mod placement;
mod plane_of_loops;
mod points;
mod primitives;
mod rectangle;
mod relationships;
mod representation;
mod roots;
mod space;
mod styles;
mod surface_table;
mod surfaces;
mod tessellation;
#[cfg(test)]
mod tests;
mod topology;
mod transformations;
mod units;

use crate::model::{Brep, LostEntity, LostKind, Note};
use crate::part21::{Exchange, ExchangeError, normalized};
use file::StepFile;
use layers::Layers;
use listing::Shapes;
use placement::{ProductKey, Representations};
use roots::RootKind;
use std::collections::BTreeSet;
use styles::Colors;
use topology::{Site, TopologyBuilder};

/// Limits on the work of reading. Every limit counts work. No limit counts time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadBudget {
    /// Largest number of bytes of the text. Independently of this value, the text must be at most 4 GiB, in the file and in
    /// UTF-8.
    pub max_bytes: u64,
    /// Largest number of instances in the text.
    pub max_entities: u64,
    /// Largest mean number of visits per instance. This stops files that refer to the same instance thousands of times.
    pub max_visits_per_entity: u64,
}

impl Default for ReadBudget {
    /// 256 mebibytes of text, 50 million instances, and 16 visits per instance.
    fn default() -> Self {
        Self {
            max_bytes: 256 << 20,
            max_entities: 50_000_000,
            max_visits_per_entity: 16,
        }
    }
}

/// Additional visits, which the smallest files need.
const SPARE_VISITS: u64 = 1000;

const BYTES: &str = "bytes";
const ENTITIES: &str = "entities";
const VISITS: &str = "visits to an entity on average";

/// The reason why a text gives no B-Rep.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// There is no text.
    #[error("the file is empty")]
    Empty,
    /// The text does not begin as STEP files do.
    #[error("the file is not a STEP file: it does not begin with ISO-10303-21")]
    NotStep,
    /// The text has no more than a header.
    #[error("the file has no data section with entities; it may have been cut off")]
    NoData,
    /// Reading the text needs more work than the budget allows.
    #[error("the file has more than {limit} {what}{}", advice(what))]
    OverBudget {
        /// The quantity that exceeds the limit.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// No face could be read.
    #[error("{}", no_faces(lost))]
    NoFaces {
        /// The entities that could not be read. The list is empty if the file names no faces.
        lost: Vec<LostEntity>,
    },
}

/// The setting that a user may raise. There is none for visits: a file that needs so many is not worth its time.
fn advice(what: &str) -> &'static str {
    match what {
        BYTES => "; raise label.max_file_mb to read it",
        ENTITIES => "; raise label.max_entities to read it",
        _ => "",
    }
}

fn no_faces(lost: &[LostEntity]) -> String {
    match lost {
        [] => "the file has no faces: it names no solid and no surface model".to_owned(),
        [one] => format!("the file has no readable face; 1 entity was lost, {one}"),
        [first, ..] => format!(
            "the file has no readable face; {} entities were lost, first {first}",
            lost.len()
        ),
    }
}

/// Reads the faces of a STEP file of any edition and encoding. The result also names everything that was lost.
///
/// # Errors
/// If the text is not a STEP file, needs more work than the budget allows, or has no face that can be read.
pub fn read(text: &[u8], budget: &ReadBudget) -> Result<Brep, ReadError> {
    if text.iter().all(u8::is_ascii_whitespace) {
        return Err(ReadError::Empty);
    }
    let max_bytes = budget.max_bytes.min(u64::from(u32::MAX));
    if text.len() as u64 > max_bytes {
        return Err(ReadError::OverBudget {
            what: BYTES,
            limit: max_bytes,
        });
    }
    let text = normalized(text);
    // A character of two bytes may need three bytes in UTF-8, so the length is tested again.
    if text.len() as u64 > u64::from(u32::MAX) {
        return Err(ReadError::OverBudget {
            what: BYTES,
            limit: max_bytes,
        });
    }
    let mut lost = Vec::new();
    let exchange =
        Exchange::index(&text, budget.max_entities, &mut lost).map_err(|error| match error {
            ExchangeError::NotStep => ReadError::NotStep,
            ExchangeError::NoData => ReadError::NoData,
            ExchangeError::TooManyEntities => ReadError::OverBudget {
                what: ENTITIES,
                limit: budget.max_entities,
            },
        })?;
    let max_visits = budget
        .max_visits_per_entity
        .saturating_mul(exchange.records().len() as u64);
    let source = StepFile::new(exchange, max_visits.saturating_add(SPARE_VISITS));
    let mut brep = brep_of(&source, lost);
    brep.lost.append(&mut source.assumptions());
    if source.is_spent() {
        return Err(ReadError::OverBudget {
            what: VISITS,
            limit: budget.max_visits_per_entity,
        });
    }
    if brep.faces.is_empty() {
        Err(ReadError::NoFaces {
            lost: with_notes(brep),
        })
    } else {
        Ok(brep)
    }
}

/// The lost entities of a file without faces, and the items that were left out on purpose.
fn with_notes(brep: Brep) -> Vec<LostEntity> {
    let left_out = brep.notes.into_iter();
    let left_out = left_out.map(|Note { step_id, text }| LostEntity {
        kind: LostKind::Entity,
        step_id,
        reason: text,
    });
    brep.lost.into_iter().chain(left_out).collect()
}

/// The products that have exact faces. A tessellation of such a product is the same shape again.
#[derive(Default)]
struct ExactShapes {
    systems: BTreeSet<u64>,
    definitions: BTreeSet<u64>,
    is_any: bool,
}

impl ExactShapes {
    fn add(&mut self, product: ProductKey) {
        self.is_any = true;
        self.systems.extend(product.system);
        self.definitions.extend(product.definition);
    }

    fn has_product(&self, product: ProductKey) -> bool {
        let has_system = product
            .system
            .is_some_and(|system| self.systems.contains(&system));
        (product.is_alone && self.is_any)
            || has_system
            || product
                .definition
                .is_some_and(|definition| self.definitions.contains(&definition))
    }
}

fn brep_of(source: &StepFile<'_>, lost: Vec<LostEntity>) -> Brep {
    let colors = Colors::read(source);
    let layers = Layers::read(source);
    let Shapes { roots, notes } = listing::shapes(source, roots::roots(source), !lost.is_empty());
    let mut representations = Representations::read(source, &roots, &colors, &layers);
    let brep = Brep {
        vertices: Vec::new(),
        edges: Vec::new(),
        faces: Vec::new(),
        shells: Vec::new(),
        solids: Vec::new(),
        components: Vec::new(),
        lost,
        notes,
        units: representations.units(roots.first().map_or(0, |root| root.record.id)),
    };
    let mut builder = TopologyBuilder::new(source, &colors, &layers, brep);
    let mut exact = ExactShapes::default();
    for root in &roots {
        let id = root.record.id;
        let is_tessellated = matches!(root.kind, RootKind::Tessellated | RootKind::BareFacets);
        let product = representations.product(id);
        let is_repeated = root.kind == RootKind::Bare && !builder.lists_unread_items(root);
        if is_repeated
            || (is_tessellated && builder.is_replaced_by_exact(root, exact.has_product(product)))
        {
            continue;
        }
        let site = Site {
            product_name: representations.product_name(id),
            space: representations.space(id),
            component: representations.component(id),
            representation: representations.representation(id),
        };
        let has_grown = builder.add_root(root, site);
        if has_grown && !is_tessellated {
            exact.add(product);
        }
    }
    let mut brep = builder.finish();
    brep.components = representations.components();
    if !brep.faces.is_empty() {
        brep.lost.extend(representations.assumption());
    }
    brep.lost.append(&mut representations.into_lost());
    brep
}
