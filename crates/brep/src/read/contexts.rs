//! Reads the units of each representation, once per context.

use super::file::StepFile;
use super::representation::representation_of;
use super::units::{assigns_units, default_units, units_of_context};
use crate::model::{LostEntity, LostKind};
use crate::part21::Record;
use partprobe_shape::Units;
use std::collections::BTreeMap;

/// The units of the contexts for which they were requested.
pub(super) struct Contexts<'s, 'a> {
    source: &'s StepFile<'a>,
    known: BTreeMap<u64, Option<Units>>,
    /// The units of representations without a context: those of the first context that was read.
    fallback: Option<Units>,
    /// Whether no context of the file assigns units.
    has_none: bool,
    lost: Vec<LostEntity>,
}

impl<'s, 'a> Contexts<'s, 'a> {
    /// Makes an empty list. Nothing is read yet.
    pub(super) fn new(source: &'s StepFile<'a>) -> Self {
        Self {
            source,
            known: BTreeMap::new(),
            fallback: None,
            has_none: false,
            lost: Vec::new(),
        }
    }

    /// The units of a representation. They are millimeter and radian if the file does not define others.
    pub(super) fn units(&mut self, representation: Option<u64>) -> Units {
        let record = representation.and_then(|id| self.source.record(id).ok());
        let context = record.and_then(|record| representation_of(self.source, record)?.context);
        let units = context.and_then(|context| self.units_of(context));
        units
            .or_else(|| self.fallback.clone())
            .unwrap_or_else(default_units)
    }

    /// Reads the first context of the file that assigns units, if no units are known yet.
    pub(super) fn ensure_units(&mut self) {
        if self.fallback.is_some() {
            return;
        }
        let records = self.source.exchange.records().iter();
        let contexts = records.filter(|record| assigns_units(self.source, **record));
        let mut contexts: Vec<Record> = contexts.copied().collect();
        contexts.sort_by_key(|record| record.at);
        self.has_none = contexts.is_empty();
        let _first = contexts
            .iter()
            .find_map(|context| self.units_of(context.id));
    }

    /// The message that millimeters are assumed, if no context of the file assigns units.
    pub(super) fn assumption(&self) -> Option<LostEntity> {
        let reason = "the file states no length unit, millimeters are assumed";
        self.has_none.then(|| LostEntity {
            kind: LostKind::Entity,
            step_id: 0,
            reason: reason.to_owned(),
        })
    }

    /// The contexts whose units could not be read.
    pub(super) fn into_lost(self) -> Vec<LostEntity> {
        self.lost
    }

    fn units_of(&mut self, context: u64) -> Option<Units> {
        if let Some(known) = self.known.get(&context) {
            return known.clone();
        }
        let units = match units_of_context(self.source, context) {
            Ok(units) => Some(units),
            Err(error) => {
                let reason = format!(
                    "its units cannot be read, others are assumed: {}",
                    error.reason(context)
                );
                self.lost.push(LostEntity {
                    kind: LostKind::Entity,
                    step_id: context,
                    reason,
                });
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
