//! Chooses the shapes of a data set that take part: the index goes in, shapes that differ come out, and why the others do
//! not take part.
//!
//! With `select.max_shapes` they are taken in an order that the seed and their ids decide, so that neither the order of
//! the index nor the number of threads has a say; no more carriers are read than that takes.

use super::shapes::{Selection, Shape, ShapeLoader, ShapeRefusal};
use crate::progress::Progress;
use anyhow::{Result, bail};
use partprobe_dataset::IndexEntry;
use partprobe_eval::{DistinctShapes, Duplicate, seeded_rank};
use rayon::prelude::*;

/// Why a shape does not take part that the manifest does not name.
pub(crate) const NOT_IN_MANIFEST: &str = "not in split.manifest";
/// Why a shape does not take part that comes after enough others.
const SURPLUS: &str = "beyond select.max_shapes";
/// So many carriers are read at once where not all of them may be wanted.
const N_AT_ONCE: usize = 64;
/// Damaged carriers are named up to this number, and counted beyond.
const MAX_NAMED: usize = 5;

/// The shapes that take part, and what became of the rest.
pub(crate) struct Choice {
    pub(crate) shapes: Vec<Shape>,
    pub(crate) selection: Selection,
}

/// Chooses the shapes of the loader's data set.
///
/// # Errors
/// If carriers are damaged, or are not those that were labeled; some are named.
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

/// Equal shapes stay among these; the split keeps the first id of each.
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

/// Takes shapes in this order until there are enough that differ.
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

/// A data set with carriers that are not its own is not trained on, not even without them: its index is not true.
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
