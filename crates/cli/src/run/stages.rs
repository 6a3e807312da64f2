//! The stages that `run` does in a row, and the verbs that do one of them alone: `train` and `eval`.

use super::choice::{Choice, DUPLICATE, choose};
use super::collisions::{Collisions, SplitCollisions};
use super::data_settings::{ensure_settings_of, settings_of, with_data};
use super::evaluation::{Contestant, Embedder, NO_NETWORK, UNTRAINED, evaluate, write_test_shapes};
use super::folder::RunFolder;
use super::held_out::{HeldOut, ensure_trained_here, keys_of};
use super::host::RunRecord;
use super::outcome::{checked_expectations, conclude};
use super::shapes::{Points, Shape, ShapeIdentity, ShapeLoader, named_sources};
use super::split_file::SplitFile;
use super::training::{TrainingArgs, TrainingData, TrainingJob};
use super::training_shapes::{Redraw, TrainingShapes, draw};
use crate::allocator::keep_freed_memory;
use crate::config::{Config, Difference, differences, load};
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::stdout::print_result;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, ensure};
use partprobe_carrier::hexadecimal;
use partprobe_dataset::Dataset;
use partprobe_eval::{ScoreRow, Split, SplitFractions, split};
use partprobe_net::{Backend, Model, TokenConfig, TrainShape};
use sha2::{Digest, Sha256};
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
    /// The implementation of tensor operations. All but `flex` must be built in: `cargo build --release --features cuda`.
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
    Wgpu,
    /// An NVIDIA GPU.
    Cuda,
}

impl BackendArg {
    /// The name that a user gives and that a run records.
    fn name(self) -> &'static str {
        match self {
            Self::Flex => "flex",
            Self::Ndarray => "ndarray",
            Self::Wgpu => "wgpu",
            Self::Cuda => "cuda",
        }
    }

    /// The backend, if this program was built with it; otherwise a usage error that says how to build it.
    fn backend(self) -> Result<Backend, UsageError> {
        match self {
            Self::Flex => Ok(Backend::Flex),
            #[cfg(feature = "ndarray")]
            Self::Ndarray => Ok(Backend::Ndarray),
            #[cfg(feature = "wgpu")]
            Self::Wgpu => Ok(Backend::Wgpu),
            #[cfg(feature = "cuda")]
            Self::Cuda => Ok(Backend::Cuda),
            #[allow(
                unreachable_patterns,
                reason = "a program that is built with every feature has all backends"
            )]
            missing => Err(UsageError(format!(
                "this program was built without the backend `{0}`; build it with `cargo build --release --features {0}`",
                missing.name(),
            ))),
        }
    }
}

/// What every stage is executed with.
pub(crate) struct Execution {
    pub(crate) threads: usize,
    pub(crate) backend: Backend,
    /// What the user calls the backend, and what a run records.
    pub(crate) backend_name: &'static str,
    pub(crate) progress: Progress,
    pub(crate) interrupt: Interrupt,
}

impl Execution {
    /// Sets up threads and Ctrl-C; once in a process.
    pub(crate) fn new(args: &ExecutionArgs) -> Result<Self> {
        let backend = args.backend.backend()?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let threads = args.jobs.map_or(cores, usize::from);
        keep_freed_memory(threads);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .context("starting threads")?;
        Ok(Self {
            threads,
            backend,
            backend_name: args.backend.name(),
            progress: Progress::on_terminal(),
            interrupt: Interrupt::listen()?,
        })
    }
}

/// The shapes of a run, split; training shapes have their points where the trainer wants them.
pub(crate) struct Prepared {
    pub(crate) split_file: SplitFile,
    shapes: BTreeMap<String, Shape>,
    /// The training shapes, in split order; the labels are those of the supervision in turn.
    train: TrainingShapes,
}

impl Prepared {
    fn split(&self) -> &Split {
        &self.split_file.split
    }

    fn shapes_of(&self, ids: &[String]) -> Result<Vec<&Shape>> {
        ids.iter()
            .map(|id| {
                self.shapes
                    .get(id)
                    .with_context(|| format!("split.json names {id}, which the data set lacks"))
            })
            .collect()
    }

    /// The shapes that are scored.
    pub(crate) fn test(&self) -> Result<TestShapes<'_>> {
        let shapes = self.shapes_of(&self.split().test)?;
        Ok(TestShapes {
            shapes,
            n_train: self.split().train.len(),
        })
    }

    fn collisions(&self, config: &Config) -> Result<Collisions> {
        let TokenConfig {
            train_tokens,
            test_tokens,
            voxels,
        } = config.tokens;
        let train = SplitCollisions::of(self.train.n(), train_tokens, voxels, |idx| {
            let shape = self.train.get(idx)?;
            let labels = self
                .shapes
                .get(&shape.id)
                .with_context(|| format!("{} has no labels", shape.id))?
                .labels();
            let sample = match shape {
                Cow::Borrowed(shape) => Cow::Borrowed(&shape.sample),
                Cow::Owned(shape) => Cow::Owned(shape.sample),
            };
            Ok((sample, labels))
        })?;
        let test = self.shapes_of(&self.split().test)?;
        let test = SplitCollisions::of(test.len(), test_tokens, voxels, |idx| {
            Ok((Cow::Borrowed(&test[idx].sample), test[idx].labels()))
        })?;
        Ok(Collisions::new(train, test))
    }

    /// What tells the data of this run's trainings from that of others.
    fn training_data(&self) -> Result<TrainingData> {
        let split = self.split();
        let identities = |ids: &[String]| -> Result<Vec<ShapeIdentity>> {
            ids.iter()
                .map(|id| self.split_file.identity(id).cloned())
                .collect()
        };
        let (train, valid) = (identities(&split.train)?, identities(&split.valid)?);
        let mut digest = Sha256::new();
        for (ids, identities) in [(&split.train, &train), (&split.valid, &valid)] {
            for (id, identity) in ids.iter().zip(identities) {
                digest.update(format!("{id}\n{}\n", identity.content_hash));
            }
            digest.update("\n");
        }
        let digest = hexadecimal(&digest.finalize());
        Ok(TrainingData {
            train: keys_of(&train),
            valid: keys_of(&valid),
            digest,
        })
    }
}

/// The shapes that are scored.
pub(crate) struct TestShapes<'a> {
    pub(crate) shapes: Vec<&'a Shape>,
    /// How many shapes the run trains on.
    pub(crate) n_train: usize,
}

/// Samples and labels the points of the run's split, which is made and written if there is none yet.
pub(crate) fn prepare(
    dataset: &Dataset,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
    points: Points,
) -> Result<Prepared> {
    let loader = ShapeLoader::new(dataset, config, points)?;
    let (split_file, shapes) = match SplitFile::read(folder, config)? {
        Some(file) => load_again(file, loader, execution)?,
        None => split_anew(&loader, folder, execution)?,
    };
    execution.progress.note(&split_file.selection.to_string());
    let split = &split_file.split;
    let mut shapes: BTreeMap<String, Shape> = shapes
        .into_iter()
        .map(|shape| (shape.id.clone(), shape))
        .collect();
    let train = split
        .train
        .iter()
        .map(|id| train_shape(&mut shapes, id))
        .collect::<Result<_>>()?;
    let redraw = match points {
        Points::Kept => None,
        Points::Redrawn => {
            draw_again(&mut shapes, split.valid.iter().chain(&split.test), config)?;
            let carriers = split
                .train
                .iter()
                .filter_map(|id| shapes.get(id))
                .map(|shape| shape.carrier.clone());
            Some(Redraw {
                carriers: carriers.collect(),
                sample: config.sample.clone(),
            })
        }
    };
    let train = TrainingShapes::new(train, redraw);
    Ok(Prepared {
        split_file,
        shapes,
        train,
    })
}

/// Loads the shapes of a split that stands in the folder.
fn load_again(
    mut file: SplitFile,
    loader: ShapeLoader<'_>,
    execution: &Execution,
) -> Result<(SplitFile, Vec<Shape>)> {
    loader
        .config
        .compare
        .supervision
        .iter()
        .try_for_each(|source| file.ensure_source(source))?;
    let (test, left_out) = file.load(&loader, file.split.test.iter(), &execution.progress)?;
    file.leave_out_of_test(&left_out)?;
    // A reference that came later has no say in what is trained on.
    let loader = loader.with_sources(file.sources());
    let trained = file.split.train.iter().chain(&file.split.valid);
    let (mut shapes, left_out) = file.load(&loader, trained, &execution.progress)?;
    ensure!(
        left_out.is_empty(),
        "training shapes have gone, though their label sources are the same"
    );
    shapes.extend(test);
    Ok((file, shapes))
}

/// Chooses the shapes of a new run, splits them, and writes `split.json`.
fn split_anew(
    loader: &ShapeLoader<'_>,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<(SplitFile, Vec<Shape>)> {
    let config = loader.config;
    let Choice {
        mut shapes,
        mut selection,
    } = choose(loader, &execution.progress)?;
    let candidates: Vec<_> = shapes.iter().map(|shape| shape.candidate.clone()).collect();
    let fractions = SplitFractions {
        train: config.split.train,
        valid: config.split.valid,
        test: config.split.test,
    };
    let split = split(&candidates, &fractions, config.split.seed)?;
    for duplicate in &split.duplicates {
        selection.leave_out(DUPLICATE, &duplicate.id);
    }
    ensure!(
        !split.train.is_empty(),
        "no shape is left to train on ({selection})"
    );
    ensure!(
        !split.test.is_empty(),
        "no shape is left to test on ({selection})"
    );
    for shape in &mut shapes {
        shape.group = split.group_of(&shape.id).unwrap_or(&shape.id).to_owned();
    }
    let file = SplitFile::new(config, split, selection, &shapes);
    file.write(folder)?;
    Ok((file, shapes))
}

/// The test shapes of a run's split with their points and labels; nothing else of the data set is read.
pub(crate) fn prepare_test(
    dataset: &Dataset,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<Prepared> {
    let loader = ShapeLoader::new(dataset, config, Points::Kept)?;
    let mut split_file = SplitFile::read(folder, config)?.with_context(|| {
        format!(
            "{} has no split.json, which says which shapes are held out",
            folder.root().display()
        )
    })?;
    let (shapes, left_out) =
        split_file.load(&loader, split_file.split.test.iter(), &execution.progress)?;
    split_file.leave_out_of_test(&left_out)?;
    execution.progress.note(&split_file.selection.to_string());
    let shapes = shapes
        .into_iter()
        .map(|shape| (shape.id.clone(), shape))
        .collect();
    Ok(Prepared {
        split_file,
        shapes,
        train: TrainingShapes::new(Vec::new(), None),
    })
}

/// Moves the points of a shape to the trainer: they are the bulk of the memory.
fn train_shape(shapes: &mut BTreeMap<String, Shape>, id: &str) -> Result<TrainShape> {
    let shape = shapes
        .get_mut(id)
        .with_context(|| format!("the split names {id}, which is not there"))?;
    Ok(TrainShape {
        id: id.to_owned(),
        sample: std::mem::take(&mut shape.sample),
        labels: Vec::new(),
    })
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
    let data = prepared.training_data()?;
    if folder.path(&weights_path(supervision, seed)).exists() {
        return ensure_trained_here(folder, (supervision, seed), &data, execution.backend);
    }
    let shapes = &prepared.shapes;
    prepared.train.relabel(|id| {
        let shape = shapes.get(id).context("a training shape without labels")?;
        Ok(shape.labels_by(supervision)?.to_vec())
    })?;
    let valid = prepared.shapes_of(&prepared.split().valid)?;
    let job = TrainingJob {
        folder,
        config,
        supervision,
        seed,
        data: &data,
        execution,
        args,
    };
    job.train(&prepared.train, &valid)
}

/// The weights that are evaluated.
pub(crate) fn weights_path(supervision: &str, seed: u64) -> String {
    format!("checkpoints/{supervision}-{seed}/model.safetensors")
}

/// Scores the untrained network, plain geometry and every trained backbone on the held-out shapes.
///
/// # Errors
/// If a backbone has seen a held-out shape, or is not of this run; what a former evaluation wrote then stays.
pub(crate) fn evaluate_contestants(
    prepared: &Prepared,
    config: &Config,
    folder: &RunFolder,
    execution: &Execution,
) -> Result<Vec<ScoreRow>> {
    let TestShapes {
        shapes: test,
        n_train,
    } = prepared.test()?;
    let held_out = HeldOut {
        folder,
        config,
        n_train,
        test: &test,
        backend: execution.backend,
    };
    let mut trained = Vec::new();
    for &seed in &config.compare.seeds {
        for supervision in &config.compare.supervision {
            let is_trained = folder.path(&weights_path(supervision, seed)).exists();
            if config.compare.supervision.len() > 1 && !is_trained {
                execution.progress.note(&format!(
                    "{supervision}, seed {seed}: not trained yet, left out"
                ));
                continue;
            }
            // Before anything is written, all of them are looked at.
            held_out.model(supervision, seed)?;
            trained.push((supervision, seed));
        }
    }
    folder.forget_evaluation()?;
    write_test_shapes(folder, &test, &config.references())?;
    let mut rows = Vec::new();
    let mut score = |supervision: &str, seed: u64, embedder: Embedder<'_>| -> Result<()> {
        ensure!(
            !execution.interrupt.is_set(),
            "interrupted; `partprobe eval {}` scores again",
            folder.root().display()
        );
        let contestant = Contestant {
            supervision,
            seed,
            embedder,
        };
        rows.extend(evaluate(
            folder,
            config,
            &contestant,
            &test,
            &execution.progress,
        )?);
        Ok(())
    };
    score(NO_NETWORK, config.compare.seeds[0], Embedder::Geometry)?;
    for &seed in &config.compare.seeds {
        score(
            UNTRAINED,
            seed,
            Embedder::Network(&Model::init(&config.net, seed, execution.backend)?),
        )?;
        for &(supervision, _) in trained
            .iter()
            .filter(|(_, trained_seed)| *trained_seed == seed)
        {
            score(
                supervision,
                seed,
                Embedder::Network(&held_out.model(supervision, seed)?),
            )?;
        }
    }
    Ok(rows)
}

/// Train one backbone on one supervision source, into a run folder.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe train abc-small --data carriers/ --supervision step-parts --out runs/mine
Train the second source into the same folder with --resume, then `partprobe eval runs/mine`."
)]
pub(crate) struct TrainArgs {
    /// A shipped config (base, smoke, abc-small, pointnet) or a TOML file.
    #[arg(value_name = "CONFIG")]
    config: String,
    /// The labeled data set (`partprobe label` makes one).
    #[arg(long, value_name = "DATASET")]
    data: PathBuf,
    /// The label source to train on; it must stand in the config's compare.supervision.
    #[arg(long, value_name = "SOURCE")]
    supervision: String,
    /// The run folder.
    #[arg(long, value_name = "RUN")]
    out: PathBuf,
    /// Resume an interrupted training, or add a source to the same folder.
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
pub(crate) fn train(args: &TrainArgs) -> Result<ExitCode> {
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
    let loaded = with_data(
        std::slice::from_ref(&args.data),
        loaded,
        &args.config,
        &args.execution.set,
    )?;
    let config = &loaded.config;
    let execution = Execution::new(&args.execution)?;
    let folder = RunFolder::open(&args.out, &loaded.merged, args.resume)?;
    let data = vec![args.data.display().to_string()];
    RunRecord::new(&execution, data, Some(settings_of(&args.data)?)).begin_training(&folder)?;
    let mut prepared = prepare(
        &dataset,
        config,
        &folder,
        &execution,
        args.training.points(),
    )?;
    remember_data(&folder, &args.data)?;
    note_collisions(&prepared, config, &folder, &execution)?;
    for &seed in &config.compare.seeds {
        train_supervision(
            &mut prepared,
            config,
            &folder,
            &execution,
            (&args.supervision, seed),
            &args.training,
        )?;
        print_result(
            folder
                .path(&weights_path(&args.supervision, seed))
                .display(),
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Score the trained backbones of a run folder again, and write its tables.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe eval runs/mine --set eval.restarts=30")]
pub(crate) struct EvalArgs {
    /// The run folder.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// The labeled data set, if it has moved since the run.
    #[arg(long, value_name = "DATASET")]
    data: Option<PathBuf>,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Evaluates what the folder has trained; the exit code is 1 if an expectation is missed.
///
/// # Errors
/// If the folder is no run, or its data set cannot be read.
pub(crate) fn evaluate_run(args: &EvalArgs) -> Result<ExitCode> {
    let folder = RunFolder::existing(&args.run)?;
    let config_file = folder.path("config.toml").to_string_lossy().into_owned();
    let loaded = load(&config_file, &args.execution.set)?;
    refuse_new_settings(&load(&config_file, &[])?.config, &loaded.config)?;
    named_sources(&loaded.config).map_err(as_usage_error)?;
    checked_expectations(&loaded.config).map_err(as_usage_error)?;
    let execution = Execution::new(&args.execution)?;
    let data = match &args.data {
        Some(path) => path.clone(),
        None => remembered_data(&folder)?,
    };
    let dataset = Dataset::open(&data)?;
    ensure_settings_of(&data, &loaded)?;
    let prepared = prepare_test(&dataset, &loaded.config, &folder, &execution)?;
    let rows = evaluate_contestants(&prepared, &loaded.config, &folder, &execution)?;
    if !args.execution.set.is_empty() {
        // The scores below follow from these settings; the folder must not say others.
        folder.write("config.toml", loaded.merged.as_bytes())?;
    }
    conclude(
        &folder,
        &loaded.config,
        &prepared.split_file.selection,
        &rows,
    )
}

/// The keys that say how backbones are scored, and not how they were trained; `compare.` stands for all of its keys.
const SCORING_KEYS: [&str; 4] = ["compare.", "eval.", "expect.", "tokens.test_tokens"];

/// Refuses settings that decided the training: with others, the run's config would say what is not so.
fn refuse_new_settings(stored: &Config, asked: &Config) -> Result<()> {
    let is_scoring =
        |key: &str| SCORING_KEYS.iter().any(|scoring| key.starts_with(scoring)) || key == "expect";
    let fixed: Vec<String> = differences(stored, asked)
        .into_iter()
        .filter(|difference| !is_scoring(&difference.key))
        .map(|Difference { key, here, there }| {
            format!("{key} is {here} in this run and cannot become {there}")
        })
        .collect();
    ensure!(
        fixed.is_empty(),
        UsageError(format!(
            "{}: it decided which shapes were trained on, and how; make a new run folder for another value",
            fixed.join("; ")
        ))
    );
    Ok(())
}

/// Notes where the data set stands, for `eval`: relative to the run folder if it stands inside it.
pub(crate) fn remember_data(folder: &RunFolder, data: &Path) -> Result<()> {
    let canonical = |path: &Path| {
        path.canonicalize()
            .with_context(|| path.display().to_string())
    };
    let (data, root) = (canonical(data)?, canonical(folder.root())?);
    folder.write_json("data.json", &data.strip_prefix(&root).unwrap_or(&data))
}

fn remembered_data(folder: &RunFolder) -> Result<PathBuf> {
    let advice = "say with --data DATASET where the data set is";
    let path: PathBuf = folder
        .read_json("data.json", advice)
        .context("give --data DATASET")?;
    // Joining an absolute path gives that path.
    Ok(folder.root().join(path))
}
