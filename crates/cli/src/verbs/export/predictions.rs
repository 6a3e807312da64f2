//! Runs `partprobe predict`: a trained backbone divides shapes into parts.
//!
//! Data sets, and shapes of any kind that `label` reads, go in. For each shape, its carrier with the predicted labels, one label
//! per face, and one label per point come out. Nothing is scored here.

use super::batch::Files;
use super::common_args::FolderArgs;
use super::mesh_files::with_suffix;
use super::outputs::Outputs;
use super::predicted_labels::{LAYER, PredictedLabels};
use super::session::ExportSession;
use super::shape_line::ShapeLine;
use crate::backbone::{Backbone, BackboneArgs, ensure_preparation};
use crate::config::is_set;
use crate::counted::counted;
use crate::points::points_of;
use crate::run::npz_bytes;
use crate::shape_input::{PREDICTIONS, SHAPES_FILE, ShapeInput};
use crate::stderr;
use crate::usage::UsageError;
use anyhow::{Context, Result, ensure};
use partprobe_carrier::{Carrier, ShapeKind};
use partprobe_cluster::{ClustererFactory, Modes};
use partprobe_formats::{Array, Compression, carrier_from_npz, carrier_to_npz, integer_lines};
use partprobe_net::Backend;
use serde_json::json;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The files that this verb writes.
const OUTPUTS: &[Outputs] = &[Outputs {
    extensions: &["npz", "seg"],
    file_names: &[],
}];
/// The clusterer if the number of clusters is given.
const TAKES_K: &str = "k-means";

/// Divide shapes into parts with a trained backbone
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe predict runs/mine bracket.step --out parts/
  partprobe predict model.safetensors scan.ply mesh.obj --k 6 --out parts/
  partprobe predict runs/mine dataset/ --k step-parts --clusterer average-link --out parts/
  partprobe predict runs/mine library/ --out parts/ --resume        after an interruption, or with new files
  partprobe render parts/bracket.npz --color predicted -o parts.png
  partprobe export glb parts/bracket.npz --label predicted --out glb/

RUN is a run folder, or the model.safetensors of one. Shapes are prepared with the settings of the run.
Each shape gives
  <id>.npz         its carrier with the label layer `predicted`; for a mesh or a point cloud, these labels replace given ones
  <id>.seg         a label for each face, in the order of the file; only for shapes with a B-Rep
  <id>.points.npz  points, normals and predicted i32: a label for each point that was embedded
A face takes the label that most of its points have. A face without a point takes that of the nearest point.
Exit codes: 0 at least one shape was divided, 1 none, or a carrier is damaged, 2 wrong usage.")]
pub(crate) struct PredictArgs {
    #[command(flatten)]
    backbone: BackboneArgs,
    #[command(flatten)]
    folder: FolderArgs,
    /// The number of parts: `auto` finds it, `step-parts` takes as many as the part rule finds, or a number. `auto` counts the
    /// modes of a mean shift. Its settings are those of `net.refine` or, without this key, 8 steps and kappa 20.
    #[arg(long, value_name = "K", default_value = "auto")]
    k: PartCount,
    /// The clustering: `k-means` or `average-link` if --k gives the number of parts, and `k-means` without this option. With `--k
    /// auto` it is always `modes`.
    #[arg(long, value_name = "NAME")]
    clusterer: Option<String>,
    /// Keep the shapes that are already in --out, and divide the others.
    #[arg(long, conflicts_with = "force")]
    resume: bool,
}

/// The way in which the number of parts is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum PartCount {
    /// The clustering finds it.
    Auto,
    /// It is the number that the part rule finds.
    StepParts,
    /// It is this number.
    Fixed(usize),
}

impl FromStr for PartCount {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("auto", _) => Ok(Self::Auto),
            ("step-parts", _) => Ok(Self::StepParts),
            (_, Ok(n @ 1..)) => Ok(Self::Fixed(n)),
            _ => Err("give auto, step-parts or a number from 1 up".to_owned()),
        }
    }
}

impl fmt::Display for PartCount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::StepParts => f.write_str("step-parts"),
            Self::Fixed(n) => write!(f, "{n}"),
        }
    }
}

/// Divides the shapes.
///
/// # Errors
/// If there is no such backbone, no shape could be divided, or the folder cannot be written to.
pub(crate) fn predict(args: &PredictArgs) -> Result<()> {
    let clusterer = args.clusterer()?;
    let backbone = args.open_backbone()?;
    let settings = json!({
        "clusterer": clusterer.name,
        "eval": {
            "max_iterations": backbone.config.eval.max_iterations,
            "restarts": backbone.config.eval.restarts,
            "seed": backbone.config.eval.seed,
            "tolerance": backbone.config.eval.tolerance,
        },
        "k": args.k.to_string(),
        "label": backbone.config.label,
        "refine": backbone.config.net.refine,
        "sample": backbone.config.sample,
        "tokens": backbone.config.tokens,
        "weights_sha256": backbone.weights_sha256,
    });
    let folder = args.folder_for(&backbone)?;
    let session = if args.resume {
        ExportSession::resumed(PREDICTIONS, &folder, &settings)?
    } else {
        ExportSession::new(PREDICTIONS, &folder, &settings, OUTPUTS)?
    };
    let session = session.resumable();
    let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();
    let prediction = Prediction {
        backbone: &backbone,
        clusterer,
        k: args.k,
    };
    let finished = |shape: &ShapeInput, carrier: &Carrier| {
        let paths = paths_of(shape, carrier);
        let is_finished = args.resume && are_of(&paths, &args.folder.out, carrier);
        if args.resume && !is_finished && args.folder.out.join(&paths[0]).is_file() {
            stderr::print_line(format_args!(
                "{}: its files are of another version of it, or of another shape with this name, and are replaced",
                shape.id
            ));
        }
        is_finished.then_some(paths)
    };
    let mut lines = session
        .batch()
        .write_missing(&shapes, finished, |shape, carrier| {
            prediction.files(shape, carrier)
        })?;
    lines.extend(session.sources.failed.iter().map(ShapeLine::from));
    if args.resume {
        let earlier = earlier_lines(&args.folder.out, &lines)?;
        lines.extend(earlier);
    }
    session.batch().conclude(&lines)
}

/// The lines of earlier calls for shapes that this call does not name, as long as their files exist. If an input cannot be read any
/// more, its earlier files are named and no longer listed. They are not removed, because a shape of another data set may have the
/// same name.
///
/// # Errors
/// If the list of shapes cannot be read.
fn earlier_lines(out: &Path, lines: &[ShapeLine]) -> Result<Vec<ShapeLine>> {
    let path = out.join(SHAPES_FILE);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = fs::read_to_string(&path).with_context(|| format!("reading {}", path.display()))?;
    let mut kept = Vec::new();
    for line in text.lines() {
        let earlier: ShapeLine = serde_json::from_str(line)
            .with_context(|| format!("{} is not a list of shapes", path.display()))?;
        let has_failed = |line: &ShapeLine| line.files.is_empty();
        let listed = lines.iter().find(|line| line.id == earlier.id);
        let is_outdated = listed.map_or_else(
            || {
                lines
                    .iter()
                    .any(|line| line.source == earlier.source && has_failed(line))
            },
            has_failed,
        );
        if is_outdated {
            for file in &earlier.files {
                stderr::print_line(format_args!(
                    "{}: {file} is of an earlier call, and is no longer listed",
                    earlier.id
                ));
            }
            continue;
        }
        let exist = earlier.files.iter().all(|file| out.join(file).is_file());
        if listed.is_none() && exist && !has_failed(&earlier) {
            kept.push(earlier);
        }
    }
    Ok(kept)
}

impl PredictArgs {
    fn clusterer(&self) -> Result<&'static ClustererFactory> {
        let finds_k = self.k == PartCount::Auto;
        let default = if finds_k { Modes::NAME } else { TAKES_K };
        let name = self.clusterer.as_deref().unwrap_or(default);
        let found = ClustererFactory::named(name).ok_or_else(|| {
            UsageError(format!(
                "there is no clustering `{name}`, only {}",
                ClustererFactory::known_names()
            ))
        })?;
        ensure!(
            finds_k || name != Modes::NAME,
            UsageError(format!(
                "`--clusterer {name}` does not take a number of parts; choose k-means or average-link, or leave out --k"
            ))
        );
        ensure!(
            !finds_k || name == Modes::NAME,
            UsageError(format!(
                "`--clusterer {name}` needs the number of parts; give --k N or --k step-parts"
            ))
        );
        Ok(found)
    }

    /// Opens the backbone. If the clustering must find the number of parts, a mean shift follows the network, and its modes are
    /// the parts.
    fn open_backbone(&self) -> Result<Backbone> {
        let overrides = self.folder.shapes.settings();
        ensure_preparation(overrides, &["eval."])?;
        let mut backbone = self.backbone.open(overrides, Backend::default())?;
        if self.k == PartCount::Auto && !is_set(overrides, "net.refine") {
            backbone.config.net.refine.get_or_insert_default();
        }
        Ok(backbone)
    }

    /// The arguments for the shapes, with the labeling settings of the backbone's training data.
    fn folder_for(&self, backbone: &Backbone) -> Result<FolderArgs> {
        let mut folder = self.folder.clone();
        let settings = backbone.config.labeling_overrides()?;
        folder.shapes = folder
            .shapes
            .with_settings(settings)
            .for_more_than_labeling();
        Ok(folder)
    }
}

/// The data with which all shapes are divided.
struct Prediction<'a> {
    backbone: &'a Backbone,
    clusterer: &'static ClustererFactory,
    k: PartCount,
}

impl Prediction<'_> {
    fn files(&self, shape: &ShapeInput, carrier: &Carrier) -> Result<Files> {
        let config = &self.backbone.config;
        let sample = points_of(&carrier.meta().id, carrier, &config.sample)?;
        let (tokens, embeddings) = self.backbone.embedded(&sample)?;
        let n_parts = self.n_parts(carrier, tokens.multiplicity.len())?;
        let clusterer = (self.clusterer.make)(&config.eval.clusterer_settings());
        let clusters = clusterer.cluster(
            &embeddings,
            &tokens.multiplicity,
            n_parts,
            config.eval.seed,
            &shape.id,
        )?;
        let of_point = tokens
            .token_of_point
            .iter()
            .map(|&token| clusters.assignment[token as usize] as i32)
            .collect();
        let labels = PredictedLabels::new(carrier, &sample, of_point);

        let labeled = labels.carrier(carrier)?;
        let points = vec![
            ("points".to_owned(), Array::rows(&sample.points)),
            ("normals".to_owned(), Array::rows(&sample.normals)),
            (
                "predicted".to_owned(),
                Array::vector(labels.of_point().to_vec()),
            ),
        ];
        let mut contents = vec![
            carrier_to_npz(&labeled, Compression::Stored)?,
            npz_bytes(points)?,
        ];
        if carrier.kind() == ShapeKind::Brep {
            contents.push(integer_lines(&labels.of_faces(carrier)).into_bytes());
        }
        Ok(paths_of(shape, carrier).into_iter().zip(contents).collect())
    }

    /// The requested number of clusters: at most one per token.
    fn n_parts(&self, carrier: &Carrier, n_tokens: usize) -> Result<usize> {
        match self.k {
            // A clustering that finds the number ignores this value.
            PartCount::Auto => Ok(1),
            PartCount::Fixed(n) => {
                ensure!(
                    n <= n_tokens,
                    "it has {}, too few for {n} parts; give a smaller --k",
                    counted(n_tokens, "token", "tokens")
                );
                Ok(n)
            }
            PartCount::StepParts => {
                ensure!(
                    carrier.kind() == ShapeKind::Brep,
                    "it has no B-Rep, so the part rule finds no parts; give --k a number, or `auto`"
                );
                Ok(carrier.n_parts().clamp(1, n_tokens.max(1)))
            }
        }
    }
}

/// The files of a shape, in the order in which they are written: its carrier, its points, and the labels of its faces if it has a
/// B-Rep.
fn paths_of(shape: &ShapeInput, carrier: &Carrier) -> Vec<PathBuf> {
    let mut suffixes = vec!["npz", "points.npz"];
    if carrier.kind() == ShapeKind::Brep {
        suffixes.push("seg");
    }
    let path = |suffix| with_suffix(&shape.stem, suffix);
    suffixes.into_iter().map(path).collect()
}

/// Whether all files of a shape exist, and were made from this carrier. A shape that has changed since is divided again.
fn are_of(paths: &[PathBuf], out: &Path, carrier: &Carrier) -> bool {
    if paths.iter().any(|path| !out.join(path).is_file()) {
        return false;
    }
    let Ok(bytes) = fs::read(out.join(&paths[0])) else {
        return false;
    };
    let Ok(made) = carrier_from_npz(&bytes) else {
        return false;
    };
    if carrier.kind() != ShapeKind::Brep {
        // Its carrier is made anew from its points and triangles, which its file decides.
        let [made, given] = [made.meta(), carrier.meta()];
        return made.id == given.id && made.source_sha256 == given.source_sha256;
    }
    // The labels of the part rule count, too: they are in the file, and may be the number of parts.
    let layer = made.layer(LAYER).cloned();
    let again = layer.and_then(|layer| carrier.clone().with_layer(LAYER, layer).ok());
    let again = again.and_then(|again| carrier_to_npz(&again, Compression::Stored).ok());
    again.is_some_and(|again| again == bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_parts_is_found_taken_or_given() {
        for (text, expected) in [
            ("auto", Some(PartCount::Auto)),
            ("step-parts", Some(PartCount::StepParts)),
            ("7", Some(PartCount::Fixed(7))),
            ("0", None),
            ("-1", None),
            ("many", None),
        ] {
            assert_eq!(text.parse::<PartCount>().ok(), expected, "{text}");
        }
    }
}
