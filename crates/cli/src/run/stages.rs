//! The stages that `run` does in a row, and the verbs that do one of them alone: `train` and `eval`.

use super::collisions::{Collisions, SplitCollisions};
use super::evaluation::{Contestant, Embedder, NO_NETWORK, UNTRAINED, evaluate, write_test_shapes};
use super::folder::RunFolder;
use super::outcome::conclude;
use super::shapes::{Points, Selection, Shape, load_shapes};
use super::training::{TrainingArgs, TrainingJob};
use super::training_shapes::{Redraw, TrainingShapes, draw};
use crate::allocator::keep_freed_memory;
use crate::config::{Config, load};
use crate::dataset::Dataset;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use eval::{ScoreRow, Split, SplitFractions, split};
use net::{Backend, Model, TokenConfig, TrainShape};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// How a run is executed; nothing here changes its numbers, but for the last digits of another backend.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ExecutionArgs {
    /// Override a value of the config, for example `train.steps=2000`; may be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Threads; all cores if not given. The results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// The implementation of tensor operations; `wgpu` and `cuda` where the program was built with them.
    #[arg(long, value_enum, default_value_t = BackendArg::Flex)]
    backend: BackendArg,
}

/// The backends that a user can choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum BackendArg {
    /// burn-flex: the fast one.
    Flex,
    /// burn-ndarray: the portable cross-check.
    Ndarray,
    /// A GPU by way of Vulkan, Metal, DirectX or WebGPU.
    #[cfg(feature = "wgpu")]
    Wgpu,
    /// An NVIDIA GPU.
    #[cfg(feature = "cuda")]
    Cuda,
}

/// What every stage is executed with.
pub(crate) struct Execution {
    pub(crate) threads: usize,
    pub(crate) backend: Backend,
    pub(crate) progress: Progress,
    pub(crate) interrupt: Interrupt,
}

impl Execution {
    /// Sets up threads and Ctrl-C; once in a process.
    pub(crate) fn new(args: &ExecutionArgs) -> Result<Self> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = args.jobs.map_or(cores, usize::from);
        keep_freed_memory(threads);
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().context("starting threads")?;
        let backend = match args.backend {
            BackendArg::Flex => Backend::Flex,
            BackendArg::Ndarray => Backend::Ndarray,
            #[cfg(feature = "wgpu")]
            BackendArg::Wgpu => Backend::Wgpu,
            #[cfg(feature = "cuda")]
            BackendArg::Cuda => Backend::Cuda,
        };
        Ok(Self { threads, backend, progress: Progress::on_terminal(), interrupt: Interrupt::listen()? })
    }

    pub(crate) fn backend_name(&self) -> &'static str {
        match self.backend {
            Backend::Flex => "flex",
            Backend::Ndarray => "ndarray",
            #[cfg(feature = "wgpu")]
            Backend::Wgpu => "wgpu",
            #[cfg(feature = "cuda")]
            Backend::Cuda => "cuda",
        }
    }
}

/// The shapes of a run, split; training shapes have their points where the trainer wants them.
pub(crate) struct Prepared {
    pub(crate) selection: Selection,
    shapes: BTreeMap<String, Shape>,
    split: Split,
    /// The training shapes, in split order; the labels are those of the supervision in turn.
    train: TrainingShapes,
}

/// `split.json`: who is where, and what was left out.
#[derive(Serialize, Deserialize)]
struct SplitFile<S> {
    format_version: u32,
    seed: u64,
    #[serde(flatten)]
    split: Split,
    selection: S,
}

impl Prepared {
    fn shapes_of(&self, ids: &[String]) -> Result<Vec<&Shape>> {
        ids.iter()
            .map(|id| self.shapes.get(id).with_context(|| format!("split.json names {id}, which the data set lacks")))
            .collect()
    }
}

impl Prepared {
    fn collisions(&self, config: &Config) -> Result<Collisions> {
        let TokenConfig { train_tokens, test_tokens, voxels } = config.tokens;
        let train = SplitCollisions::of(self.train.n(), train_tokens, voxels, |idx| {
            let shape = self.train.get(idx)?;
            let labels = self.shapes.get(&shape.id).with_context(|| format!("{} has no labels", shape.id))?.labels();
            let sample = match shape {
                Cow::Borrowed(shape) => Cow::Borrowed(&shape.sample),
                Cow::Owned(shape) => Cow::Owned(shape.sample),
            };
            Ok((sample, labels))
        })?;
        let test = self.shapes_of(&self.split.test)?;
        let test = SplitCollisions::of(test.len(), test_tokens, voxels, |idx| {
            Ok((Cow::Borrowed(&test[idx].sample), test[idx].labels()))
        })?;
        Ok(Collisions::new(train, test))
    }
}

/// Samples and labels the points, splits the shapes and writes `split.json`.
pub(crate) fn prepare(
    dataset: &Dataset,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
    points: Points,
) -> Result<Prepared> {
    let (shapes, mut selection) = load_shapes(dataset, config, &execution.progress, points)?;
    let candidates: Vec<_> = shapes.iter().map(|shape| shape.candidate.clone()).collect();
    let fractions = SplitFractions { train: config.split.train, valid: config.split.valid, test: config.split.test };
    let split = split(&candidates, &fractions, config.split.seed)?;
    for duplicate in &split.duplicates {
        selection.leave_out("the same shape as another", &duplicate.id);
    }
    let file =
        SplitFile { format_version: 1, seed: config.split.seed, split: split.clone(), selection: selection.clone() };
    folder.write_json("split.json", &file)?;
    execution.progress.note(&selection.to_string());
    ensure!(!split.train.is_empty(), "no shape is left to train on ({selection})");
    ensure!(!split.test.is_empty(), "no shape is left to test on ({selection})");
    let mut shapes: BTreeMap<String, Shape> = shapes.into_iter().map(|shape| (shape.id.clone(), shape)).collect();
    for (id, shape) in &mut shapes {
        shape.group = split.group_of(id).unwrap_or(id).to_owned();
    }
    let train = split.train.iter().map(|id| train_shape(&mut shapes, id)).collect::<Result<_>>()?;
    let redraw = match points {
        Points::Kept => None,
        Points::Redrawn => {
            draw_again(&mut shapes, split.valid.iter().chain(&split.test), config)?;
            let carriers = split.train.iter().filter_map(|id| shapes.get(id)).map(|shape| shape.carrier.clone());
            Some(Redraw { carriers: carriers.collect(), sample: config.sample.clone() })
        }
    };
    let train = TrainingShapes::new(train, redraw);
    Ok(Prepared { selection, shapes, split, train })
}

/// Moves the points of a shape to the trainer: they are the bulk of the memory.
fn train_shape(shapes: &mut BTreeMap<String, Shape>, id: &str) -> Result<TrainShape> {
    let shape = shapes.get_mut(id).with_context(|| format!("the split names {id}, which is not there"))?;
    Ok(TrainShape { id: id.to_owned(), sample: std::mem::take(&mut shape.sample), labels: Vec::new() })
}

/// Says, and writes, how many points lie in a voxel of another label; once a run.
pub(crate) fn note_collisions(
    prepared: &Prepared,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<()> {
    // What stands there stays: a number that is read and written again may change its last digit.
    let found = match Collisions::read(folder)? {
        Some(found) => found,
        None => {
            let found = prepared.collisions(config)?;
            found.write(folder)?;
            found
        }
    };
    execution.progress.note(&found.to_string());
    Ok(())
}

/// Gives the shapes that are scored their points back.
fn draw_again<'a>(
    shapes: &mut BTreeMap<String, Shape>,
    ids: impl Iterator<Item = &'a String>,
    config: &Config,
) -> Result<()> {
    for id in ids {
        if let Some(shape) = shapes.get_mut(id) {
            shape.sample = draw(id, &shape.carrier, &config.sample)?;
        }
    }
    Ok(())
}

/// Trains one backbone on one supervision, from its last checkpoint if there is one.
pub(crate) fn train_supervision(
    prepared: &mut Prepared,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
    (supervision, seed): (&str, u64),
    args: &TrainingArgs,
) -> Result<()> {
    if folder.path(&weights_path(supervision, seed)).exists() {
        return Ok(());
    }
    let shapes = &prepared.shapes;
    prepared.train.relabel(|id| {
        let shape = shapes.get(id).context("a training shape without labels")?;
        Ok(shape.labels_by(supervision)?.to_vec())
    })?;
    let valid = prepared.shapes_of(&prepared.split.valid)?;
    let job = TrainingJob { folder, config, supervision, seed, execution, args };
    job.train(&prepared.train, &valid)
}

/// The weights that are evaluated.
pub(crate) fn weights_path(supervision: &str, seed: u64) -> String {
    format!("checkpoints/{supervision}-{seed}/model.safetensors")
}

/// Scores the untrained network, plain geometry and every trained backbone on the held-out shapes.
pub(crate) fn evaluate_contestants(
    prepared: &Prepared,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<Vec<ScoreRow>> {
    let test = prepared.shapes_of(&prepared.split.test)?;
    write_test_shapes(folder, &test, &config.references())?;
    let mut rows = Vec::new();
    let mut score = |supervision: &str, seed: u64, embedder: Embedder<'_>| -> Result<()> {
        let contestant = Contestant { supervision, seed, embedder };
        rows.extend(evaluate(folder, config, &contestant, &test, &execution.progress)?);
        Ok(())
    };
    score(NO_NETWORK, config.compare.seeds[0], Embedder::Geometry)?;
    for &seed in &config.compare.seeds {
        score(UNTRAINED, seed, Embedder::Network(&Model::init(&config.net, seed, execution.backend)?))?;
        for supervision in &config.compare.supervision {
            let weights = weights_path(supervision, seed);
            if config.compare.supervision.len() > 1 && !folder.path(&weights).exists() {
                execution.progress.note(&format!("{supervision}, seed {seed}: not trained yet, left out"));
                continue;
            }
            let model = Model::from_safetensors(&config.net, &folder.read(&weights)?, execution.backend)?;
            score(supervision, seed, Embedder::Network(&model))?;
        }
    }
    Ok(rows)
}

/// Train one backbone on one supervision source, into a run folder.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe train abc-small --data carriers/ --supervision step-parts --out runs/mine
Train the second source into the same folder with --resume, then `partprobe eval runs/mine`.")]
pub struct TrainArgs {
    /// A shipped config (base, smoke, abc-small, pointnet) or a TOML file.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// The labelled data set (`partprobe label` makes one).
    #[arg(long, value_name = "DATASET")]
    data: PathBuf,
    /// The label source to train on; it must stand in the config's compare.supervision.
    #[arg(long, value_name = "SOURCE")]
    supervision: String,
    /// The run folder.
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Go on with an interrupted training, or add a source to the same folder.
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    training: TrainingArgs,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Trains each seed of one supervision source.
///
/// # Errors
/// If the data set cannot be read, or training fails; the last checkpoint stays.
pub fn train(args: &TrainArgs) -> Result<ExitCode> {
    let loaded = load(&args.config, &args.execution.set)?;
    let known = &loaded.config.compare.supervision;
    ensure!(
        known.contains(&args.supervision),
        UsageError(format!(
            "`{}` is not in compare.supervision ({}); add it with --set 'compare.supervision=[\"…\"]'",
            args.supervision,
            known.join(", ")
        ))
    );
    // Before the folder is made: a mistyped path must not leave one behind.
    let dataset = Dataset::open(&args.data)?;
    let execution = Execution::new(&args.execution)?;
    let folder = RunFolder::open(&args.out, &loaded.merged, args.resume)?;
    remember_data(&folder, &args.data)?;
    let mut prepared = prepare(&dataset, &loaded.config, &folder, &execution, args.training.points())?;
    note_collisions(&prepared, &loaded.config, &folder, &execution)?;
    for &seed in &loaded.config.compare.seeds {
        train_supervision(
            &mut prepared,
            &loaded.config,
            &folder,
            &execution,
            (&args.supervision, seed),
            &args.training,
        )?;
        print_line(folder.path(&weights_path(&args.supervision, seed)).display())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Score the trained backbones of a run folder again, and write its tables.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe eval runs/mine --set eval.restarts=30")]
pub struct EvalArgs {
    /// The run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The labelled data set, if it has moved since the run.
    #[arg(long, value_name = "DATASET")]
    data: Option<PathBuf>,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Evaluates what the folder has trained; the exit code is 1 if an expectation is missed.
///
/// # Errors
/// If the folder is no run, or its data set cannot be read.
pub fn evaluate_run(args: &EvalArgs) -> Result<ExitCode> {
    let folder = RunFolder::existing(&args.run)?;
    let loaded = load(&folder.path("config.toml").to_string_lossy(), &args.execution.set)?;
    if !args.execution.set.is_empty() {
        // The scores below follow from these settings; the folder must not say others.
        folder.write("config.toml", loaded.merged.as_bytes())?;
    }
    let execution = Execution::new(&args.execution)?;
    let data = match &args.data {
        Some(path) => path.clone(),
        None => remembered_data(&folder)?,
    };
    let prepared = prepare(&Dataset::open(&data)?, &loaded.config, &folder, &execution, Points::Redrawn)?;
    let rows = evaluate_contestants(&prepared, &loaded.config, &folder, &execution)?;
    conclude(&folder, &loaded.config, &prepared.selection, &rows)
}

/// Notes where the data set stands, for `eval`: relative to the run folder if it stands inside it.
pub(crate) fn remember_data(folder: &RunFolder, data: &Path) -> Result<()> {
    let canonical = |path: &Path| path.canonicalize().with_context(|| path.display().to_string());
    let (data, root) = (canonical(data)?, canonical(folder.root())?);
    folder.write_json("data.json", &data.strip_prefix(&root).unwrap_or(&data))
}

fn remembered_data(folder: &RunFolder) -> Result<PathBuf> {
    let text = folder.read_text("data.json").context("give --data DATASET")?;
    let path: PathBuf = serde_json::from_str(&text).context("data.json")?;
    // Joining an absolute path gives that path.
    Ok(folder.root().join(path))
}
