//! From a labelled data set to the shapes that take part, each with its points and its labels by every source.

use crate::config::Config;
use crate::dataset::{Dataset, IndexEntry};
use crate::progress::Progress;
use crate::sample::points_of;
use anyhow::{Result, anyhow};
use carrier::{Carrier, PointSample};
use eval::{SplitCandidate, signature};
use rayon::prelude::*;
use serde::Serialize;
use sources::{LabelSource, source_named};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// A shape with its points and, for each label source, a label for each point.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) id: String,
    /// Its points; none where they are drawn again when they are wanted.
    pub(crate) sample: PointSample,
    /// The file of its carrier.
    pub(crate) carrier: PathBuf,
    /// The group of related shapes; the split fills it in.
    pub(crate) group: String,
    /// What the split must know of it.
    pub(crate) candidate: SplitCandidate,
    labels: BTreeMap<String, Vec<i32>>,
}

impl Shape {
    /// The label of each point, by source.
    pub(crate) fn labels(&self) -> &BTreeMap<String, Vec<i32>> {
        &self.labels
    }

    /// The label of each point by a source.
    pub(crate) fn labels_by(&self, source: &str) -> Result<&[i32]> {
        let labels = self.labels.get(source);
        labels.map(Vec::as_slice).ok_or_else(|| anyhow!("shape {} was not labelled by `{source}`", self.id))
    }
}

/// How many shapes are left, and why the others went.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Selection {
    /// Labelled shapes of the data set.
    pub(crate) labelled: usize,
    /// Ids of the shapes that went, by reason.
    pub(crate) left_out: BTreeMap<String, Vec<String>>,
    /// Shapes that take part.
    pub(crate) taking_part: usize,
}

impl Selection {
    /// Notes that a shape does not take part.
    pub(crate) fn leave_out(&mut self, reason: &str, id: &str) {
        self.left_out.entry(reason.to_owned()).or_default().push(id.to_owned());
        self.taking_part -= 1;
    }
}

/// Where the points of a shape are between two uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Points {
    /// In memory.
    Kept,
    /// Nowhere: the carrier gives them again.
    Redrawn,
}

type Verdict = Result<Shape, String>;
type Sources = Vec<Box<dyn LabelSource + Send + Sync>>;

/// The sources that a config names.
///
/// # Errors
/// If one is unknown.
pub(crate) fn named_sources(config: &Config) -> Result<Sources> {
    config.references().iter().map(|name| Ok(source_named(name)?)).collect()
}

/// Samples every shape of the data set and labels its points by every source, in the order of the data set.
///
/// # Errors
/// If a source is unknown. A shape that cannot be read, sampled or labelled is left out and named.
pub(crate) fn load_shapes(
    dataset: &Dataset,
    config: &Config,
    progress: &Progress,
    points: Points,
) -> Result<(Vec<Shape>, Selection)> {
    let label_sources = named_sources(config)?;
    let entries = dataset.labelled();
    let bar = progress.bar("sample", entries.len());
    let verdicts: Vec<Verdict> = entries
        .par_iter()
        .map(|entry| {
            bar.inc(1);
            let unreadable = |error: anyhow::Error| format!("unreadable carrier: {error:#}");
            let carrier = dataset.carrier(entry).map_err(unreadable)?;
            let mut shape = judge(entry, &carrier, config, &label_sources)?;
            shape.carrier = dataset.path_of(entry, entry.file.as_deref().unwrap_or_default()).map_err(unreadable)?;
            if points == Points::Redrawn {
                shape.sample = PointSample::default();
            }
            Ok(shape)
        })
        .collect();
    bar.finish();
    let mut selection = Selection { labelled: entries.len(), taking_part: entries.len(), ..Selection::default() };
    let mut shapes = Vec::new();
    for (entry, verdict) in entries.iter().zip(verdicts) {
        match verdict {
            Ok(shape) => shapes.push(shape),
            Err(reason) => selection.leave_out(&reason, &entry.id),
        }
    }
    Ok((shapes, selection))
}

/// The shape, or why it does not take part.
fn judge(entry: &IndexEntry, carrier: &Carrier, config: &Config, label_sources: &Sources) -> Verdict {
    let n_parts = carrier.n_labels();
    if n_parts < config.select.min_parts {
        return Err(format!("fewer than {} parts", config.select.min_parts));
    }
    if config.select.max_parts < n_parts {
        return Err(format!("more than {} parts", config.select.max_parts));
    }
    let sample = points_of(&entry.id, carrier, &config.sample).map_err(|error| error.to_string())?;
    let mut labels = BTreeMap::new();
    for source in label_sources {
        labels.insert(source.name().to_owned(), point_labels(source.as_ref(), carrier, &sample, config)?);
    }
    let candidate = SplitCandidate {
        id: entry.id.clone(),
        source_file: collection(&entry.source, &config.split.collection_separator).to_owned(),
        product: entry.product.clone(),
        signature: signature(carrier.graph(), carrier.mesh()),
    };
    Ok(Shape { id: entry.id.clone(), group: entry.id.clone(), sample, carrier: PathBuf::new(), candidate, labels })
}

/// What a file's name begins with before the separator; the file itself where the name does not hold it.
fn collection<'a>(source: &'a str, separator: &str) -> &'a str {
    let name = source.rsplit('/').next().unwrap_or(source);
    match name.split_once(separator) {
        Some((before, _)) if !before.is_empty() => before,
        _ => source,
    }
}

/// The points' labels by one source; a supervision with a single label teaches nothing and scores nothing.
fn point_labels(
    source: &dyn LabelSource,
    carrier: &Carrier,
    sample: &PointSample,
    config: &Config,
) -> Result<Vec<i32>, String> {
    let name = source.name();
    let labels = source.labels(carrier, config.sample.seed).map_err(|error| format!("`{name}`: {error}"))?;
    let labels = labels.label_of_points(sample).map_err(|error| format!("`{name}`: {error}"))?;
    let n_seen = labels.iter().filter(|&&label| label >= 0).collect::<BTreeSet<_>>().len();
    match n_seen {
        0 | 1 => Err(format!("one label by `{name}`")),
        _ => Ok(labels),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_collection_is_what_stands_before_the_separator() {
        for (source, separator, expected) in [
            ("a/me+tools__bolt.step", "__", "me+tools"),
            ("me+tools__bolt.step/nut__2.stp", "__", "nut"),
            ("a/bolt.step", "__", "a/bolt.step"),
            ("a/__bolt.step", "__", "a/__bolt.step"),
            ("a/me__bolt.step", "", "a/me__bolt.step"),
        ] {
            assert_eq!(collection(source, separator), expected);
        }
    }
}
