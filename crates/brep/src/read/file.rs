//! Gives access to the instances of a file by number, and limits the number of visits to them.

use super::error::{EntityError, Problem};
use crate::model::{LostEntity, LostKind};
use crate::part21::{Exchange, Keyword, Params, Record, decode_text};
use crate::part21::{Param, ParamError};
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;

/// The instances of a file, and how many more visits to them are allowed.
pub(super) struct StepFile<'a> {
    pub(super) exchange: Exchange<'a>,
    visits_left: Cell<u64>,
    /// Instances whose truth value was assumed.
    assumed: RefCell<BTreeSet<u64>>,
}

impl<'a> StepFile<'a> {
    /// A source that allows `max_visits` visits to its instances.
    pub(super) fn new(exchange: Exchange<'a>, max_visits: u64) -> Self {
        Self {
            exchange,
            visits_left: Cell::new(max_visits),
            assumed: RefCell::default(),
        }
    }

    /// Whether every further visit will be refused.
    pub(super) fn is_spent(&self) -> bool {
        self.visits_left.get() == 0
    }

    /// Reads an instance. An error is assigned to it unless it is already assigned to an entity further inside.
    pub(super) fn entity<T>(
        &self,
        id: u64,
        read: impl FnOnce(Record) -> Result<T, EntityError>,
    ) -> Result<T, EntityError> {
        let record = self.record(id)?;
        read(record).map_err(|error| error.within(id))
    }

    /// The instance with this number.
    pub(super) fn record(&self, id: u64) -> Result<Record, EntityError> {
        match self.visits_left.get() {
            0 => return Err(Problem::OverBudget.into()),
            visits => self.visits_left.set(visits - 1),
        }
        self.exchange.record(id).ok_or_else(|| {
            let problem = self
                .exchange
                .address(id)
                .map_or(Problem::Missing, Problem::Elsewhere);
            EntityError::from(problem).within(id)
        })
    }

    /// The truth value of an orientation or a sense. If it is unknown (`.U.`) or left out, it is assumed to be true, and the
    /// instance is named by [`StepFile::assumptions`].
    pub(super) fn flag(&self, record: Record, param: Param<'_>) -> Result<bool, ParamError> {
        let flag = param.logical()?;
        if flag.is_none() {
            self.assumed.borrow_mut().insert(record.id);
        }
        Ok(flag.unwrap_or(true))
    }

    /// The instances whose truth value was assumed.
    pub(super) fn assumptions(&self) -> Vec<LostEntity> {
        let reason = "its orientation is not given, .T. is assumed";
        let loss = |&step_id: &u64| LostEntity {
            kind: LostKind::Entity,
            step_id,
            reason: reason.to_owned(),
        };
        self.assumed.borrow().iter().map(loss).collect()
    }

    /// The first `N` parameters of an instance of one class.
    pub(super) fn params<const N: usize>(
        &self,
        record: Record,
    ) -> Result<[Param<'a>; N], ParamError> {
        self.exchange.params(record).first()
    }

    /// The parameters of a class. In a plain instance they begin at `offset`. In a complex instance they are those of the class
    /// itself.
    pub(super) fn class_params(
        &self,
        record: Record,
        name: &str,
        offset: usize,
    ) -> Result<Params<'a>, ParamError> {
        if record.keyword == Keyword::Complex {
            return self
                .exchange
                .partial(record, name)
                .ok_or(ParamError::Missing);
        }
        let mut params = self.exchange.params(record);
        for _ in 0..offset {
            params.next_param()?.ok_or(ParamError::Missing)?;
        }
        Ok(params)
    }

    /// Whether a complex instance is a spline, a context or a unit, judging by its first class. Files have many of these
    /// instances, some with long lists, and none of them is a body, a representation, a relationship or a style.
    pub(super) fn is_spline_or_context(&self, record: Record) -> bool {
        let known: [&[u8]; 5] = [
            b"BOUNDED_",
            b"B_SPLINE",
            b"GEOMETRIC_REPRESENTATION_CONTEXT",
            b"LENGTH_UNIT",
            b"NAMED_UNIT",
        ];
        let first = self.exchange.partials(record).next();
        first.is_some_and(|(class, _)| known.iter().any(|name| class.starts_with(name)))
    }

    /// The first attributes of a representation of any class: its name and its items.
    pub(super) fn representation_params(&self, record: Record) -> Result<Params<'a>, ParamError> {
        match record.keyword {
            Keyword::Complex => self
                .exchange
                .partial(record, "REPRESENTATION")
                .ok_or(ParamError::Missing),
            _ => Ok(self.exchange.params(record)),
        }
    }

    /// The error of an instance whose class does not fit.
    pub(super) fn wrong_class(&self, record: Record, expected: &'static str) -> EntityError {
        Problem::Class {
            class: self.exchange.class_name(record),
            expected,
        }
        .into()
    }
}

/// The name in a string parameter. Returns `None` if it is empty or unset.
pub(super) fn name_of(param: Param<'_>) -> Option<String> {
    param
        .text()
        .filter(|text| !text.is_empty())
        .map(decode_text)
}
