//! Reads every carrier of a data set, and lists the carriers that differ from what was labeled.

use crate::{Dataset, DatasetError, IndexEntry};
use rayon::prelude::*;
use serde::Serialize;
use std::error::Error;

/// A carrier that is missing, damaged, changed, or belongs to another shape.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// The shape.
    pub id: String,
    /// What is wrong, with the path of the file.
    pub reason: String,
}

/// The result of an audit.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Audit {
    /// The number of carriers that were read.
    pub n_read: usize,
    /// The number of carriers without a hash in the index, because an earlier version of the program labeled them. A change of
    /// such a carrier is only noticed if it is no longer complete.
    pub n_without_hash: usize,
    /// Carriers that differ from what was labeled, in the order of the index.
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
