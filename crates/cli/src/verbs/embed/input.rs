//! Makes the point samples that a backbone embeds, from files with a surface or points, and from the shapes of folders and data
//! sets.

use crate::config::{Attribute, Config, NormalConfig};
use crate::given_path::distinct_paths;
use crate::label::{carriers_of_path, warn_of_repeated};
use crate::points::points_of;
use crate::run::Execution;
use crate::shape_input::{FailedInput, ShapeArgs, ShapeInput, ShapeInputs};
use crate::standard_input::is_standard_input;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_carrier::{
    Carrier, Mesh, NormalKind, PointSample, ShapeKind, keyed_rng, sample_by_area,
};
use partprobe_formats::{
    Members, PlyScene, Values, arrays_from_npz, mesh_from_obj, mesh_from_off, mesh_from_stl,
    scene_from_ply, step_stem,
};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};

/// Points that are embedded together, with the name of their file.
pub(super) struct EmbedInput {
    pub(super) id: String,
    pub(super) sample: PointSample,
    /// The faces of a B-Rep.
    pub(super) faces: Option<SampledFaces>,
}

/// The face of each point.
pub(super) struct SampledFaces {
    pub(super) of_point: Vec<u32>,
    /// The number of faces.
    pub(super) n: usize,
}

impl EmbedInput {
    /// The SHA-256 of all data on which the embedding depends: points, normals, and the face of each point.
    pub(super) fn sha256(&self) -> [u8; 32] {
        let mut digest = Sha256::new();
        for rows in [&self.sample.points, &self.sample.normals] {
            digest.update((rows.len() as u64).to_le_bytes());
            for x in rows.iter().flatten() {
                digest.update(x.to_le_bytes());
            }
        }
        for face in self.faces.iter().flat_map(|faces| &faces.of_point) {
            digest.update(face.to_le_bytes());
        }
        digest.finalize().into()
    }

    /// The sample of a carrier.
    fn of_carrier(id: String, carrier: &Carrier, config: &Config) -> Result<Self> {
        let sample = points_of(&carrier.meta().id, carrier, &config.sample)?;
        let faces = (carrier.kind() == ShapeKind::Brep).then(|| {
            let face_of = |&triangle: &u32| carrier.mesh().tri_face[triangle as usize];
            SampledFaces {
                of_point: sample.triangles.iter().map(face_of).collect(),
                n: carrier.graph().faces.len(),
            }
        });
        Ok(Self { id, sample, faces })
    }
}

/// A file, or a shape of a folder, an archive, a list or a data set.
pub(super) struct Input {
    /// The absolute path that the user gave, or `None` for the standard input.
    given: Option<PathBuf>,
    kind: InputKind,
}

/// What is embedded.
enum InputKind {
    /// A file, and a prefix of its ids if another file of the call has the same name.
    File(PathBuf, Option<String>),
    Shape(ShapeInput),
    /// A file of a folder without a shape.
    Failed(FailedInput),
}

impl Input {
    /// Its name in messages and the index.
    pub(super) fn name(&self) -> String {
        match &self.kind {
            InputKind::File(path, _) => path.display().to_string(),
            InputKind::Shape(shape) => shape.source.clone(),
            InputKind::Failed(failed) => failed.source.clone(),
        }
    }

    /// The absolute path of the argument that it is of, or `None` for the standard input.
    pub(super) fn given(&self) -> Option<&Path> {
        self.given.as_deref()
    }

    /// Its shapes.
    ///
    /// # Errors
    /// If it cannot be read.
    pub(super) fn shapes(&self, config: &Config) -> Result<Vec<EmbedInput>> {
        match &self.kind {
            InputKind::File(path, prefix) => {
                let mut shapes = shapes_of_path(path, config)?;
                if let Some(prefix) = prefix {
                    for shape in &mut shapes {
                        shape.id = format!("{prefix}__{}", shape.id);
                    }
                }
                Ok(shapes)
            }
            InputKind::Shape(shape) => {
                let id = shape.stem.to_string_lossy().into_owned();
                Ok(vec![EmbedInput::of_carrier(id, &shape.carrier()?, config)?])
            }
            InputKind::Failed(failed) => bail!("{}", failed.reason),
        }
    }
}

/// All inputs of a call.
pub(super) struct Inputs {
    list: Vec<Input>,
    /// The opened inputs, which keep the folders with the files that were labeled on the way.
    _opened: Vec<ShapeInputs>,
}

impl Inputs {
    /// Lists the inputs. Folders, archives and lists are labeled with the settings of the backbone.
    ///
    /// # Errors
    /// If a folder, an archive or a list has no shape.
    pub(super) fn open(paths: &[PathBuf], config: &Config, execution: &Execution) -> Result<Self> {
        let mut inputs = Self {
            list: Vec::new(),
            _opened: Vec::new(),
        };
        let (paths, repeated) = distinct_paths(paths);
        warn_of_repeated(&repeated);
        for path in &paths {
            let given = absolute_unless_stdin(path)?;
            let input = |kind| Input {
                given: given.clone(),
                kind,
            };
            if !is_read_by_shape_input(path) {
                let prefix = folder_if_ambiguous(path, &paths);
                inputs
                    .list
                    .push(input(InputKind::File(path.clone(), prefix)));
                continue;
            }
            let args = ShapeArgs::of_path(path, execution.threads)
                .with_settings(config.labeling_overrides()?);
            let number = inputs._opened.len();
            let mut opened = args.open_for(&format!("embed-{number}"), &execution.interrupt)?;
            let shapes = opened.shapes.drain(..).map(InputKind::Shape);
            let failed = opened.failed.drain(..).map(InputKind::Failed);
            inputs.list.extend(shapes.chain(failed).map(input));
            inputs._opened.push(opened);
        }
        Ok(inputs)
    }

    /// The inputs, in the order of the call.
    pub(super) fn list(&self) -> &[Input] {
        &self.list
    }
}

/// The path as it is found from any folder, or `None` for the standard input.
fn absolute_unless_stdin(path: &Path) -> Result<Option<PathBuf>> {
    if is_standard_input(path) {
        return Ok(None);
    }
    let absolute = std::path::absolute(path);
    Ok(Some(
        absolute.with_context(|| format!("reading {}", path.display()))?,
    ))
}

/// The name of the folder of a file, if another path has the same file name without its ending.
fn folder_if_ambiguous(path: &Path, paths: &[PathBuf]) -> Option<String> {
    let same = paths
        .iter()
        .filter(|other| other.file_stem() == path.file_stem());
    if same.count() < 2 {
        return None;
    }
    let folder = path.canonicalize().ok()?.parent()?.file_name()?.to_owned();
    Some(folder.to_string_lossy().into_owned())
}

/// Whether a path is read by the reader of shapes that all verbs share: the standard input, a folder, an archive, a list, or rows
/// of numbers. Any other file is read in this module.
fn is_read_by_shape_input(path: &Path) -> bool {
    if is_standard_input(path) {
        return true;
    }
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let name = name.to_ascii_lowercase();
    let ends = |endings: &[&str]| endings.iter().any(|ending| name.ends_with(ending));
    let is_many = ends(&[".zip", ".7z", ".tar", ".tgz", ".txt"]) || name.contains(".tar.");
    let is_rows = ends(&[".npy", ".xyz", ".pts"]);
    path.is_dir() || (path.is_file() && (is_many || is_rows))
}

/// The shapes of a file: a STEP file gives all of its shapes, and any other file gives one.
///
/// Surfaces are sampled by the settings of `[sample]`. Points are used without changes.
///
/// # Errors
/// If the file cannot be read, is not of a known kind, or has nothing that could be embedded.
pub(super) fn shapes_of_path(path: &Path, config: &Config) -> Result<Vec<EmbedInput>> {
    ensure!(path.exists(), "it does not exist");
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let id = path
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let bytes = || fs::read(path).with_context(|| format!("reading {}", path.display()));
    let sample = match extension.to_str().unwrap_or_default() {
        "obj" => sample_of_mesh(&id, &mesh_from_obj(&bytes()?)?, config)?,
        "off" => sample_of_mesh(&id, &mesh_from_off(&bytes()?)?, config)?,
        "stl" => sample_of_mesh(&id, &mesh_from_stl(&bytes()?)?, config)?,
        "ply" => match scene_from_ply(&bytes()?)? {
            PlyScene::Mesh(mesh) => sample_of_mesh(&id, &mesh, config)?,
            PlyScene::Points { points, normals } => sample_of_points(points, normals)?,
        },
        "npz" => match sample_of_npz(&bytes()?)? {
            Some(sample) => sample,
            None => return carriers(path, config),
        },
        _ if step_stem(&name).is_some() => return carriers(path, config),
        other => bail!(UsageError(format!(
            "`{other}` is not a kind of file that can be embedded; give .step, .npz, .npy, .xyz, .pts, .ply, .obj, .off or .stl"
        ))),
    };
    Ok(vec![EmbedInput {
        id,
        sample,
        faces: None,
    }])
}

fn carriers(path: &Path, config: &Config) -> Result<Vec<EmbedInput>> {
    let mut label = config.label.clone();
    if config.sample.normals == NormalConfig::Analytic
        && !label.attributes.contains(&Attribute::Normal)
    {
        label.attributes.push(Attribute::Normal);
    }
    carriers_of_path(path, &label)?
        .into_iter()
        .map(|carrier| {
            let id = carrier.meta().id.clone();
            EmbedInput::of_carrier(id, &carrier, config)
        })
        .collect()
}

/// The sample of a mesh. It always has the normals of the triangles, because there are no true surfaces.
fn sample_of_mesh(id: &str, mesh: &Mesh, config: &Config) -> Result<PointSample> {
    let rng = &mut keyed_rng(config.sample.seed, &["sample", id]);
    Ok(sample_by_area(
        mesh,
        config.sample.n_points,
        NormalKind::Triangle,
        rng,
    )?)
}

fn sample_of_points(points: Vec<[f32; 3]>, normals: Vec<[f32; 3]>) -> Result<PointSample> {
    ensure!(!points.is_empty(), "the file has no points");
    ensure!(
        points.len() == normals.len(),
        "points need a normal each (nx ny nz in a PLY file, `normals` in an NPZ file); there are {} for {} points",
        normals.len(),
        points.len()
    );
    let triangles = vec![0; points.len()];
    Ok(PointSample {
        points,
        normals,
        triangles,
    })
}

/// The members `points` and `normals` of an archive. Returns `None` if it has no `points`, such as a carrier.
fn sample_of_npz(bytes: &[u8]) -> Result<Option<PointSample>> {
    let mut members = arrays_from_npz(bytes)?;
    if members.array("points").is_none() {
        return Ok(None);
    }
    let points = rows_of(&mut members, "points")?;
    let normals = if members.array("normals").is_some() {
        rows_of(&mut members, "normals")?
    } else {
        Vec::new()
    };
    sample_of_points(points, normals).map(Some)
}

/// Rows of three numbers, of either precision.
fn rows_of(members: &mut Members, name: &str) -> Result<Vec<[f32; 3]>> {
    let is_wide = members
        .array(name)
        .is_some_and(|array| matches!(array.values(), Values::F64(_)));
    if !is_wide {
        return Ok(members.rows(name)?);
    }
    let wide: Vec<[f64; 3]> = members.rows(name)?;
    Ok(wide.into_iter().map(|row| row.map(|x| x as f32)).collect())
}
