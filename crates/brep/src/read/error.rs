//! Describes why an entity cannot be read, with the `#` number of the innermost faulty entity.

use crate::geometry::BsplineError;
use crate::part21::ParamError;
use std::fmt;

/// An entity that cannot be read.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EntityError {
    /// The innermost faulty entity, if it is known.
    entity: Option<u64>,
    problem: Problem,
}

/// What is wrong with an entity.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum Problem {
    #[error("it is not in the file")]
    Missing,
    #[error("it is in another file, <{0}>, which is not read")]
    Elsewhere(String),
    #[error("{class} cannot be read as {} {expected}", article(expected))]
    Class {
        class: String,
        expected: &'static str,
    },
    #[error("{0}")]
    Param(ParamError),
    #[error("{0}")]
    Bspline(BsplineError),
    #[error("it nests too deep, or leads back to itself")]
    TooDeep,
    #[error("{0}")]
    Geometry(&'static str),
    #[error(
        "a solid by construction, {0}, is not evaluated; export the part as a boundary representation (B-Rep)"
    )]
    Construction(String),
    #[error("it names member {number} of a list of {n_members}")]
    NoMember { number: usize, n_members: usize },
    #[error("the budget of visits is spent")]
    OverBudget,
}

/// `a` or `an`, depending on the noun.
fn article(noun: &str) -> &'static str {
    if noun.starts_with(['a', 'e', 'i', 'o', 'u']) {
        "an"
    } else {
        "a"
    }
}

impl EntityError {
    /// The error, assigned to this entity unless it is already assigned to an entity inside it.
    pub(super) fn within(self, id: u64) -> Self {
        Self {
            entity: self.entity.or(Some(id)),
            ..self
        }
    }
}

impl EntityError {
    /// The description of the problem, for a list in which the entity `known` is already named.
    pub(super) fn reason(&self, known: u64) -> String {
        if self.entity == Some(known) {
            self.problem.to_string()
        } else {
            self.to_string()
        }
    }
}

impl fmt::Display for EntityError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.entity {
            Some(id) => write!(f, "#{id}: {}", self.problem),
            None => self.problem.fmt(f),
        }
    }
}

impl From<Problem> for EntityError {
    fn from(problem: Problem) -> Self {
        Self {
            entity: None,
            problem,
        }
    }
}

impl From<ParamError> for EntityError {
    fn from(error: ParamError) -> Self {
        Problem::Param(error).into()
    }
}

impl From<BsplineError> for EntityError {
    fn from(error: BsplineError) -> Self {
        Problem::Bspline(error).into()
    }
}
