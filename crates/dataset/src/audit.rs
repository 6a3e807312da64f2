//! Reads every carrier of a data set, and lists those that are not what was labeled.

use crate::{Dataset, DatasetError, IndexEntry};
use rayon::prelude::*;
use serde::Serialize;
use std::error::Error;

/// A carrier that is missing, damaged, changed, or that of another shape.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// The shape.
    pub id: String,
    /// What is wrong; the path of the file is named.
    pub reason: String,
}

/// What the look has found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Audit {
    /// Carriers that were read.
    pub n_read: usize,
    /// Carriers of which the index holds no hash, because an earlier program labeled them: a change of these is
    /// noticed only if they are no longer whole.
    pub n_without_hash: usize,
    /// Carriers that are not what was labeled, in the order of the index.
    pub damaged: Vec<Damage>,
}

impl Audit {
    /// Reads every carrier of a data set, and calls `after_each` after each of them, from any thread.
    #[must_use]
    pub fn of(dataset: &Dataset, after_each: impl Fn() + Sync) -> Self {
        let entries = dataset.labeled();
        let damage = |entry: &&IndexEntry| {
            let read = dataset.carrier(entry);
            after_each();
            let error = read.err()?;
            Some(Damage {
                id: entry.id.clone(),
                reason: in_one_line(&error),
            })
        };
        let damages: Vec<Option<Damage>> = entries.par_iter().map(damage).collect();
        Self {
            n_read: entries.len(),
            n_without_hash: entries
                .iter()
                .filter(|entry| entry.content_hash.is_none())
                .count(),
            damaged: damages.into_iter().flatten().collect(),
        }
    }
}

/// The error and its causes, as one line.
fn in_one_line(error: &DatasetError) -> String {
    let mut line = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        line.push_str(": ");
        line.push_str(&error.to_string());
        cause = error.source();
    }
    line
}
