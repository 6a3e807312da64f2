//! Chooses the shapes of a run from a data set: the index goes in, and different shapes come out, with the reasons why the others
//! are left out.
//!
//! With `select.max_shapes`, shapes are taken in a random order that depends on the seed and their ids. So the choice does not
//! depend on the order of the index or the number of threads. Only the necessary carriers are read.

use super::shapes::{Selection, Shape, ShapeLoader, ShapeRefusal};
use crate::progress::Progress;
use anyhow::{Result, bail};
use partprobe_dataset::IndexEntry;
use partprobe_eval::{DistinctShapes, Duplicate, seeded_rank};
use rayon::prelude::*;

/// The reason for a shape that the manifest does not name.
pub(crate) const NOT_IN_MANIFEST: &str = "not in split.manifest";
/// The reason for a shape that comes after enough others.
const SURPLUS: &str = "beyond select.max_shapes";
/// The number of carriers that are read at once, if perhaps not all carriers are needed.
const N_AT_ONCE: usize = 64;
/// The largest number of damaged carriers that are named. Further ones are only counted.
const MAX_NAMED: usize = 5;

/// The chosen shapes, and the reasons for the other ones.
pub(crate) struct Choice {
    pub(crate) shapes: Vec<Shape>,
    pub(crate) selection: Selection,
}

/// Chooses the shapes of the loader's data set.
///
/// # Errors
/// If carriers are damaged, or are not those that were labeled. Some of them are named.
pub(crate) fn choose(loader: &ShapeLoader<'_>, progress: &Progress) -> Result<Choice> {
    let mut entries = loader.dataset.labeled();
    let n_most = loader.config.select.max_shapes;
    if n_most == 0 {
        return choose_all(loader, &entries, progress);
    }
    let seed = loader.config.split.seed;
    entries.sort_by_cached_key(|entry| (seeded_rank(seed, &entry.id), entry.id.clone()));
    choose_first(loader, &entries, n_most, progress)
}

/// Chooses all shapes. Equal shapes are not removed here. The split keeps the first id of each.
fn choose_all(
    loader: &ShapeLoader<'_>,
    entries: &[&IndexEntry],
    progress: &Progress,
) -> Result<Choice> {
    let bar = progress.bar("sample", entries.len());
    let load = |entry: &&IndexEntry| {
        bar.inc(1);
        loader.load(entry)
    };
    let loaded: Vec<Result<Shape, ShapeRefusal>> = entries.par_iter().map(load).collect();
    bar.finish();
    refuse_damage(entries, &loaded)?;
    let mut choice = Choice {
        shapes: Vec::new(),
        selection: Selection::of(entries.len()),
    };
    for (entry, shape) in entries.iter().zip(loaded) {
        match shape {
            Ok(shape) => choice.shapes.push(shape),
            Err(unfit) => choice.selection.leave_out(unfit.reason(), &entry.id),
        }
    }
    Ok(choice)
}

/// Takes shapes in this order until there are enough different ones.
fn choose_first(
    loader: &ShapeLoader<'_>,
    entries: &[&IndexEntry],
    n_most: usize,
    progress: &Progress,
) -> Result<Choice> {
    let bar = progress.bar("sample", n_most);
    let mut choice = Choice {
        shapes: Vec::new(),
        selection: Selection::of(entries.len()),
    };
    let mut distinct = DistinctShapes::default();
    for chunk in entries.chunks(N_AT_ONCE) {
        let is_enough = choice.shapes.len() == n_most;
        let loaded: Vec<Result<Shape, ShapeRefusal>> = if is_enough {
            Vec::new()
        } else {
            chunk.par_iter().map(|entry| loader.load(entry)).collect()
        };
        refuse_damage(chunk, &loaded)?;
        let mut loaded = loaded.into_iter();
        for entry in chunk {
            let shape = loaded.next().filter(|_| choice.shapes.len() < n_most);
            match shape {
                None => choice.selection.leave_out(SURPLUS, &entry.id),
                Some(Err(unfit)) => choice.selection.leave_out(unfit.reason(), &entry.id),
                Some(Ok(shape))
                    if distinct
                        .add(&shape.id, &shape.candidate.signature)
                        .is_some() =>
                {
                    choice.selection.leave_out(Duplicate::REASON, &entry.id);
                }
                Some(Ok(shape)) => choice.shapes.push(shape),
            }
        }
        bar.set_position(choice.shapes.len() as u64);
    }
    bar.finish();
    Ok(choice)
}

/// Refuses a data set with carriers that are not its own, even if they could be left out, because its index is wrong.
fn refuse_damage(entries: &[&IndexEntry], loaded: &[Result<Shape, ShapeRefusal>]) -> Result<()> {
    let damages = entries
        .iter()
        .zip(loaded)
        .filter_map(|(entry, shape)| match shape {
            Err(ShapeRefusal::Unreadable(reason)) => Some(format!("{}: {reason}", entry.id)),
            _ => None,
        });
    let damages: Vec<String> = damages.collect();
    if damages.is_empty() {
        return Ok(());
    }
    let named = damages
        .iter()
        .take(MAX_NAMED)
        .map(String::as_str)
        .collect::<Vec<_>>()
        .join("; ");
    let n_more = damages.len().saturating_sub(MAX_NAMED);
    let more = if n_more > 0 {
        format!("; and {n_more} more")
    } else {
        String::new()
    };
    bail!("carriers of the data set cannot be used: {named}{more}")
}
