//! `partprobe embed`: a trained backbone on any STEP file or carrier.

use super::evaluation::{embedding_members, npz_bytes};
use super::folder::RunFolder;
use super::stages::{Execution, ExecutionArgs, weights_path};
use crate::atomic_write::write_atomically;
use crate::config::{Config, load};
use crate::label::carriers_of_path;
use crate::sample::points_of;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use carrier::Carrier;
use formats::Array;
use net::Model;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Embed STEP files or carriers with a trained backbone.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe embed runs/mine bracket.step --supervision step-parts --out embeddings/
The points are drawn by the shape's id, seed and settings: give the carrier of a data set for its very points.
Each shape gives <id>.npz with points, normals, embeddings f32 (tokens, dim), token_of_point and multiplicity:
numpy.load(f)['embeddings'][numpy.load(f)['token_of_point']] has a row for each point.")]
pub struct EmbedArgs {
    /// The run folder with the trained backbone.
    #[arg(value_name = "RUN")]
    run: PathBuf,
    /// STEP files (.step, .stp) or carriers (.npz).
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
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// Embeds each file; a file that fails is named, and the rest goes on.
///
/// # Errors
/// If the run has no such backbone, or the output cannot be written.
pub fn embed(args: &EmbedArgs) -> Result<ExitCode> {
    let folder = RunFolder::existing(&args.run)?;
    let loaded = load(&folder.path("config.toml").to_string_lossy(), &args.execution.set)?;
    let execution = Execution::new(&args.execution)?;
    let compare = &loaded.config.compare;
    let supervision = args.supervision.as_ref().unwrap_or(&compare.supervision[0]);
    ensure!(
        compare.supervision.contains(supervision),
        UsageError(format!("the run has no backbone `{supervision}`, only {}", compare.supervision.join(", ")))
    );
    let weights = folder.read(&weights_path(supervision, args.seed.unwrap_or(compare.seeds[0])))?;
    let model = Model::from_safetensors(&loaded.config.net, &weights, execution.backend)?;
    fs::create_dir_all(&args.out).with_context(|| format!("making {}", args.out.display()))?;
    let mut n_failed = 0;
    for path in &args.paths {
        if let Err(error) = embed_path(path, &model, &loaded.config, &args.out) {
            execution.progress.note(&format!("{}: {error:#}", path.display()));
            n_failed += 1;
        }
    }
    ensure!(n_failed < args.paths.len(), "no file could be embedded");
    Ok(ExitCode::SUCCESS)
}

fn embed_path(path: &Path, model: &Model, config: &Config, out: &Path) -> Result<()> {
    for carrier in carriers_of_path(path, &config.label)? {
        let file = out.join(format!("{}.npz", carrier.meta().id));
        ensure!(!file.exists(), "{} is there already; choose another --out for shapes of one name", file.display());
        write_atomically(&file, &embedded(&carrier, model, config)?)?;
        print_line(file.display())?;
    }
    Ok(())
}

fn embedded(carrier: &Carrier, model: &Model, config: &Config) -> Result<Vec<u8>> {
    let sample = points_of(&carrier.meta().id, carrier, &config.sample)?;
    let tokens = net::tokenize(&sample, config.tokens.test_tokens, config.tokens.voxels)?;
    let mut members = embedding_members(&tokens, &model.embed(&tokens)?)?;
    members.push(("points".to_owned(), Array::rows(&sample.points)));
    members.push(("normals".to_owned(), Array::rows(&sample.normals)));
    npz_bytes(members)
}
