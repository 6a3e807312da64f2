//! Reads and writes `split.json`: the shapes for training, validation and test, the settings of the split, and the identity of
//! each shape.
//!
//! Once it exists in a run folder, it is an input: it is read and compared with the config and the carriers, and never written
//! again. So a training shape cannot become a test shape.

use super::folder::RunFolder;
use super::next_command::with_source_in_new_folder;
use super::shapes::{Selection, Shape, ShapeIdentity, ShapeLoader, ShapeRefusal};
use crate::config::{
    Config, LabelConfig, SampleConfig, SelectConfig, SplitConfig, are_same_place, differences,
    listed,
};
use crate::progress::Progress;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_carrier::hexadecimal;
use partprobe_dataset::IndexEntry;
use partprobe_eval::Split;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The file's name in the run folder.
const FILE: &str = "split.json";
/// Version 1 did not contain the settings and the carriers of a split. Version 2 grouped related shapes, and did not remove
/// nearly equal ones.
const FORMAT_VERSION: u32 = 3;

/// The advice for a damaged file. It cannot be made again, because other shapes could then become test shapes.
const DAMAGE_ADVICE: &str = "put back a copy of the file, or make a new run folder";

/// The content of the file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub(crate) struct SplitFile {
    format_version: u32,
    seed: u64,
    #[serde(flatten)]
    pub(crate) split: Split,
    pub(crate) selection: Selection,
    /// The tables of the config that determine the shapes and points.
    settings: SplitSettings,
    /// The label sources by which every shape has at least two labels.
    sources: Vec<String>,
    /// The identity of each shape on a side at the time of the split.
    shapes: BTreeMap<String, ShapeIdentity>,
    /// The number of test shapes that cannot be scored, because a source that was added later has no labels for them.
    #[serde(skip)]
    n_unscored: usize,
}

/// The tables of the config that determine the shapes and points.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
struct SplitSettings {
    label: LabelConfig,
    sample: SampleConfig,
    select: SelectConfig,
    split: SplitConfig,
}

impl SplitSettings {
    fn of(config: &Config) -> Self {
        Self {
            label: config.label.clone(),
            sample: config.sample.clone(),
            select: config.select.clone(),
            split: config.split.clone(),
        }
    }
}

/// A shape of the split that is not scored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LeftOut {
    id: String,
    reason: String,
}

/// Refuses a label source of a config that a run cannot train on, before the folder of the run is changed. A folder without a split
/// can train on every source.
///
/// # Errors
/// If the split in the folder does not know the source.
pub(crate) fn ensure_source_of_run(root: &Path, config: &Config, source: &str) -> Result<()> {
    #[derive(Deserialize)]
    struct Sources {
        sources: Vec<String>,
    }
    let text = fs::read(root.join(FILE)).ok();
    // A damaged split is reported by the stage that reads all of it.
    match text.and_then(|text| serde_json::from_slice::<Sources>(&text).ok()) {
        Some(split) => ensure_among(root, config, source, &split.sources),
        None => Ok(()),
    }
}

fn ensure_among(root: &Path, config: &Config, source: &str, known: &[String]) -> Result<()> {
    if known.iter().any(|known| known == source) {
        return Ok(());
    }
    let advice = match with_source_in_new_folder(root, config, source) {
        Ok(command) => format!("train it in a new run folder: {command}"),
        Err(_) => "name it in compare.supervision of a new run folder".to_owned(),
    };
    bail!(UsageError(format!(
        "`{source}` was not compared when this run's shapes were chosen (only {}), so some of them may have no labels by it; {advice}",
        known.join(", ")
    )))
}

#[derive(Deserialize)]
struct Version {
    format_version: u32,
}

impl SplitFile {
    /// A new split with the shapes on its sides.
    pub(crate) fn new(
        config: &Config,
        split: Split,
        selection: Selection,
        shapes: &[Shape],
    ) -> Self {
        let is_on_a_side = |shape: &&Shape| split.group_of(&shape.id).is_some();
        let on_a_side = shapes.iter().filter(is_on_a_side);
        Self {
            format_version: FORMAT_VERSION,
            seed: config.split.seed,
            shapes: on_a_side
                .map(|shape| (shape.id.clone(), shape.identity.clone()))
                .collect(),
            split,
            selection,
            settings: SplitSettings::of(config),
            sources: config.label_sources(),
            n_unscored: 0,
        }
    }

    /// The split of a run folder. Returns `None` if it has none yet.
    ///
    /// # Errors
    /// If another version wrote it, it is damaged, or the config has other settings than those of the split.
    pub(crate) fn read(folder: &RunFolder, config: &Config) -> Result<Option<Self>> {
        let path = folder.path(FILE);
        if !path.exists() {
            return Ok(None);
        }
        let of_another_version = || {
            format!(
                "{} was written by another version of partprobe; use that version, or make a new run folder",
                path.display()
            )
        };
        let version: Version = folder.read_json(FILE, DAMAGE_ADVICE)?;
        ensure!(
            version.format_version == FORMAT_VERSION,
            of_another_version()
        );
        let file: Self = folder.read_json(FILE, DAMAGE_ADVICE)?;
        let mut differing = differences(&SplitSettings::of(config), &file.settings);
        differing.retain(|difference| !are_same_place(&difference.here, &difference.there));
        ensure!(
            differing.is_empty(),
            UsageError(format!(
                "{} was made with other settings: {}; they cannot change in a run, make a new run folder for others",
                path.display(),
                listed(&differing)
            ))
        );
        Ok(Some(file))
    }

    /// Writes a new split.
    ///
    /// # Errors
    /// If the folder already has one, has trainings without one, or the file cannot be written.
    pub(crate) fn write(&self, folder: &RunFolder) -> Result<()> {
        for (made, what) in [
            (FILE, "a split"),
            ("checkpoints", "trainings without their split.json"),
        ] {
            ensure!(
                !folder.path(made).exists(),
                "{} has {what}; make a new run folder",
                folder.root().display()
            );
        }
        folder.write_json(FILE, self)
    }

    /// Refuses to train on a source that the split does not know, because the source may give some training shapes only one
    /// label.
    ///
    /// # Errors
    /// If it does not know the source.
    pub(crate) fn ensure_source(&self, root: &Path, config: &Config, source: &str) -> Result<()> {
        ensure_among(root, config, source, &self.sources)
    }

    /// The label sources by which every shape on a side has at least two labels.
    pub(crate) fn sources(&self) -> &[String] {
        &self.sources
    }

    /// Leaves out test shapes that [`SplitFile::load`] has left out. The file itself is not changed.
    pub(crate) fn leave_out_of_test(&mut self, left_out: &[LeftOut]) -> Result<()> {
        for LeftOut { id, reason } in left_out {
            self.selection.leave_out(reason, id);
            self.split.test.retain(|test| test != id);
        }
        self.n_unscored += left_out.len();
        ensure!(
            !self.split.test.is_empty(),
            "no test shape is left ({})",
            self.selection
        );
        Ok(())
    }

    /// The number of held-out shapes, including those that cannot be scored.
    pub(crate) fn n_test_shapes(&self) -> usize {
        self.split.test.len() + self.n_unscored
    }

    /// Twelve digits of the hash of all shapes on a side, including the content of their carriers.
    pub(crate) fn data_hash(&self) -> String {
        let mut digest = Sha256::new();
        for (id, identity) in &self.shapes {
            digest.update(format!("{id}\n{}\n", identity.content_hash));
        }
        let mut text = hexadecimal(&digest.finalize());
        text.truncate(12);
        text
    }

    /// The identity of a shape at the time of the split.
    pub(crate) fn identity(&self, id: &str) -> Result<&ShapeIdentity> {
        self.shapes
            .get(id)
            .with_context(|| format!("split.json does not say what {id} was"))
    }

    /// Loads shapes of the split. If a source that the split does not know gives a shape a single label, the shape is left out
    /// with a reason.
    ///
    /// # Errors
    /// If a shape is missing, or its carrier is not the one of the split.
    pub(crate) fn load<'a>(
        &self,
        loader: &ShapeLoader<'_>,
        ids: impl Iterator<Item = &'a String>,
        progress: &Progress,
    ) -> Result<(Vec<Shape>, Vec<LeftOut>)> {
        let entries: BTreeMap<&str, &IndexEntry> = loader
            .dataset
            .labeled()
            .into_iter()
            .map(|entry| (entry.id.as_str(), entry))
            .collect();
        let ids: Vec<&String> = ids.collect();
        let bar = progress.bar("sample", ids.len());
        let load = |id: &&String| {
            bar.inc(1);
            self.load_one(loader, &entries, id)
                .with_context(|| format!("shape {id}"))
        };
        let loaded: Vec<Result<Shape, String>> = ids.par_iter().map(load).collect::<Result<_>>()?;
        bar.finish();
        let mut shapes = Vec::new();
        let mut left_out = Vec::new();
        for (id, loaded) in ids.into_iter().zip(loaded) {
            match loaded {
                Ok(shape) => shapes.push(shape),
                Err(reason) => left_out.push(LeftOut {
                    id: id.clone(),
                    reason,
                }),
            }
        }
        Ok((shapes, left_out))
    }

    fn load_one(
        &self,
        loader: &ShapeLoader<'_>,
        entries: &BTreeMap<&str, &IndexEntry>,
        id: &str,
    ) -> Result<Result<Shape, String>> {
        let advice = "give the run's own data set with --data, or make a new run folder";
        let entry = entries
            .get(id)
            .with_context(|| format!("the data set lacks it; {advice}"))?;
        let mut shape = match loader.load(entry) {
            Ok(shape) => shape,
            Err(ShapeRefusal::BySource { source, reason }) if !self.sources.contains(&source) => {
                return Ok(Err(reason));
            }
            Err(unfit) => bail!("{}; {advice}", unfit.reason()),
        };
        let (was, is) = (
            &self.identity(id)?.content_hash,
            &shape.identity.content_hash,
        );
        ensure!(
            was == is,
            "its carrier is not the one that this run was split with (hash {is}, not {was}), so it was labeled again \
             meanwhile, or the data set is another; {advice}"
        );
        for (source, was) in &self.identity(id)?.imported {
            let is = shape.identity.imported.get(source);
            ensure!(
                is.is_none_or(|is| is == was),
                "its labels by `{source}` are not those that this run was split with, so the label files have changed; \
                 put the former files back, or make a new run folder"
            );
        }
        shape.group = self.split.group_of(id).unwrap_or(id).to_owned();
        Ok(Ok(shape))
    }
}
