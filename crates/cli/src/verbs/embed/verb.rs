//! Defines the arguments of `embed`, and its loop over files.

use super::input::{EmbedInput, shapes_of_path};
use crate::backbone::{Backbone, BackboneArgs};
use crate::counted::counted;
use crate::run::{Execution, ExecutionArgs, embedding_members, npz_bytes};
use crate::stdout::print_result;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::Embeddings;
use partprobe_dataset::write_atomically;
use partprobe_formats::{Array, Half, Values};
use partprobe_net::Tokens;
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
    #[command(flatten)]
    backbone: BackboneArgs,
    /// STEP files (.step, .stp), carriers and points (.npz), meshes (.ply, .obj, .off, .stl), points (.ply).
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// The folder to write to.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
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
    let backbone = args.backbone.open(&args.execution.set, execution.backend)?;
    fs::create_dir_all(&args.out).with_context(|| format!("making {}", args.out.display()))?;
    let bar = execution.progress.bar("embed", args.paths.len());
    let mut n_failed = 0;
    for path in &args.paths {
        // What cannot be read concerns one file; what cannot be written concerns all that follow.
        match args.embedded_path(path, &backbone) {
            Ok(files) => files
                .iter()
                .try_for_each(|(file, bytes)| args.write(file, bytes))?,
            Err(error) => {
                execution
                    .progress
                    .note(&format!("warning: {}: {error:#}", path.display()));
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

impl EmbedArgs {
    /// The embedding files of a path's shapes.
    fn embedded_path(&self, path: &Path, backbone: &Backbone) -> Result<Vec<(PathBuf, Vec<u8>)>> {
        let mut files = Vec::new();
        for shape in shapes_of_path(path, &backbone.config)? {
            let file = self.out.join(format!("{}.npz", shape.id));
            let is_there = file.exists() || files.iter().any(|(other, _)| *other == file);
            ensure!(
                !is_there,
                "{} is there already; choose another --out for shapes of one name",
                file.display()
            );
            files.push((file, self.embedded(&shape, backbone)?));
        }
        Ok(files)
    }

    fn write(&self, file: &Path, bytes: &[u8]) -> Result<()> {
        write_atomically(file, bytes)?;
        print_result(file.display())
    }

    fn embedded(&self, shape: &EmbedInput, backbone: &Backbone) -> Result<Vec<u8>> {
        let (tokens, embeddings) = backbone.embedded(&shape.sample)?;
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
