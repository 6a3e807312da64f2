//! Loads the used shapes of a labeled data set, each with its points and its labels by every source.

use crate::config::Config;
use crate::label_sources::sources_named;
use crate::points::points_of;
use crate::source_rows::MeasuredSurface;
use anyhow::{Result, anyhow};
use partprobe_carrier::{Carrier, Descriptor, PointSample, ShapeKind, signature_of_carrier};
use partprobe_dataset::{CarrierRef, Dataset, IndexEntry};
use partprobe_eval::{CardRow, ShapeKey, SplitCandidate};
use partprobe_formats::mesh_hash;
use partprobe_sources::{BoxedSource, LabelSource, SourceLabels};
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A shape with its points and, for each label source, one label per point.
#[derive(Clone, Debug)]
pub(crate) struct Shape {
    pub(crate) id: String,
    /// Its points. There are none if they are drawn again each time that they are needed.
    pub(crate) sample: PointSample,
    /// The file of its carrier. Its hash is known.
    pub(crate) carrier: CarrierRef,
    /// The identity, which distinguishes it from other shapes.
    pub(crate) identity: ShapeIdentity,
    /// The group of related shapes. The split sets it.
    pub(crate) group: String,
    /// The data that the split needs.
    pub(crate) candidate: SplitCandidate,
    labels: BTreeMap<String, Vec<i32>>,
    /// The measures of the labels of each source. It is empty if the loader did not measure them.
    card_rows: Vec<CardRow>,
}

impl Shape {
    /// The same shape with other points in the same order.
    pub(super) fn with_sample(&self, sample: PointSample) -> Self {
        Self {
            sample,
            ..self.clone()
        }
    }

    /// The measures of the labels of each source.
    pub(super) fn card_rows(&self) -> impl Iterator<Item = &CardRow> {
        self.card_rows.iter()
    }

    /// The label of each point, by source.
    pub(crate) fn labels(&self) -> &BTreeMap<String, Vec<i32>> {
        &self.labels
    }

    /// The label of each point by a source.
    pub(crate) fn labels_by(&self, source: &str) -> Result<&[i32]> {
        let labels = self.labels.get(source);
        labels
            .map(Vec::as_slice)
            .ok_or_else(|| anyhow!("shape {} was not labeled by `{source}`", self.id))
    }
}

/// The identity of a shape, without its name.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct ShapeIdentity {
    /// The hash of the content of its carrier: mesh, faces, labels and settings.
    pub(crate) content_hash: String,
    /// The hash of only its mesh.
    pub(crate) mesh_hash: String,
    /// SHA-256 of the STEP text from which it was read.
    pub(crate) source_sha256: String,
    /// The `#` number of its solid, if solids are the unit.
    pub(crate) solid_step_id: Option<u64>,
    /// The hash of the labels that were imported for it, by source.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) imported: BTreeMap<String, String>,
}

/// If there are more reasons than this, only the most frequent ones are named. A wrong key of a label source may have a reason of its
/// own for each shape, with the name of the file.
const MAX_REASONS: usize = 12;
/// The number of reasons that are named then.
const MAX_NAMED_REASONS: usize = 3;

/// The number of used shapes, and the reasons why the others were left out.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
pub(crate) struct Selection {
    /// Labeled shapes of the data set. The key has the spelling that was always used in split.json.
    #[serde(rename = "labelled")]
    pub(crate) labeled: usize,
    /// Ids of the shapes that were left out, by reason.
    pub(crate) left_out: BTreeMap<String, Vec<String>>,
    /// The number of used shapes.
    pub(crate) taking_part: usize,
}

impl ShapeIdentity {
    /// The key by which a manifest recognizes the shape.
    pub(crate) fn key(&self) -> ShapeKey {
        ShapeKey {
            source_sha256: self.source_sha256.clone(),
            solid_step_id: self.solid_step_id,
        }
    }
}

impl Selection {
    /// The counts of a data set with this number of labeled shapes, of which none is left out.
    pub(crate) fn of(n_labeled: usize) -> Self {
        Self {
            labeled: n_labeled,
            taking_part: n_labeled,
            ..Self::default()
        }
    }

    /// Records that a shape is left out.
    pub(crate) fn leave_out(&mut self, reason: &str, id: &str) {
        self.left_out
            .entry(reason.to_owned())
            .or_default()
            .push(id.to_owned());
        self.taking_part -= 1;
    }
}

impl fmt::Display for Selection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} of {} labeled shapes take part",
            self.taking_part, self.labeled
        )?;
        let mut reasons: Vec<(&String, usize)> = self
            .left_out
            .iter()
            .map(|(reason, ids)| (reason, ids.len()))
            .collect();
        let mut others = Vec::new();
        if reasons.len() > MAX_REASONS {
            reasons.sort_by_key(|&(reason, n_shapes)| (Reverse(n_shapes), reason));
            others = reasons.split_off(MAX_NAMED_REASONS);
        }
        for (reason, n_shapes) in reasons {
            write!(f, "; {n_shapes} left out: {reason}")?;
        }
        if others.is_empty() {
            return Ok(());
        }
        let n_shapes: usize = others.iter().map(|(_, n_shapes)| n_shapes).sum();
        write!(
            f,
            "; {n_shapes} left out for {} other reasons",
            others.len()
        )
    }
}

/// The storage of the points of a shape between two uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Points {
    /// In memory.
    Kept,
    /// Not stored: they are drawn again from the carrier.
    Redrawn,
}

/// The reason why a shape is left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum ShapeRefusal {
    /// Its carrier is damaged, or not the one that was labeled.
    Unreadable(String),
    /// It was read, and the config leaves it out. The reason is a text that may be the same for many shapes.
    Unwanted(String),
    /// A label source cannot label it, or gives it only one label.
    BySource {
        /// The source.
        source: String,
        /// The reason.
        reason: String,
    },
}

impl ShapeRefusal {
    /// The reason in words.
    pub(crate) fn reason(&self) -> &str {
        match self {
            Self::Unreadable(reason) | Self::Unwanted(reason) | Self::BySource { reason, .. } => {
                reason
            }
        }
    }
}

/// The sources that a config names.
///
/// # Errors
/// If one is unknown.
pub(crate) fn named_sources(config: &Config) -> Result<Vec<BoxedSource>> {
    sources_named(config, &config.label_sources())
}

/// Makes shapes of the lines of a data set's index.
pub(crate) struct ShapeLoader<'a> {
    pub(crate) dataset: &'a Dataset,
    pub(crate) config: &'a Config,
    sources: Vec<BoxedSource>,
    points: Points,
    /// Whether the labels of each source are measured for the card.
    measures: bool,
}

impl<'a> ShapeLoader<'a> {
    /// A loader that labels by every source of the config.
    ///
    /// # Errors
    /// If a source is unknown.
    pub(crate) fn new(dataset: &'a Dataset, config: &'a Config, points: Points) -> Result<Self> {
        Ok(Self {
            dataset,
            config,
            sources: named_sources(config)?,
            points,
            measures: false,
        })
    }

    /// The same loader, which measures the labels of each source for the card.
    pub(crate) fn measuring(self) -> Self {
        Self {
            measures: true,
            ..self
        }
    }

    /// The same loader, restricted to sources with these names.
    pub(crate) fn with_sources(mut self, names: &[String]) -> Self {
        self.sources
            .retain(|source| names.iter().any(|name| name == source.name()));
        self
    }

    /// Samples a shape and labels its points, unless it has too few or too many parts.
    ///
    /// # Errors
    /// If the shape cannot be read, sampled or labeled, or the config leaves it out. Then the shape is not used.
    pub(crate) fn load(&self, entry: &IndexEntry) -> Result<Shape, ShapeRefusal> {
        let (carrier, file) = self.read(entry)?;
        let (n_parts, select) = (carrier.n_parts(), &self.config.select);
        // A mesh or a cloud without given labels has no parts to count. Other sources label it.
        let is_counted = carrier.kind() == ShapeKind::Brep || n_parts > 0;
        if is_counted && n_parts < select.min_parts {
            return Err(ShapeRefusal::Unwanted(format!(
                "fewer than {} parts",
                select.min_parts
            )));
        }
        if select.max_parts < n_parts {
            return Err(ShapeRefusal::Unwanted(format!(
                "more than {} parts",
                select.max_parts
            )));
        }
        self.shape(entry, &carrier, file)
    }

    /// The carrier of a shape, and its file with the hash of its content.
    fn read(&self, entry: &IndexEntry) -> Result<(Carrier, CarrierRef), ShapeRefusal> {
        let unreadable = |error: anyhow::Error| ShapeRefusal::Unreadable(format!("{error:#}"));
        let file = self
            .dataset
            .carrier_ref(entry)
            .map_err(|error| unreadable(error.into()))?;
        let (carrier, hash) = file.read().map_err(|error| unreadable(error.into()))?;
        Ok((
            carrier,
            CarrierRef {
                content_hash: Some(hash),
                ..file
            },
        ))
    }

    fn shape(
        &self,
        entry: &IndexEntry,
        carrier: &Carrier,
        file: CarrierRef,
    ) -> Result<Shape, ShapeRefusal> {
        let config = self.config;
        let sample = points_of(&entry.id, carrier, &config.sample);
        let sample = sample.map_err(|error| ShapeRefusal::Unwanted(error.to_string()))?;
        let mut labels = BTreeMap::new();
        let mut imported = BTreeMap::new();
        let measured = self.measures.then(|| MeasuredSurface::of(carrier));
        let mut card_rows = Vec::new();
        for source in &self.sources {
            let name = source.name().to_owned();
            let surface = surface_labels(source.as_ref(), carrier, config)?;
            if let Some(origin) = surface.origin() {
                imported.insert(name.clone(), origin.content_hash.clone());
            }
            let of_points = point_labels(&name, &surface, &sample)?;
            // The groups are not known before the split.
            card_rows.extend(measured.iter().map(|of| of.row(&name, &surface, &entry.id)));
            labels.insert(name, of_points);
        }
        let first_reference = config.references().into_iter().next().unwrap_or_default();
        let n_reference_parts = labels
            .get(&first_reference)
            .map_or(0, |labels| n_labels(labels));
        let candidate = SplitCandidate {
            id: entry.id.clone(),
            collection: collection(&entry.source, &config.split.collection_separator).to_owned(),
            n_parts: n_reference_parts,
            signature: signature_of_carrier(carrier),
            descriptor: Descriptor::of(carrier.mesh()),
        };
        let identity = ShapeIdentity {
            content_hash: file.content_hash.clone().unwrap_or_default(),
            mesh_hash: mesh_hash(carrier.mesh()).to_string(),
            source_sha256: carrier.meta().source_sha256.clone(),
            solid_step_id: entry.solid_step_id,
            imported,
        };
        let sample = if self.points == Points::Redrawn {
            PointSample::default()
        } else {
            sample
        };
        Ok(Shape {
            id: entry.id.clone(),
            group: entry.id.clone(),
            sample,
            carrier: file,
            identity,
            candidate,
            labels,
            card_rows,
        })
    }
}

/// The part of a file's name before the separator, or the whole name if it has no separator.
fn collection<'a>(source: &'a str, separator: &str) -> &'a str {
    let name = source.rsplit('/').next().unwrap_or(source);
    match name.split_once(separator) {
        Some((before, _)) if !before.is_empty() => before,
        _ => source,
    }
}

/// The labels of a shape by one source.
fn surface_labels(
    source: &dyn LabelSource,
    carrier: &Carrier,
    config: &Config,
) -> Result<SourceLabels, ShapeRefusal> {
    let name = source.name();
    let labels = source.labels(carrier, config.sample.seed);
    labels.map_err(|error| ShapeRefusal::BySource {
        source: name.to_owned(),
        reason: format!("`{name}`: {error}"),
    })
}

/// The points' labels by one source. A supervision with a single label is refused, because nothing can be learned from it.
fn point_labels(
    name: &str,
    labels: &SourceLabels,
    sample: &PointSample,
) -> Result<Vec<i32>, ShapeRefusal> {
    let unfit = |reason: String| ShapeRefusal::BySource {
        source: name.to_owned(),
        reason,
    };
    let labels = labels
        .label_of_points(sample)
        .map_err(|error| unfit(format!("`{name}`: {error}")))?;
    match n_labels(&labels) {
        0 | 1 => Err(unfit(format!("one label by `{name}`"))),
        _ => Ok(labels),
    }
}

/// The number of labels. Negative ones do not count.
pub(super) fn n_labels(labels: &[i32]) -> usize {
    let seen: BTreeSet<i32> = labels.iter().copied().filter(|&label| label >= 0).collect();
    seen.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_counted_without_negative_ones() {
        assert_eq!(n_labels(&[4, -1, 4, 0, -2]), 2);
    }

    #[test]
    fn many_reasons_are_counted() {
        let mut selection = Selection::of(30);
        for n in 0..2 {
            selection.leave_out("too few parts", &n.to_string());
        }
        assert_eq!(
            selection.to_string(),
            "28 of 30 labeled shapes take part; 2 left out: too few parts"
        );
        for n in 2..20 {
            selection.leave_out(&format!("{n:02}.csv: no column"), &n.to_string());
        }
        assert_eq!(
            selection.to_string(),
            "10 of 30 labeled shapes take part; 2 left out: too few parts; 1 left out: 02.csv: no column; 1 left out: 03.csv: no \
             column; 16 left out for 16 other reasons"
        );
    }

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
