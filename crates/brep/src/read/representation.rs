//! Representations: lists of items with the context that their numbers are meant in.
//!
//! They are recognised by their attributes (a name, a list of items, a context), for each schema has subtypes of its
//! own, `SHAPE_REPRESENTATION_WITH_PARAMETERS` or `DRAUGHTING_MODEL`, and not all of them are named so.

use super::source::Source;
use crate::part21::{Keyword, Param, Params, Record, full_name};

/// A representation as its instance states it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Representation<'a> {
    /// Its instance.
    pub(super) record: Record,
    /// The entities that it lists.
    pub(super) items: Params<'a>,
    /// The `#` number of its context, if it names one.
    pub(super) context: Option<u64>,
}

/// Parts of the names of classes that draw.
const DRAWN: [&[u8]; 6] = [b"DRAUGHTING", b"DRAWING", b"PRESENTATION", b"PICTURE", b"SYMBOL", b"CAMERA"];

/// Every representation of the file, by ascending number.
pub(super) fn representations<'s, 'a>(
    source: &'s Source<'a>,
) -> impl Iterator<Item = Representation<'a>> + use<'s, 'a> {
    source.exchange.records().iter().filter_map(|&record| representation_of(source, record))
}

/// The representation that an instance is; none if it is anything else.
pub(super) fn representation_of<'a>(source: &Source<'a>, record: Record) -> Option<Representation<'a>> {
    let (params, is_sure) = match record.keyword {
        Keyword::Representation => (source.exchange.params(record), true),
        Keyword::Complex => match source.exchange.partial(record, "REPRESENTATION") {
            Some(params) => (params, true),
            // Written as one list of attributes in one of its classes.
            None => {
                let mut parts = source.exchange.partials(record);
                let has_context =
                    |params: &Params<'a>| attributes(source, *params).is_some_and(|(_, context)| context.is_some());
                (parts.find_map(|(_, params)| Some(params).filter(has_context))?, false)
            }
        },
        Keyword::Other => (source.exchange.params(record), false),
        _ => return None,
    };
    let (items, context) = attributes(source, params)?;
    (is_sure || context.is_some()).then_some(Representation { record, items, context })
}

impl Representation<'_> {
    /// Whether it shows what others describe, in a view or on a sheet: what stands in it is not placed by it.
    pub(super) fn is_drawn(&self, source: &Source<'_>) -> bool {
        source.exchange.partials(self.record).any(|(class, _)| draws(full_name(class)))
    }
}

/// The items, and the context if it is one.
fn attributes<'a>(source: &Source<'a>, params: Params<'a>) -> Option<(Params<'a>, Option<u64>)> {
    let [name, items, context] = params.first().ok()?;
    let is_name = name.text().is_some() || matches!(name, Param::Unset | Param::Derived);
    let items = items.list().ok().filter(|_| is_name)?;
    Some((items, context.reference().ok().filter(|&context| is_context(source, context))))
}

fn is_context(source: &Source<'_>, id: u64) -> bool {
    let Some(record) = source.exchange.record(id) else { return false };
    match record.keyword {
        Keyword::Context => true,
        Keyword::Complex => {
            source.exchange.partials(record).any(|(class, _)| Keyword::from_name(class) == Keyword::Context)
        }
        _ => false,
    }
}

fn draws(class: &[u8]) -> bool {
    let has = |part: &[u8]| class.windows(part.len()).any(|window| window.eq_ignore_ascii_case(part));
    DRAWN.iter().any(|part| has(part))
}
