//! Cuts the smallest STEP text that shows the faces of some entities out of a larger one.
//!
//! Everything that the entities refer to is included. An entity below a face, such as an edge or a surface, is shown by the faces
//! that use it. Names, the header and the product are made neutral. Coordinates stay as they are written, because a fault may
//! depend on them. Nothing here evaluates a surface, and nothing is repaired.

mod kinds;
mod references;
#[cfg(test)]
mod tests;
mod wrapping;

use crate::model::LostEntity;
use crate::part21::{
    Exchange, ExchangeError, Record, normalized, references_in, rewritten, schema_of,
};
use crate::read::ReadBudget;
use references::References;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use wrapping::{Content, wrap};

/// A schema that every program reads.
const SCHEMA: &str = "AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }";

/// A small file cut out of a large one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Extract {
    /// The text of the small file.
    pub text: Vec<u8>,
    /// The `#` number of each instance in the large file and in the small file, in ascending order.
    pub numbers: Vec<(u64, u64)>,
    /// The number of instances in the small file, including those that only hold the others together.
    pub n_instances: usize,
    /// Numbers to which the text refers but for which neither file has an instance.
    pub missing: Vec<u64>,
    /// The number of further faces that use the requested entities and were left out to keep the file small.
    pub n_left_out: usize,
}

/// How the instances of a small file are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Numbering {
    /// Counted from 1, in the order of the large file's numbers.
    FromOne,
    /// The numbers of the large file.
    Kept,
}

/// Why nothing can be cut out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExtractError {
    /// The text does not begin as STEP files do.
    #[error("the file is not a STEP file: it does not begin with ISO-10303-21")]
    NotStep,
    /// The text has no more than a header.
    #[error("the file has no data section with entities; it may have been cut off")]
    NoData,
    /// Reading the text needs more work than the budget allows.
    #[error(
        "the file has more than {limit} {what}; raise label.max_file_mb or label.max_entities to read it"
    )]
    OverBudget {
        /// The quantity that exceeds the limit.
        what: &'static str,
        /// The limit.
        limit: u64,
    },
    /// No instance has the number.
    #[error("the file has no #{id}; its numbers run from #{first} to #{last}")]
    Unknown {
        /// The requested number.
        id: u64,
        /// The lowest number of the file.
        first: u64,
        /// The highest number of the file.
        last: u64,
    },
    /// The instance with the number does not parse.
    #[error(
        "#{id} cannot be read, and so nothing can be cut out around it: {reason}; report its line as it is written"
    )]
    Damaged {
        /// The requested number.
        id: u64,
        /// What is wrong with it.
        reason: String,
    },
}

/// Cuts the smallest file around some entities out of a text.
///
/// # Errors
/// If the text is not a STEP file, is above the budget, or has no readable instance with one of the numbers.
pub fn extract(
    text: &[u8],
    ids: &[u64],
    numbering: Numbering,
    budget: &ReadBudget,
) -> Result<Extract, ExtractError> {
    let text = &*readable(text, budget)?;
    let mut lost = Vec::new();
    let exchange = Exchange::index(text, budget.max_entities, &mut lost)
        .map_err(|error| not_indexed(error, budget))?;
    if let Some(&id) = ids.iter().find(|&&id| exchange.slot(id).is_none()) {
        return Err(not_found(&exchange, id, &lost));
    }
    let references = References::of(&exchange);
    let Content { listed, n_left_out } = Content::of(&exchange, &references, ids);
    let shown = listed
        .iter()
        .flat_map(|(context, items)| items.iter().copied().chain(*context));
    let starts = ids.iter().copied().chain(shown);
    let kept: BTreeSet<u64> = references
        .closure(starts.filter_map(|id| exchange.slot(id)))
        .into_iter()
        .map(|slot| exchange.records()[slot].id)
        .collect();
    let mut text_of = Writer::new(&exchange, &kept, numbering);
    text_of.instances(&exchange, &kept);
    wrap(&exchange, &references, &listed, &kept, &mut text_of);
    let schema = schema_of(header_of(text, &exchange)).unwrap_or(SCHEMA);
    Ok(text_of.finish(schema, n_left_out))
}

/// The text in the encoding in which it is indexed. Fails if it has too many bytes before or after the conversion.
fn readable<'t>(text: &'t [u8], budget: &ReadBudget) -> Result<Cow<'t, [u8]>, ExtractError> {
    let max_bytes = budget.max_bytes.min(u64::from(u32::MAX));
    let over_budget = ExtractError::OverBudget {
        what: "bytes",
        limit: max_bytes,
    };
    if text.len() as u64 > max_bytes {
        return Err(over_budget);
    }
    let text = normalized(text);
    // A character of two bytes may need three bytes in UTF-8, so the length is tested again.
    if text.len() as u64 > u64::from(u32::MAX) {
        return Err(over_budget);
    }
    Ok(text)
}

fn not_indexed(error: ExchangeError, budget: &ReadBudget) -> ExtractError {
    match error {
        ExchangeError::NotStep => ExtractError::NotStep,
        ExchangeError::NoData => ExtractError::NoData,
        ExchangeError::TooManyEntities => ExtractError::OverBudget {
            what: "entities",
            limit: budget.max_entities,
        },
    }
}

/// The text before the first instance.
fn header_of<'t>(text: &'t [u8], exchange: &Exchange<'_>) -> &'t [u8] {
    let begins = exchange.records().iter().map(|record| record.at as usize);
    &text[..begins.min().unwrap_or(0)]
}

/// The reason why a number has no instance: it does not parse, or the file does not have it.
fn not_found(exchange: &Exchange<'_>, id: u64, lost: &[LostEntity]) -> ExtractError {
    if let Some(loss) = lost.iter().find(|loss| loss.step_id == id) {
        return ExtractError::Damaged {
            id,
            reason: loss.reason.clone(),
        };
    }
    let number = |record: Option<&Record>| record.map_or(0, |record| record.id);
    let (first, last) = (
        number(exchange.records().first()),
        number(exchange.records().last()),
    );
    ExtractError::Unknown { id, first, last }
}

/// The small file under construction.
struct Writer {
    body: Vec<u8>,
    number_of: BTreeMap<u64, u64>,
    missing: Vec<u64>,
    n_kept: usize,
    n_instances: usize,
    next: u64,
}

impl Writer {
    /// Gives each kept instance its number. A missing instance that others refer to gets a number that is not used otherwise.
    fn new(exchange: &Exchange<'_>, kept: &BTreeSet<u64>, numbering: Numbering) -> Self {
        let written = kept
            .iter()
            .filter_map(|&id| exchange.record(id))
            .map(|record| exchange.written(record));
        let referred: BTreeSet<u64> = written.flat_map(references_in).collect();
        let missing: Vec<u64> = referred
            .into_iter()
            .filter(|id| !kept.contains(id))
            .collect();
        let all = || kept.iter().chain(&missing).copied();
        let number_of: BTreeMap<u64, u64> = match numbering {
            Numbering::FromOne => all().zip(1..).collect(),
            Numbering::Kept => all().map(|id| (id, id)).collect(),
        };
        let next = number_of
            .values()
            .copied()
            .max()
            .unwrap_or(0)
            .checked_add(1)
            .unwrap_or(1);
        Self {
            body: Vec::new(),
            number_of,
            missing,
            n_kept: kept.len(),
            n_instances: 0,
            next,
        }
    }

    /// Writes the kept instances.
    fn instances(&mut self, exchange: &Exchange<'_>, kept: &BTreeSet<u64>) {
        for record in kept.iter().filter_map(|&id| exchange.record(id)) {
            self.begin(self.number(record.id));
            let number_of = &self.number_of;
            rewritten(
                exchange.written(record),
                |id| number_of.get(&id).copied().unwrap_or(id),
                &mut self.body,
            );
            self.body.extend_from_slice(b";\n");
        }
    }

    /// Writes an additional instance and returns its number.
    fn add(&mut self, instance: &str) -> u64 {
        let number = self.next;
        self.next = number.checked_add(1).unwrap_or(1);
        self.begin(number);
        self.body.extend_from_slice(instance.as_bytes());
        self.body.extend_from_slice(b";\n");
        number
    }

    fn begin(&mut self, number: u64) {
        self.n_instances += 1;
        self.body
            .extend_from_slice(format!("#{number}=").as_bytes());
    }

    /// The number that an instance of the large file has in the small file.
    fn number(&self, id: u64) -> u64 {
        self.number_of.get(&id).copied().unwrap_or(id)
    }

    fn finish(self, schema: &str, n_left_out: usize) -> Extract {
        let mut text = format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n\
             FILE_SCHEMA(('{schema}'));\nENDSEC;\nDATA;\n"
        )
        .into_bytes();
        text.extend_from_slice(&self.body);
        text.extend_from_slice(b"ENDSEC;\nEND-ISO-10303-21;\n");
        let is_kept = |(id, _): &(u64, u64)| self.missing.binary_search(id).is_err();
        let numbers: Vec<(u64, u64)> = self.number_of.into_iter().filter(is_kept).collect();
        debug_assert_eq!(numbers.len(), self.n_kept);
        Extract {
            text,
            numbers,
            n_instances: self.n_instances,
            missing: self.missing,
            n_left_out,
        }
    }
}
