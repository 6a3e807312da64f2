//! A look at every carrier of a data set: which of them are still what was labeled.

use super::{Dataset, IndexEntry};
use crate::progress::Progress;
use rayon::prelude::*;
use serde::Serialize;

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
    /// Reads every carrier of a data set.
    #[must_use]
    pub fn of(dataset: &Dataset, progress: &Progress) -> Self {
        let entries = dataset.labeled();
        let bar = progress.bar("check", entries.len());
        let damage = |entry: &&IndexEntry| {
            bar.inc(1);
            let error = dataset.carrier(entry).err()?;
            Some(Damage {
                id: entry.id.clone(),
                reason: format!("{error:#}"),
            })
        };
        let damages: Vec<Option<Damage>> = entries.par_iter().map(damage).collect();
        bar.finish_and_clear();
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
