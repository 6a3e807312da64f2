//! Defines the arguments of `embed`, and its loop over shapes.

use super::form::{Form, Precision, is_of};
use super::index::{FILE as INDEX_FILE, IndexLine, drop_outdated, read_index, write_index};
use super::input::{Input, Inputs};
use super::library_model::{FILE as MODEL_FILE, LibraryModel};
use crate::backbone::{Backbone, BackboneArgs, ensure_preparation};
use crate::counted::counted;
use crate::folder_lock::FolderLock;
use crate::given_path::are_same_path;
use crate::output_folder::{ensure_still_there, make_folder, remove_unfinished};
use crate::own_output::OwnOutput;
use crate::run::{Execution, ExecutionArgs};
use crate::stderr;
use crate::stdout::print_result;
use anyhow::{Context, Result, anyhow, bail, ensure};
use partprobe_dataset::write_atomically;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Embed STEP files, carriers, meshes or point clouds with a trained backbone.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe embed runs/mine bracket.step --supervision step-parts --out embeddings/
  partprobe embed model.safetensors scan.ply mesh.obj --form points --dtype f16 --out embeddings/
  partprobe embed runs/mine dataset/ --form shapes --out library/       for `partprobe nearest`

RUN is a run folder, or the model.safetensors of one. The file contains the settings of the network and those for preparing
shapes.
STEP files, carriers and meshes are sampled by [sample], keyed by the id of the shape. To get the same points as in a data set, give
its carriers. Points (PLY with nx ny nz; NPZ with points and normals) are taken as they are.
--set accepts the keys for preparing shapes: label.*, sample.*, net.refine, tokens.test_tokens, tokens.test_poses, tokens.voxels.
Each shape gives <id>.npz with
  --form tokens  embeddings (tokens, dim), token_of_point u32 and multiplicity u32:
                 f['embeddings'][f['token_of_point']] has a row for each point
  --form points  embeddings (points, dim)
  --form faces   embeddings (faces, dim): the direction of the mean over the points of each face, and n_points u32 (faces); a face
                 without a point has a row of zeros
  --form shapes  embeddings (1, dim): the direction of the mean over all points. `partprobe nearest` searches them
With --form tokens or points, the file also contains points, normals, and face_of_point i32 if the shape has a B-Rep. index.jsonl
has a line for each shape, and is written last.
Exit codes: 0 at least one file was embedded (with --strict: all of them), 1 none, 2 wrong usage.")]
pub(crate) struct EmbedArgs {
    #[command(flatten)]
    backbone: BackboneArgs,
    /// STEP files (.step, .stp), carriers and points (.npz), meshes (.ply, .obj, .off, .stl), points (.ply, .npy, .xyz, .pts);
    /// folders, archives, lists (.txt) and data sets of them; `-` is the standard input.
    #[arg(value_name = "PATH", required = true)]
    paths: Vec<PathBuf>,
    /// The folder to write to.
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// What a row of the embeddings belongs to: each token (the token of each point is written, too), each point, each face, or
    /// the shape.
    #[arg(long, value_enum, default_value_t = Form::Tokens)]
    form: Form,
    /// The type of the embeddings.
    #[arg(long, value_enum, default_value_t = Precision::F32)]
    dtype: Precision,
    /// Keep existing files, and embed the other shapes. Shapes of earlier calls stay in the index as long as their files exist.
    #[arg(long)]
    resume: bool,
    /// Replace the embeddings of an earlier call.
    #[arg(long, conflicts_with = "resume")]
    force: bool,
    /// Exit with 1 if any file could not be embedded.
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    execution: ExecutionArgs,
}

/// The files of the verb.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "embed",
    marker: Some(MODEL_FILE),
    is_own: |name| [MODEL_FILE, INDEX_FILE].contains(&name) || name.ends_with(".npz"),
};

/// Embeds each shape. A shape that fails is named, and the others are still embedded.
///
/// # Errors
/// If the run has no such backbone, a shape could not be embedded, or the output cannot be written.
pub(crate) fn embed(args: &EmbedArgs) -> Result<ExitCode> {
    let execution = Execution::new(&args.execution.machine)?;
    ensure_preparation(&args.execution.set, &[])?;
    let backbone = args.backbone.open(&args.execution.set, execution.backend)?;
    // Before the folder is made, so that inputs without a shape do not leave it behind.
    let inputs = Inputs::open(&args.paths, &backbone.config, &execution)?;
    let doing = "embedding into";
    let _lock = if args.resume {
        make_folder(&args.out)?;
        FolderLock::take(&args.out, doing)?
    } else {
        OUTPUT.take(&args.out, doing, args.force, &args.paths)?
    };
    let model = LibraryModel::of(
        &args.backbone,
        &backbone.weights_sha256,
        &args.execution.set,
        args.form,
    )?;
    model.ensure_fits(&args.out)?;
    if LibraryModel::is_in(&args.out) {
        remove_unfinished(&args.out)?;
    }
    let mut lines = Vec::new();
    let mut sources = BTreeMap::new();
    let earlier = earlier_lines(&args.out)?;
    let mut n_kept = 0;
    let bar = execution.progress.bar("embed", inputs.list().len());
    for input in inputs.list() {
        // A read error concerns one input, but a write error concerns all following ones.
        match args.embedded_input(input, &backbone, (&sources, &earlier)) {
            Ok(files) => {
                for (id, file, bytes) in files {
                    sources.insert(id.clone(), input.name());
                    args.write(&file, bytes.as_deref())?;
                    if lines.is_empty() {
                        model.write(&args.out)?;
                    }
                    n_kept += usize::from(bytes.is_none());
                    lines.push(IndexLine::written(&id, &input.name(), input.given()));
                }
            }
            Err(error) => {
                let line = IndexLine::failed(&input.name(), input.given(), &error);
                execution.progress.note(&format!("warning: {line}"));
                lines.push(line);
            }
        }
        bar.inc(1);
        ensure!(
            !execution.interrupt.is_set(),
            "interrupted; the files that were printed are written, and --resume embeds the others"
        );
    }
    bar.finish();
    if n_kept > 0 {
        let kept = counted(n_kept, "file was there already", "files were there already");
        execution.progress.note(&format!("{kept}: they stay"));
    }
    conclude(args, &lines)
}

/// Writes the index, and reports how many inputs could not be embedded.
fn conclude(args: &EmbedArgs, lines: &[IndexLine]) -> Result<ExitCode> {
    let out = &args.out;
    let n_failed = lines.iter().filter(|line| line.is_failed()).count();
    if n_failed == lines.len() {
        drop_outdated(out, lines)?;
        bail!("no file could be embedded");
    }
    write_index(out, lines)?;
    if n_failed == 0 {
        return Ok(ExitCode::SUCCESS);
    }
    let paths = counted(lines.len(), "file", "files");
    stderr::print_line(format_args!(
        "{n_failed} of {paths} could not be embedded; the others are written"
    ));
    Ok(if args.strict {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    })
}

/// The lines of earlier calls, by the ids of their shapes.
fn earlier_lines(out: &Path) -> Result<BTreeMap<String, IndexLine>> {
    let lines = read_index(out)?.into_iter();
    Ok(lines.map(|line| (line.id.clone(), line)).collect())
}

/// Whether both are files that exist, and not the same one. A file that was moved or edited is the same input.
fn are_two_files(one: &str, other: &str) -> bool {
    let [one, other] = [one, other].map(Path::new);
    one.is_file() && other.is_file() && !are_same_path(one, other)
}

/// Whether a shape of an earlier call was given with another file, folder, archive or data set, which is still there. A file may be
/// given by itself once, and with its folder another time.
fn is_given_elsewhere(earlier: &IndexLine, input: &Input) -> bool {
    let (Some(one), Some(other)) = (earlier.given.as_deref().map(Path::new), input.given()) else {
        return false;
    };
    let is_within = one.starts_with(other) || other.starts_with(one);
    !is_within && one.exists() && !are_same_path(one, other)
}

/// The id of a shape, its file, and the bytes. There are no bytes if the file already exists.
type EmbeddedFile = (String, PathBuf, Option<Vec<u8>>);

impl EmbedArgs {
    /// The embedding files of the shapes of an input. `sources` has the inputs of this call by their ids so far, and `earlier` the
    /// lines of earlier calls.
    fn embedded_input(
        &self,
        input: &Input,
        backbone: &Backbone,
        (sources, earlier): (&BTreeMap<String, String>, &BTreeMap<String, IndexLine>),
    ) -> Result<Vec<EmbeddedFile>> {
        let mut files: Vec<EmbeddedFile> = Vec::new();
        for shape in input.shapes(&backbone.config)? {
            let file = self.out.join(format!("{}.npz", shape.id));
            if let Some(other) = sources.get(&shape.id) {
                bail!(
                    "{other} has the same id, {}; rename one of the two files, or embed them into two folders",
                    shape.id
                );
            }
            ensure!(
                files.iter().all(|(id, ..)| *id != shape.id),
                "two of its shapes have the id {}",
                shape.id
            );
            let earlier = earlier.get(&shape.id);
            let refusal = |earlier: &IndexLine| {
                let IndexLine { source, given, .. } = earlier;
                let given = given.as_deref().map(|given| format!(" ({given})"));
                anyhow!(
                    "{source}{} has the same id, {}, and is there already; rename one of the two files, or choose another --out",
                    given.unwrap_or_default(),
                    shape.id
                )
            };
            let is_other_file =
                |earlier: &&IndexLine| are_two_files(&earlier.source, &input.name());
            if let Some(other) = earlier.filter(is_other_file) {
                return Err(refusal(other));
            }
            if self.resume && file.exists() && is_of(&file, &shape) {
                files.push((shape.id, file, None));
                continue;
            }
            // The file is that of an older version of the input, or of another input.
            if let Some(other) = earlier.filter(|earlier| is_given_elsewhere(earlier, input)) {
                return Err(refusal(other));
            }
            let bytes = self.form.file(&shape, backbone, self.dtype)?;
            files.push((shape.id, file, Some(bytes)));
        }
        Ok(files)
    }

    fn write(&self, file: &Path, bytes: Option<&[u8]>) -> Result<()> {
        let Some(bytes) = bytes else {
            return Ok(());
        };
        ensure_still_there(&self.out)?;
        if let Some(folder) = file.parent() {
            fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
        }
        write_atomically(file, bytes)?;
        print_result(file.display())
    }
}
