//! Checks bounds on the scores of a run and on figures of its trainings, as given by the `[expect]` table of a config.
//!
//! Examples: `"a/b.miou - c/d.miou" = ">= 0.1"` and `"a.untouched_tensors" = "<= 0"`.

mod bound;
mod error;
mod quantity;
#[cfg(test)]
mod tests;

pub use error::ExpectationError;
pub use quantity::TrainingFigures;

use crate::tables::Tables;
use bound::Bound;
use quantity::Quantity;
use serde::Serialize;
use std::fmt;

/// Bounds on the scores of a run, in the order in which they were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Expectations {
    all: Vec<Expectation>,
}

/// One bound on a quantity or on the difference of two.
#[derive(Clone, Debug, PartialEq)]
struct Expectation {
    key: String,
    quantity: Quantity,
    minus: Option<Quantity>,
    bound: Bound,
}

/// The result of checking one bound.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ExpectationOutcome {
    /// The bound as it was written, for example `a/b.miou >= 0.5`.
    #[serde(rename = "bound")]
    pub text: String,
    /// The score or the difference.
    pub value: f64,
    /// Whether the bound holds.
    pub passed: bool,
}

impl fmt::Display for ExpectationOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = if self.passed { "holds" } else { "missed" };
        write!(f, "{verdict}: {} (it is {:.4})", self.text, self.value)
    }
}

impl Expectations {
    /// Reads the keys and values of an `[expect]` table.
    ///
    /// # Errors
    /// If a key does not name a score, or a value is not a bound. The message names the key.
    pub fn parse<'a>(
        entries: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ExpectationError> {
        let all = entries
            .into_iter()
            .map(|(key, value)| Expectation::parse(key, value));
        Ok(Self {
            all: all.collect::<Result<_, _>>()?,
        })
    }

    /// Refuses names that a run with these supervisions and references will not have, before any work is done.
    ///
    /// # Errors
    /// If a bound names another supervision or reference. The message lists the known ones.
    pub fn check_names(
        &self,
        supervisions: &[&str],
        references: &[&str],
    ) -> Result<(), ExpectationError> {
        for expectation in &self.all {
            for quantity in expectation.quantities() {
                match quantity {
                    Quantity::Score(score) => {
                        expectation.check_name(&score.supervision, supervisions)?;
                        expectation.check_name(&score.reference, references)?;
                    }
                    Quantity::Untouched(supervision) => {
                        expectation.check_name(supervision, supervisions)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Takes out the bounds that name one of these supervisions, for example because it was not trained. Returns the other bounds,
    /// and those that were taken out, as they were written.
    #[must_use]
    pub fn without(self, supervisions: &[&str]) -> (Self, Vec<String>) {
        let names_one = |expectation: &Expectation| {
            let mut names = expectation.quantities().map(Quantity::supervision);
            names.any(|name| supervisions.contains(&name))
        };
        let (taken, all): (Vec<Expectation>, Vec<Expectation>) =
            self.all.into_iter().partition(names_one);
        let texts = taken.iter().map(Expectation::to_string);
        (Self { all }, texts.collect())
    }

    /// Compares every bound with the tables of a run and the figures of its trainings.
    ///
    /// # Errors
    /// If a bound names a row that the tables do not have, or a number that its row or training lacks.
    pub fn evaluate(
        &self,
        tables: &Tables,
        trainings: &TrainingFigures,
    ) -> Result<Vec<ExpectationOutcome>, ExpectationError> {
        self.all
            .iter()
            .map(|expectation| expectation.outcome(tables, trainings))
            .collect()
    }
}

/// The bound as it was written.
impl fmt::Display for Expectation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.key, self.bound)
    }
}

impl Expectation {
    /// The quantity, and the one that is subtracted from it.
    fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        [&self.quantity].into_iter().chain(&self.minus)
    }

    fn parse(key: &str, value: &str) -> Result<Self, ExpectationError> {
        let (first, minus) = match key.split_once(" - ") {
            Some((first, minus)) => (first, Some(Quantity::parse(key, minus)?)),
            None => (key, None),
        };
        let quantity = Quantity::parse(key, first)?;
        let bound = Bound::parse(value).ok_or_else(|| ExpectationError::Bound {
            key: key.to_owned(),
            value: value.to_owned(),
        })?;
        Ok(Self {
            key: key.to_owned(),
            quantity,
            minus,
            bound,
        })
    }

    fn check_name(&self, name: &str, known: &[&str]) -> Result<(), ExpectationError> {
        if known.contains(&name) {
            return Ok(());
        }
        Err(ExpectationError::UnknownName {
            key: self.key.clone(),
            name: name.to_owned(),
            known: known.join(", "),
        })
    }

    fn outcome(
        &self,
        tables: &Tables,
        trainings: &TrainingFigures,
    ) -> Result<ExpectationOutcome, ExpectationError> {
        let first = self.quantity.value(&self.key, tables, trainings)?;
        let second = match &self.minus {
            Some(minus) => minus.value(&self.key, tables, trainings)?,
            None => 0.0,
        };
        let value = first - second;
        Ok(ExpectationOutcome {
            text: self.to_string(),
            value,
            passed: self.bound.holds_for(value),
        })
    }
}
