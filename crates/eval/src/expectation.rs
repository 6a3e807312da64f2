//! Bounds on scores, as a config's `[expect]` table states them: `"a/b.miou - c/d.miou" = ">= 0.1"`; and on what a
//! training says of itself: `"a.untouched_tensors" = "<= 0"`.

use crate::{Metric, Tables};
use std::collections::BTreeMap;
use std::fmt;

/// The name of [`TrainingFigures::untouched_tensors`] in a key.
const UNTOUCHED_TENSORS: &str = "untouched_tensors";

/// What trainings say of themselves, by supervision; of several seeds the worst.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TrainingFigures {
    /// Tensors of parameters that no gradient has reached.
    pub untouched_tensors: BTreeMap<String, usize>,
}

/// What a bound is on.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Quantity {
    Score(ScoreName),
    /// The untouched tensors of this supervision.
    Untouched(String),
}

/// One score: `supervision/reference.metric`, or `supervision/reference@clusterer.metric`.
#[derive(Clone, Debug, PartialEq, Eq)]
struct ScoreName {
    supervision: String,
    reference: String,
    clusterer: Option<String>,
    metric: Metric,
}

/// How a score is compared with its bound.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    AtLeast,
    Above,
    AtMost,
    Below,
}

/// One bound on a score or on a difference of two.
#[derive(Clone, Debug, PartialEq)]
struct Expectation {
    key: String,
    quantity: Quantity,
    minus: Option<Quantity>,
    comparison: Comparison,
    bound: f64,
}

/// Bounds on the scores of a run, in the order in which they were given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Expectations {
    all: Vec<Expectation>,
}

/// What became of one bound.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectationOutcome {
    /// The bound as it was written, for example `a/b.miou >= 0.5`.
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

/// Why a bound cannot be read or decided.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ExpectationError {
    /// The key names no score.
    #[error(
        "`{key}` names no score; write `supervision/reference.metric`, or two of them with ` - ` between, or \
         `supervision.untouched_tensors`"
    )]
    Key {
        /// The key.
        key: String,
    },
    /// The metric does not exist.
    #[error(
        "`{key}` asks for the metric `{metric}`; the metrics are {}",
        Metric::known_names()
    )]
    Metric {
        /// The key.
        key: String,
        /// The metric in it.
        metric: String,
    },
    /// The bound is no comparison with a number.
    #[error(
        "`{value}` is no bound for `{key}`; write >=, >, <= or < and a number, for example `>= 0.5`"
    )]
    Bound {
        /// The key.
        key: String,
        /// The text of the bound.
        value: String,
    },
    /// The supervision, reference or clusterer is not part of the run.
    #[error("`{key}` names `{name}`, which this run does not have; it has {known}")]
    UnknownName {
        /// The key.
        key: String,
        /// The name in it.
        name: String,
        /// The names that could stand there.
        known: String,
    },
    /// The run has no such number, for example no GTc without a network.
    #[error("`{key}` asks for `{score}`, of which this run has no value")]
    NoValue {
        /// The key.
        key: String,
        /// The score in it.
        score: String,
    },
}

impl Expectations {
    /// Reads the keys and values of an `[expect]` table.
    ///
    /// # Errors
    /// If a key names no score, or a value is no bound; the message names the key.
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
    /// If a bound names another supervision or reference; the message lists the known ones.
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
                        expectation.check_name(supervision, supervisions)?
                    }
                }
            }
        }
        Ok(())
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

impl Expectation {
    fn parse(key: &str, value: &str) -> Result<Self, ExpectationError> {
        let (first, minus) = match key.split_once(" - ") {
            Some((first, minus)) => (first, Some(Quantity::parse(key, minus)?)),
            None => (key, None),
        };
        let quantity = Quantity::parse(key, first)?;
        let bad_bound = || ExpectationError::Bound {
            key: key.to_owned(),
            value: value.to_owned(),
        };
        let (comparison, bound) = parse_bound(value).ok_or_else(bad_bound)?;
        Ok(Self {
            key: key.to_owned(),
            quantity,
            minus,
            comparison,
            bound,
        })
    }

    fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        [&self.quantity].into_iter().chain(&self.minus)
    }

    fn check_name(&self, name: &str, known: &[&str]) -> Result<(), ExpectationError> {
        if known.contains(&name) {
            return Ok(());
        }
        let known = known.join(", ");
        Err(ExpectationError::UnknownName {
            key: self.key.clone(),
            name: name.to_owned(),
            known,
        })
    }

    fn outcome(
        &self,
        tables: &Tables,
        trainings: &TrainingFigures,
    ) -> Result<ExpectationOutcome, ExpectationError> {
        let value_of = |quantity: &Quantity| match quantity {
            Quantity::Score(score) => self.value_of(score, tables),
            Quantity::Untouched(supervision) => self.untouched_of(supervision, trainings),
        };
        let value = value_of(&self.quantity)? - self.minus.as_ref().map_or(Ok(0.0), value_of)?;
        let (symbol, passed) = match self.comparison {
            Comparison::AtLeast => (">=", value >= self.bound),
            Comparison::Above => (">", value > self.bound),
            Comparison::AtMost => ("<=", value <= self.bound),
            Comparison::Below => ("<", value < self.bound),
        };
        Ok(ExpectationOutcome {
            text: format!("{} {symbol} {}", self.key, self.bound),
            value,
            passed,
        })
    }

    fn untouched_of(
        &self,
        supervision: &str,
        trainings: &TrainingFigures,
    ) -> Result<f64, ExpectationError> {
        let no_value = || ExpectationError::NoValue {
            key: self.key.clone(),
            score: format!("{supervision}.{UNTOUCHED_TENSORS}"),
        };
        trainings
            .untouched_tensors
            .get(supervision)
            .map(|&n| n as f64)
            .ok_or_else(no_value)
    }

    fn value_of(&self, score: &ScoreName, tables: &Tables) -> Result<f64, ExpectationError> {
        let clusterer = score.clusterer.as_deref().unwrap_or(&tables.clusterer);
        let Some(row) = tables.row(&score.supervision, &score.reference, clusterer) else {
            let known = tables
                .rows
                .iter()
                .map(|row| format!("{}/{}@{}", row.supervision, row.reference, row.clusterer));
            let known = known.collect::<Vec<_>>().join(", ");
            let name = format!("{}/{}@{clusterer}", score.supervision, score.reference);
            return Err(ExpectationError::UnknownName {
                key: self.key.clone(),
                name,
                known,
            });
        };
        let no_value = || ExpectationError::NoValue {
            key: self.key.clone(),
            score: format!(
                "{}/{}.{}",
                score.supervision, score.reference, score.metric.name
            ),
        };
        row.means.get(&score.metric).copied().ok_or_else(no_value)
    }
}

impl Quantity {
    fn parse(key: &str, text: &str) -> Result<Self, ExpectationError> {
        match text.trim().split_once('.') {
            Some((supervision, UNTOUCHED_TENSORS)) if is_name(supervision) => {
                Ok(Self::Untouched(supervision.to_owned()))
            }
            _ => ScoreName::parse(key, text).map(Self::Score),
        }
    }
}

impl ScoreName {
    fn parse(key: &str, text: &str) -> Result<Self, ExpectationError> {
        let bad_key = || ExpectationError::Key {
            key: key.to_owned(),
        };
        let (supervision, rest) = text.trim().split_once('/').ok_or_else(bad_key)?;
        let (target, metric) = rest.split_once('.').ok_or_else(bad_key)?;
        let (reference, clusterer) = match target.split_once('@') {
            Some((reference, clusterer)) => (reference, Some(clusterer)),
            None => (target, None),
        };
        if ![supervision, reference, clusterer.unwrap_or("-")]
            .into_iter()
            .all(is_name)
        {
            return Err(bad_key());
        }
        let unknown = || ExpectationError::Metric {
            key: key.to_owned(),
            metric: metric.to_owned(),
        };
        let metric = Metric::named(metric).ok_or_else(unknown)?;
        let clusterer = clusterer.map(str::to_owned);
        Ok(Self {
            supervision: supervision.to_owned(),
            reference: reference.to_owned(),
            clusterer,
            metric,
        })
    }
}

/// Whether the text may name a source or a clusterer.
fn is_name(text: &str) -> bool {
    !text.is_empty()
        && text
            .chars()
            .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

fn parse_bound(value: &str) -> Option<(Comparison, f64)> {
    // The longer symbols come first, so that `>=` is not read as `>`.
    let symbols = [
        (">=", Comparison::AtLeast),
        ("<=", Comparison::AtMost),
        (">", Comparison::Above),
        ("<", Comparison::Below),
    ];
    let value = value.trim();
    let (number, comparison) = symbols
        .into_iter()
        .find_map(|(symbol, comparison)| Some((value.strip_prefix(symbol)?, comparison)))?;
    let bound: f64 = number.trim().parse().ok()?;
    bound.is_finite().then_some((comparison, bound))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tables;
    use crate::tables::tests::{example, settings};

    fn trainings() -> TrainingFigures {
        TrainingFigures {
            untouched_tensors: BTreeMap::from([("step-parts".to_owned(), 3)]),
        }
    }

    #[test]
    fn tensors_that_no_gradient_reached_are_bounded() {
        let key = "step-parts.untouched_tensors";
        check(
            key,
            "<= 0",
            false,
            "missed: step-parts.untouched_tensors <= 0 (it is 3.0000)",
        );
        check(
            key,
            "< 4",
            true,
            "holds: step-parts.untouched_tensors < 4 (it is 3.0000)",
        );
        check_refused(
            "brep-face.untouched_tensors",
            "<= 0",
            "of which this run has no value",
        );
        let bounds = Expectations::parse([(key, "<= 0")]).unwrap();
        assert!(
            bounds.check_names(&["step-parts"], &[]).is_ok()
                && bounds.check_names(&["a"], &[]).is_err()
        );
    }

    #[track_caller]
    fn check(key: &str, bound: &str, passed: bool, shown: &str) {
        let tables = tables(&example(), &settings());
        let outcomes = Expectations::parse([(key, bound)])
            .unwrap()
            .evaluate(&tables, &trainings())
            .unwrap();
        assert_eq!(
            outcomes
                .iter()
                .map(|outcome| outcome.passed)
                .collect::<Vec<_>>(),
            [passed]
        );
        assert_eq!(outcomes[0].to_string(), shown);
    }

    #[test]
    fn scores_and_differences_are_bounded() {
        let key = "step-parts/step-parts.miou";
        check(
            key,
            ">= 0.625",
            true,
            "holds: step-parts/step-parts.miou >= 0.625 (it is 0.6250)",
        );
        check(
            key,
            ">0.625",
            false,
            "missed: step-parts/step-parts.miou > 0.625 (it is 0.6250)",
        );
        check(
            key,
            " <= 0.7",
            true,
            "holds: step-parts/step-parts.miou <= 0.7 (it is 0.6250)",
        );
        check(
            key,
            "< 0.5",
            false,
            "missed: step-parts/step-parts.miou < 0.5 (it is 0.6250)",
        );
        let key = "step-parts/step-parts.miou - untrained/step-parts@k-means.miou";
        check(
            key,
            ">= 0.4",
            false,
            &format!("missed: {key} >= 0.4 (it is 0.3750)"),
        );
        let key = "brep-face/step-parts.accuracy - no-network/step-parts.accuracy";
        check(
            key,
            "> -1",
            true,
            &format!("holds: {key} > -1 (it is 0.1250)"),
        );
    }

    #[track_caller]
    fn check_refused(key: &str, bound: &str, message: &str) {
        let tables = tables(&example(), &settings());
        let error = Expectations::parse([(key, bound)])
            .and_then(|bounds| bounds.evaluate(&tables, &trainings()))
            .unwrap_err();
        assert!(
            error.to_string().contains(message) && error.to_string().contains(key),
            "{error}"
        );
    }

    #[test]
    fn what_cannot_be_decided_is_refused_by_its_key() {
        for key in [
            "",
            "miou",
            "a/b",
            "a.miou",
            "/b.miou",
            "a/.miou",
            "A/b.miou",
            "a/b@.miou",
            "a/b.miou - ",
            "a/b.miou - c",
        ] {
            check_refused(key, ">= 0", "names no score");
        }
        check_refused(
            "a/b.iou",
            ">= 0",
            "asks for the metric `iou`; the metrics are miou, accuracy",
        );
        for bound in ["", "0.5", "= 0.5", "=> 0.5", ">= x", ">= NaN", ">= inf"] {
            check_refused("a/b.miou", bound, "write >=, >, <= or < and a number");
        }
        check_refused(
            "a/step-parts.miou",
            ">= 0",
            "this run does not have; it has step-parts/step-parts@k-means",
        );
        check_refused(
            "step-parts/step-parts@ward.miou",
            ">= 0",
            "step-parts/step-parts@ward",
        );
        check_refused(
            "no-network/step-parts.gtc_miou",
            ">= 0",
            "no-network/step-parts.gtc_miou`, of which this run",
        );
    }

    #[test]
    fn names_can_be_checked_before_any_work() {
        let bounds = Expectations::parse([("a/b.miou - c/b.miou", ">= 0")]).unwrap();
        assert_eq!(bounds.check_names(&["a", "c"], &["b"]), Ok(()));
        let error = bounds.check_names(&["a"], &["b"]).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("names `c`, which this run does not have; it has a"),
            "{error}"
        );
        assert!(bounds.check_names(&["a", "c"], &["x", "y"]).is_err());
    }
}
