//! Defines the arguments of `embed`, and its loop over files.

use super::input::{EmbedInput, shapes_of_path};
use crate::config::{Config, load, overrides_of_preparation};
use crate::counted::counted;
use crate::run::{Execution, ExecutionArgs, RunFolder, embedding_members, npz_bytes, read_weights};
use crate::stdout::print_result;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::Embeddings;
use partprobe_dataset::write_atomically;
use partprobe_formats::{Array, Half, Values};
use partprobe_net::{Backend, Model, ModelFile, Tokens};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Embed STEP files, carriers, meshes or point clouds with a trained backbone.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe embed runs/mine bracket.step --supervision step-parts --out embeddings/
  partprobe embed model.safetensors scan.ply mesh.obj --form points --dtype f16 --out embeddings/

RUN is a run folder, or the model.safetensors of one, which says itself what network it is and how shapes are prepared.
STEP files, carriers and meshes are sampled by [sample], keyed by the shape's id: give the carrier of a data set for its
very points. Points (PLY with nx ny nz; NPZ with points and normals) are taken as they are.
Each shape gives <id>.npz with points, normals and
  --form tokens  embeddings (tokens, dim), token_of_point u32 and multiplicity u32:
                 f['embeddings'][f['token_of_point']] has a row for each point
  --form points  embeddings (points, dim)
Exit codes: 0 every file was embedded, 1 some or none, 2 wrong usage.")]
pub(crate) struct EmbedArgs {
    /// The run folder with the trained backbone, or a file of weights.
    #[arg(value_name = "RUN|WEIGHTS")]
    run: PathBuf,
    /// STEP files (.step, .stp), carriers and points (.npz), meshes (.ply, .obj, .off, .stl), points (.ply).
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// The folder to write to.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Which backbone of the run; the config's first supervision if not given.
    #[arg(long, value_name = "SOURCE")]
    supervision: Option<String>,
    /// Which training seed; the config's first if not given.
    #[arg(long)]
    seed: Option<u64>,
    /// A row for each token, with the token of each point, or a row for each point.
    #[arg(long, value_enum, default_value_t = Form::Tokens)]
    form: Form,
    /// The type of the embeddings.
    #[arg(long, value_enum, default_value_t = Precision::F32)]
    dtype: Precision,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// What an embedding file has a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Form {
    /// Each token.
    Tokens,
    /// Each point.
    Points,
}

/// The types that embeddings are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Precision {
    /// `float32`.
    F32,
    /// `float16`.
    F16,
}

/// Embeds each file; one that fails is named, and does not keep the others from being embedded.
///
/// # Errors
/// If the run has no such backbone, a file could not be embedded, or the output cannot be written.
pub(crate) fn embed(args: &EmbedArgs) -> Result<ExitCode> {
    let execution = Execution::new(&args.execution)?;
    let (model, config) = if args.run.is_file() {
        model_of_file(args, execution.backend)?
    } else {
        model_of_run(args, execution.backend)?
    };
    fs::create_dir_all(&args.out).with_context(|| format!("making {}", args.out.display()))?;
    let bar = execution.progress.bar("embed", args.paths.len());
    let mut n_failed = 0;
    for path in &args.paths {
        // What cannot be read concerns one file; what cannot be written concerns all that follow.
        match args.embedded_path(path, &model, &config) {
            Ok(files) => files
                .iter()
                .try_for_each(|(file, bytes)| args.write(file, bytes))?,
            Err(error) => {
                execution
                    .progress
                    .note(&format!("{}: {error:#}", path.display()));
                n_failed += 1;
            }
        }
        bar.inc(1);
        ensure!(
            !execution.interrupt.is_set(),
            "interrupted; the files that were printed are written"
        );
    }
    bar.finish();
    ensure!(n_failed < args.paths.len(), "no file could be embedded");
    let paths = counted(args.paths.len(), "file", "files");
    ensure!(
        n_failed == 0,
        "{n_failed} of {paths} could not be embedded; the others are written"
    );
    Ok(ExitCode::SUCCESS)
}

/// The backbone of a run folder, with the run's own settings.
fn model_of_run(args: &EmbedArgs, backend: Backend) -> Result<(Model, Config)> {
    let folder = RunFolder::existing(&args.run)?;
    let config = load(
        &folder.path("config.toml").to_string_lossy(),
        &args.execution.set,
    )?
    .config;
    let compare = &config.compare;
    let supervision = args.supervision.as_ref().unwrap_or(&compare.supervision[0]);
    ensure!(
        compare.supervision.contains(supervision),
        UsageError(format!(
            "the run has no backbone `{supervision}`, only {}",
            compare.supervision.join(", ")
        ))
    );
    let weights = read_weights(&folder, supervision, args.seed.unwrap_or(compare.seeds[0]))?;
    Ok((
        Model::from_safetensors(&config.net, &weights, backend)?,
        config,
    ))
}

/// The backbone of a file of weights, with the settings that stand in it over those of `base`.
fn model_of_file(args: &EmbedArgs, backend: Backend) -> Result<(Model, Config)> {
    ensure!(
        args.supervision.is_none() && args.seed.is_none(),
        UsageError(
            "--supervision and --seed choose a backbone of a run folder; a file of weights holds one".to_owned()
        )
    );
    let bytes = fs::read(&args.run).with_context(|| format!("reading {}", args.run.display()))?;
    let ModelFile {
        model, preparation, ..
    } = ModelFile::from_bytes(&bytes, backend).with_context(|| args.run.display().to_string())?;
    let mut overrides = overrides_of_preparation(&preparation);
    overrides.extend(args.execution.set.iter().cloned());
    let mut config = load("base", &overrides)?.config;
    // The layer behind the head belongs to the file, unless the user asks for another one.
    let refine = config.net.refine.take();
    config.net = model.config().clone();
    config.net.refine = refine.or(config.net.refine);
    Ok((model, config))
}

impl EmbedArgs {
    /// The embedding files of a path's shapes.
    fn embedded_path(
        &self,
        path: &Path,
        model: &Model,
        config: &Config,
    ) -> Result<Vec<(PathBuf, Vec<u8>)>> {
        let mut files = Vec::new();
        for shape in shapes_of_path(path, config)? {
            let file = self.out.join(format!("{}.npz", shape.id));
            let is_there = file.exists() || files.iter().any(|(other, _)| *other == file);
            ensure!(
                !is_there,
                "{} is there already; choose another --out for shapes of one name",
                file.display()
            );
            files.push((file, self.embedded(&shape, model, config)?));
        }
        Ok(files)
    }

    fn write(&self, file: &Path, bytes: &[u8]) -> Result<()> {
        write_atomically(file, bytes)?;
        print_result(file.display())
    }

    fn embedded(&self, shape: &EmbedInput, model: &Model, config: &Config) -> Result<Vec<u8>> {
        let (tokens, raw) = model.embed_sample(&shape.sample, &config.tokens)?;
        let embeddings = match &config.net.refine {
            None => raw,
            Some(refine) => refine.refined(&raw, &tokens.multiplicity)?,
        };
        let mut members = match self.form {
            Form::Tokens => embedding_members(&tokens, &embeddings)?,
            Form::Points => vec![("embeddings".to_owned(), point_rows(&tokens, &embeddings)?)],
        };
        if self.dtype == Precision::F16 {
            members[0].1 = narrowed(&members[0].1)?;
        }
        members.push(("points".to_owned(), Array::rows(&shape.sample.points)));
        members.push(("normals".to_owned(), Array::rows(&shape.sample.normals)));
        npz_bytes(members)
    }
}

/// The row of each point: that of its token.
fn point_rows(tokens: &Tokens, embeddings: &Embeddings) -> Result<Array> {
    let rows = tokens
        .token_of_point
        .iter()
        .flat_map(|&token| embeddings.row(token as usize))
        .copied()
        .collect();
    let shape = vec![tokens.token_of_point.len(), embeddings.dim()];
    Array::with_shape(shape, Values::F32(rows)).context("an embedding for each point")
}

fn narrowed(array: &Array) -> Result<Array> {
    let Values::F32(values) = array.values() else {
        return Ok(array.clone());
    };
    let halves = values.iter().map(|&x| Half::from_f32(x)).collect();
    Array::with_shape(array.shape().to_vec(), Values::F16(halves)).context("a half for each number")
}
