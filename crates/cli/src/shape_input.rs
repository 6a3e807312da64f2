//! Opens the shapes that commands such as `export`, `render` and `compare` read. Data sets and carrier files are read directly.
//! All other inputs of `label` are labeled first, into a folder that is deleted afterwards.

use crate::config::{self, Config, Emit};
use crate::counted::counted;
use crate::dataset_settings::settings_sha256_of;
use crate::given_path::{distinct_paths, ensure_exists};
use crate::interrupt::Interrupt;
use crate::label::{LabelJob, StoppedBatch, label_paths, warn_of_repeated, warn_of_unread};
use crate::standard_input::{STDIN_NAME, StandardInput, is_standard_input, with_standard_input};
use crate::usage::UsageError;
use anyhow::{Context, Result, anyhow, bail, ensure};
use partprobe_carrier::Carrier;
use partprobe_dataset::{CarrierRef, Dataset, IndexEntry, SETTINGS_FILE, Status};
use partprobe_formats::arrays_from_npz;
use partprobe_imports::is_given_name;
use partprobe_label::Unit;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// The arguments that name the shapes.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ShapeArgs {
    /// Data sets, folders of `predict`, and carrier files (.npz), or anything that `label` reads: STEP files, meshes, point clouds,
    /// folders, lists, archives; `-` is the standard input.
    #[arg(required = true, value_name = "PATH")]
    pub(crate) paths: Vec<PathBuf>,
    /// The number of threads; one per core if not given. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Settings for STEP files, which are labeled first: a shipped config or a file. They do not change data sets.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting for STEP files, for example label.unit=solid.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The verb's own settings for inputs that are labeled first. The user's settings have priority.
    #[arg(skip)]
    own_settings: Vec<String>,
    /// Whether the settings decide more than the labeling of files.
    #[arg(skip)]
    for_more_than_labeling: bool,
}

/// The same arguments for verbs whose positional arguments are other names. The paths follow `--data`.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct DataArgs {
    /// Data sets and carrier files (.npz), or anything that `label` reads: STEP files, folders, lists, archives; `-` is the
    /// standard input.
    #[arg(long = "data", value_name = "PATH", num_args = 1..)]
    pub(crate) paths: Vec<PathBuf>,
    /// The number of threads; one per core if not given. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// The settings for labeling STEP files, and the imported label sources: a shipped config or a file.
    #[arg(long, default_value = "base", value_name = "FILE")]
    config: String,
    /// Change one setting, for example label.unit=solid or `sources.mine.path=seg/`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl DataArgs {
    /// The same arguments for [`ShapeArgs::open`].
    #[must_use]
    pub(crate) fn shape_args(&self) -> ShapeArgs {
        ShapeArgs {
            paths: self.paths.clone(),
            jobs: self.jobs,
            config: self.config.clone(),
            set: self.set.clone(),
            own_settings: Vec::new(),
            for_more_than_labeling: false,
        }
    }

    /// Checks the command line, without reading any shapes.
    ///
    /// # Errors
    /// If there is no path, or a path does not exist.
    pub(crate) fn check(&self) -> Result<()> {
        ensure!(
            !self.paths.is_empty(),
            UsageError("give the shapes with --data, for example --data dataset/".to_owned())
        );
        ensure_all_exist(&self.paths)?;
        Ok(())
    }

    /// The settings, with which STEP files are labeled and in which imported sources are named.
    ///
    /// # Errors
    /// If the config cannot be read, or a setting is wrong.
    pub(crate) fn settings(&self) -> Result<Config> {
        Ok(config::load(&self.config, &self.set)?.config)
    }
}

impl ShapeArgs {
    /// The shapes of one path, with the settings of the config `base`.
    #[must_use]
    pub(crate) fn of_path(path: &Path, n_threads: usize) -> Self {
        Self {
            paths: vec![path.to_owned()],
            jobs: u16::try_from(n_threads).ok(),
            config: "base".to_owned(),
            set: Vec::new(),
            own_settings: Vec::new(),
            for_more_than_labeling: true,
        }
    }

    /// The number of threads to use.
    #[must_use]
    pub(crate) fn n_threads(&self) -> usize {
        self.jobs.map_or_else(
            || std::thread::available_parallelism().map_or(1, usize::from),
            usize::from,
        )
    }

    /// The same, with settings for inputs that are labeled on the way. The user's own settings have priority.
    #[must_use]
    pub(crate) fn with_settings(&self, settings: impl IntoIterator<Item = String>) -> Self {
        let mut with = self.clone();
        with.own_settings.extend(settings);
        with
    }

    /// The same, where the user's settings may also be given if nothing is labeled.
    #[must_use]
    pub(crate) fn for_more_than_labeling(self) -> Self {
        Self {
            for_more_than_labeling: true,
            ..self
        }
    }

    /// The settings of the user.
    #[must_use]
    pub(crate) fn settings(&self) -> &[String] {
        &self.set
    }

    /// Checks the command line, without reading any shapes.
    ///
    /// # Errors
    /// If a path does not exist, a setting is wrong, or a setting is given where nothing is labeled.
    pub(crate) fn check(&self) -> Result<()> {
        let config = config::load(&self.config, &self.set)?.config;
        ensure_all_exist(&self.paths)?;
        let is_idle = self.set.is_empty() && self.config == "base";
        ensure!(
            is_idle
                || self.for_more_than_labeling
                || !config.sources.is_empty()
                || self.paths.iter().any(|path| needs_labeling(path)),
            UsageError(
                "--config and --set act on labeling, and all that is given is labeled already"
                    .to_owned()
            )
        );
        Ok(())
    }

    /// The pool with the requested number of threads.
    ///
    /// # Errors
    /// If they cannot be started.
    pub(crate) fn thread_pool(&self) -> Result<ThreadPool> {
        ThreadPoolBuilder::new()
            .num_threads(self.n_threads())
            .build()
            .context("starting threads")
    }

    /// Finds the shapes. Inputs that must be labeled first are written into a temporary folder, which is named after `verb` and
    /// removed later.
    ///
    /// # Errors
    /// As for [`open`](Self::open).
    pub(crate) fn open_for(&self, verb: &str, interrupt: &Interrupt) -> Result<ShapeInputs> {
        let name = format!("partprobe-{verb}-{}", std::process::id());
        self.open(&std::env::temp_dir().join(name), interrupt)
    }

    /// Finds the shapes. If something must be labeled first, `scratch` is made, and removed later.
    ///
    /// # Errors
    /// If a path does not exist, a data set is damaged, two shapes share an id, or there is no shape.
    pub(crate) fn open(&self, scratch: &Path, interrupt: &Interrupt) -> Result<ShapeInputs> {
        let settings = [self.own_settings.as_slice(), &self.set].concat();
        let mut config = config::load(&self.config, &settings)?.config;
        config.label.emit = vec![Emit::Carrier];
        let mut sources = ShapeInputs {
            _scratch: Some(Scratch(scratch.to_owned())),
            ..ShapeInputs::default()
        };
        let max_bytes = config.label.max_file_mb << 20;
        let (paths, input) = with_standard_input(&self.paths, STDIN_NAME, max_bytes)?;
        sources._standard_input = input;
        // `label` has its own rule for repeated paths of files and folders, because ids depend on how they are written.
        let (to_label, others): (Vec<PathBuf>, Vec<PathBuf>) =
            paths.into_iter().partition(|path| needs_labeling(path));
        let (paths, repeated) = distinct_paths(&others);
        warn_of_repeated(&repeated);
        for path in &paths {
            if points_of_carrier(path).is_some_and(|carrier| paths.contains(&carrier)) {
                // `*.npz` in a folder of `predict` names both files of a shape.
                continue;
            }
            if is_dataset(path) {
                sources.add_dataset(&Dataset::open(path)?);
            } else if is_predictions(path) {
                sources.add_predictions(path)?;
            } else {
                sources.shapes.push(ShapeInput::carrier_file(path));
            }
        }
        // `label` reads meshes and clouds in a call of their own.
        let (given, others): (Vec<PathBuf>, Vec<PathBuf>) = to_label
            .into_iter()
            .partition(|path| is_mesh_or_cloud(path));
        let has_both = !given.is_empty() && !others.is_empty();
        for (group, name) in [(others, "step"), (given, "meshes")] {
            let folder = if has_both {
                &scratch.join(name)
            } else {
                scratch
            };
            if !group.is_empty() {
                sources.label(&group, folder, &config, self.n_threads(), interrupt)?;
            }
        }
        sources.refuse_equal_ids()?;
        ensure!(
            !sources.shapes.is_empty(),
            "no shape has a carrier{}",
            sources
                .failed
                .first()
                .map_or_else(String::new, |first| format!(
                    "; {}: {}",
                    first.id, first.reason
                ))
        );
        Ok(sources)
    }
}

/// Checks that each path exists, or is the standard input.
fn ensure_all_exist(paths: &[PathBuf]) -> Result<(), UsageError> {
    let mut files = paths.iter().filter(|path| !is_standard_input(path));
    files.try_for_each(|path| ensure_exists(path))
}

/// Whether a path is neither a data set, nor the folder of predictions, nor a carrier file.
fn needs_labeling(path: &Path) -> bool {
    !is_dataset(path)
        && !is_predictions(path)
        && (path.is_dir() || path.extension().is_none_or(|extension| extension != "npz"))
}

/// Whether a path is a file with a mesh or a cloud, by its name. A text file may also be a list of paths.
fn is_mesh_or_cloud(path: &Path) -> bool {
    let is_text = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("txt"));
    path.is_file() && !is_text && is_given_name(&path.to_string_lossy())
}

/// Whether `label` wrote the folder, finished or not.
fn is_dataset(path: &Path) -> bool {
    Dataset::is_at(path) || path.join(SETTINGS_FILE).is_file()
}

/// The file of an export with its settings. It is written first, and distinguishes an export from other folders.
pub(crate) const EXPORT_FILE: &str = "export.json";
/// The file of an export that lists the shapes. It is written last, so a folder that has it is complete.
pub(crate) const SHAPES_FILE: &str = "shapes.jsonl";
/// The format of an export by `predict`: carriers with a further layer.
pub(crate) const PREDICTIONS: &str = "predictions";
/// The ending of a file of `predict` with points. It is not a carrier.
const POINTS_ENDING: &str = ".points.npz";

/// Whether `predict` wrote the folder.
fn is_predictions(path: &Path) -> bool {
    #[derive(Deserialize)]
    struct Export {
        format: String,
    }
    let text = fs::read(path.join(EXPORT_FILE)).ok();
    let export = text.and_then(|text| serde_json::from_slice::<Export>(&text).ok());
    export.is_some_and(|export| export.format == PREDICTIONS)
}

/// The carrier of a shape whose predicted points are in this file.
fn points_of_carrier(path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?.strip_suffix(POINTS_ENDING)?;
    Some(path.with_file_name(format!("{name}.npz")))
}

/// A line of `shapes.jsonl` of `predict`.
#[derive(Deserialize)]
struct PredictedShape {
    id: String,
    source: String,
    files: Vec<String>,
    reason: Option<String>,
}

impl PredictedShape {
    /// The shape with its carrier, or the reason why there is none.
    fn shape(&self, folder: &Path) -> Result<ShapeInput, String> {
        let is_carrier = |file: &&String| file.ends_with(".npz") && !file.ends_with(POINTS_ENDING);
        let file = self.files.iter().find(is_carrier).ok_or_else(|| {
            let reason = self.reason.as_deref();
            reason.unwrap_or("it has no carrier").to_owned()
        })?;
        let stem = Path::new(file).with_extension("");
        let is_inside = stem
            .components()
            .all(|part| matches!(part, Component::Normal(_)));
        if !is_inside {
            return Err(format!("`{file}` points outside the folder"));
        }
        Ok(ShapeInput {
            id: self.id.clone(),
            source: self.source.clone(),
            stem,
            ..ShapeInput::carrier_file(&folder.join(file))
        })
    }
}

/// A shape whose carrier can be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ShapeInput {
    /// The shape's id.
    pub(crate) id: String,
    /// The name of the file from which it was read. For a carrier file, it is the hash of that file.
    pub(crate) source: String,
    /// The name of its product, if the file names one.
    pub(crate) product: Option<String>,
    /// The path of its files in an export, without endings: the data set's folder for it, and the id.
    pub(crate) stem: PathBuf,
    /// The number of parts after small ones were absorbed, if the index has it.
    pub(crate) n_labels: Option<usize>,
    /// The `#` number of the solid, if the shape is one.
    pub(crate) solid_step_id: Option<u64>,
    /// The hash of the settings with which its data set was labeled. A single carrier file has none.
    pub(crate) settings_sha256: Option<Arc<str>>,
    /// The unit of shapes, if it is in a data set.
    pub(crate) unit: Option<Unit>,
    /// The carrier's file, with the expected hash.
    carrier: CarrierRef,
}

impl ShapeInput {
    /// The shape of a single carrier file.
    fn carrier_file(path: &Path) -> Self {
        let id = path.file_stem().map_or_else(
            || "shape".to_owned(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        let carrier = CarrierRef::alone(path);
        Self {
            stem: PathBuf::from(&id),
            source: id.clone(),
            id,
            product: None,
            n_labels: None,
            solid_step_id: None,
            settings_sha256: None,
            unit: None,
            carrier,
        }
    }

    /// Reads the carrier.
    ///
    /// # Errors
    /// If the file cannot be read, is not a carrier, or is not the one of its data set.
    pub(crate) fn carrier(&self) -> Result<Carrier> {
        match self.carrier.read() {
            Ok((carrier, _)) => Ok(carrier),
            Err(_) if self.has_points_alone() => bail!(
                "it has points and no mesh; `embed` reads such a file, and all other verbs read points as PLY (`sample --format \
                 ply`)"
            ),
            Err(error) => Err(error.into()),
        }
    }

    /// Whether the file is not a carrier, but has a sample of points.
    fn has_points_alone(&self) -> bool {
        let bytes = fs::read(&self.carrier.path).ok();
        let members = bytes.and_then(|bytes| arrays_from_npz(&bytes).ok());
        members.is_some_and(|members| {
            members.array("points").is_some() && members.array("meta").is_none()
        })
    }

    /// The bytes of the carrier's file, which [`carrier`](Self::carrier) has checked.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn file_bytes(&self) -> Result<Vec<u8>> {
        let path = &self.carrier.path;
        fs::read(path).with_context(|| format!("reading {}", path.display()))
    }
}

/// A file or shape without a carrier.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FailedInput {
    /// The id that its shape would have.
    pub(crate) id: String,
    /// The file.
    pub(crate) source: String,
    /// The reason why there is no carrier.
    pub(crate) reason: String,
}

/// All requested shapes, and the inputs without a shape.
#[derive(Debug, Default)]
pub(crate) struct ShapeInputs {
    /// The shapes, in the order of the paths and of their data sets.
    pub(crate) shapes: Vec<ShapeInput>,
    /// Files and shapes without a carrier.
    pub(crate) failed: Vec<FailedInput>,
    /// Removes the files that were labeled on the way, when the shapes are no longer needed.
    _scratch: Option<Scratch>,
    /// Removes the copy of the standard input at the same time.
    _standard_input: Option<StandardInput>,
}

impl ShapeInputs {
    fn label(
        &mut self,
        paths: &[PathBuf],
        scratch: &Path,
        config: &Config,
        n_workers: usize,
        interrupt: &Interrupt,
    ) -> Result<()> {
        let job = LabelJob::in_folder(paths, scratch, config, n_workers);
        label_paths(&job, interrupt).map_err(|error| match error.downcast_ref() {
            Some(StoppedBatch { n_files }) => {
                anyhow!(
                    "stopped after {}; nothing was written",
                    counted(*n_files, "file", "files")
                )
            }
            None => error,
        })?;
        let dataset = Dataset::open(scratch)?;
        // The index is removed with the folder, so its reasons are printed here.
        warn_of_unread(
            dataset
                .entries()
                .iter()
                .filter(|entry| entry.status == Status::Skipped),
        );
        self.add_dataset(&dataset);
        Ok(())
    }

    /// Adds the shapes of a folder that `predict` wrote.
    fn add_predictions(&mut self, folder: &Path) -> Result<()> {
        let file = folder.join(SHAPES_FILE);
        let text = fs::read_to_string(&file).with_context(|| {
            format!(
                "reading {}; `predict` writes it last, so repeat it with --resume",
                file.display()
            )
        })?;
        for (number, line) in (1..).zip(text.lines()) {
            let line: PredictedShape = serde_json::from_str(line)
                .with_context(|| format!("{}, line {number}", file.display()))?;
            match line.shape(folder) {
                Ok(shape) => self.shapes.push(shape),
                Err(reason) => self.failed.push(FailedInput {
                    id: line.id,
                    source: line.source,
                    reason,
                }),
            }
        }
        Ok(())
    }

    fn add_dataset(&mut self, dataset: &Dataset) {
        let settings_sha256: Option<Arc<str>> =
            settings_sha256_of(dataset.root()).map(|hash| hash.into());
        for entry in dataset
            .entries()
            .iter()
            .filter(|entry| entry.status != Status::Skipped)
        {
            match shape_of(dataset, entry) {
                Ok(shape) => self.shapes.push(ShapeInput {
                    settings_sha256: settings_sha256.clone(),
                    ..shape
                }),
                Err(reason) => {
                    let (id, source) = (entry.id.clone(), entry.source.clone());
                    self.failed.push(FailedInput { id, source, reason });
                }
            }
        }
    }

    /// Refuses equal ids. Ids are the names of files, so two files with the same name would overwrite each other.
    fn refuse_equal_ids(&self) -> Result<()> {
        let mut source_of: BTreeMap<&str, &str> = BTreeMap::new();
        for shape in &self.shapes {
            if let Some(source) = source_of.insert(&shape.id, &shape.source) {
                bail!(UsageError(format!(
                    "two shapes have the id `{}`: of {source} and of {}; use two calls for them",
                    shape.id, shape.source
                )));
            }
        }
        Ok(())
    }
}

/// The shape of a line of the index, or the reason why there is none.
fn shape_of(dataset: &Dataset, entry: &IndexEntry) -> Result<ShapeInput, String> {
    let Some(file) = &entry.file else {
        return Err(entry
            .reason
            .clone()
            .unwrap_or_else(|| "it has no carrier".to_owned()));
    };
    let is_plain = |path: &Path| {
        path.components()
            .all(|part| matches!(part, Component::Normal(_)))
    };
    let id = Path::new(&entry.id);
    if !is_plain(Path::new(file)) || !is_plain(id) || id.components().count() != 1 {
        return Err(format!("`{file}` or the id points outside the data set"));
    }
    let carrier = dataset
        .carrier_ref(entry)
        .map_err(|error| error.to_string())?;
    Ok(ShapeInput {
        id: entry.id.clone(),
        source: entry.source.clone(),
        product: entry.product.clone(),
        stem: Path::new(file).with_file_name(&entry.id),
        n_labels: Some(entry.n_labels),
        solid_step_id: entry.solid_step_id,
        settings_sha256: None,
        unit: Some(match entry.solid_step_id {
            Some(_) => Unit::Solid,
            None => Unit::File,
        }),
        carrier,
    })
}

/// A folder that is removed when this value is dropped.
#[derive(Debug)]
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // If the folder was never made, or cannot be removed, the finished work has still succeeded.
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_and_files_outside_of_the_folder_are_not_shapes() {
        let folder = tempfile::tempdir().unwrap();
        let mut entry = IndexEntry::without_carrier("a", "x/a.step", Status::Ok, String::new());
        let line = |entry: &IndexEntry| serde_json::to_string(entry).unwrap() + "\n";
        let mut text = line(&entry);
        for (id, file) in [
            ("a", "ab/a.npz"),
            ("../b", "b.npz"),
            ("c", "../c.npz"),
            ("/d", "d.npz"),
        ] {
            (entry.id, entry.file) = (id.to_owned(), Some(file.to_owned()));
            text += &line(&entry);
        }
        fs::write(folder.path().join("index.jsonl"), text).unwrap();
        let mut sources = ShapeInputs::default();
        sources.add_dataset(&Dataset::open(folder.path()).unwrap());
        assert_eq!((sources.shapes.len(), sources.failed.len()), (1, 4));
        assert_eq!(sources.shapes[0].stem, Path::new("ab/a"));
        assert!(sources.shapes[0].carrier().is_err());
    }
}
