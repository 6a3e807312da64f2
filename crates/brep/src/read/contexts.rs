//! The units of each representation, read once for each context.

use super::source::Source;
use super::units::{context_of, default_units, units_of_context};
use crate::model::{Loss, LossKind};
use carrier::Units;
use std::collections::BTreeMap;

/// Units by context, as far as they were asked for.
pub(super) struct Contexts<'s, 'a> {
    source: &'s Source<'a>,
    known: BTreeMap<u64, Option<Units>>,
    /// The units of what names no context: those of the first context that was read.
    fallback: Option<Units>,
    lost: Vec<Loss>,
}

impl<'s, 'a> Contexts<'s, 'a> {
    /// Nothing is read yet.
    pub(super) fn new(source: &'s Source<'a>) -> Self {
        Self { source, known: BTreeMap::new(), fallback: None, lost: Vec::new() }
    }

    /// The units of a representation; millimetre and radian where nothing in the file says more.
    pub(super) fn units(&mut self, representation: Option<u64>) -> Units {
        let record = representation.and_then(|id| self.source.record(id).ok());
        let context = record.and_then(|record| context_of(self.source, record));
        let units = context.and_then(|context| self.units_of(context));
        units.or_else(|| self.fallback.clone()).unwrap_or_else(default_units)
    }

    /// Contexts whose units cannot be read.
    pub(super) fn into_lost(self) -> Vec<Loss> {
        self.lost
    }

    fn units_of(&mut self, context: u64) -> Option<Units> {
        if let Some(known) = self.known.get(&context) {
            return known.clone();
        }
        let units = match units_of_context(self.source, context) {
            Ok(units) => Some(units),
            Err(error) => {
                let reason = format!("its units cannot be read, others are assumed: {}", error.reason(context));
                self.lost.push(Loss { kind: LossKind::Entity, step_id: context, reason });
                None
            }
        };
        if self.fallback.is_none() {
            self.fallback.clone_from(&units);
        }
        self.known.insert(context, units.clone());
        units
    }
}
