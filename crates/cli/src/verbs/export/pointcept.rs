//! Runs `partprobe export pointcept`: it writes points with normals, classes and instances. Related shapes are on the same side
//! of the split.

use super::batch::Files;
use super::common_args::CommonArgs;
use super::exporter::Exporter;
use super::folder::ExportFolder;
use super::outputs::Outputs;
use super::session::ExportSession;
use super::shape_line::ShapeLine;
use crate::config::{NormalConfig, SampleConfig};
use crate::points::points_of;
use crate::shape_input::ShapeInput;
use crate::usage::UsageError;
use anyhow::{Result, bail, ensure};
use partprobe_carrier::{Carrier, Descriptor, Labels, signature_of_carrier};
use partprobe_dataset::json_document;
use partprobe_eval::{
    Duplicate, NearShape, Split, SplitCandidate, SplitFractions, SplitRule, TrainShare, split,
};
use partprobe_formats::{
    POINTCEPT_EXPERIMENTS, pointcept_config, pointcept_experiments, pointcept_files,
};
use serde::Serialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

/// The names of the sides in Pointcept.
pub(crate) const SIDES: [&str; 3] = ["train", "val", "test"];
/// The Python file with the data section of a Pointcept config. Other Python files belong to the user.
const POINTCEPT_CONFIG: &str = "pointcept_data.py";
/// The file with the side of each shape.
const SPLIT_FILE: &str = "split.json";

/// What `pointcept` takes.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Example: partprobe export pointcept dataset/ --out pc/ --split 0.8/0.1/0.1 --seed 7

DIR/train/<id>/ contains coord.npy and normal.npy (float32, N x 3), segment.npy (int32: primitive type of the point's part, the
type with the largest area in it) and instance.npy (int32: the part, 0 to K-1 among those that got a point).
DIR/insseg.py and DIR/semseg.py are complete experiments for Pointcept: PTv3 with PointGroup, and PTv3 with a linear head.
DIR/README.md says how to run them, and DIR/pointcept_data.py is their data section. Equal shapes are written once. Shapes of
one file stay on one side, and shapes that are nearly equal to one of val or test are not written to train. split.json says
which shapes are on which side.
`partprobe check pointcept DIR` checks any such folder."
)]
pub(crate) struct PointceptArgs {
    #[command(flatten)]
    common: CommonArgs,
    /// The fractions of train, val and test.
    #[arg(long, default_value = "0.8/0.1/0.1", value_name = "TRAIN/VAL/TEST")]
    split: Shares,
    /// A shape is left out of train if it differs from one of val or test by at most this, in units of its size.
    #[arg(long, default_value_t = 0.03, value_name = "DIFFERENCE")]
    near_difference: f64,
    /// The number of points per shape. They are uniform by area.
    #[arg(long, default_value_t = 20_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000_000))]
    points: u32,
    /// The seed of the points and of the split.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// The normals of the points; `analytic` needs shapes that were labeled with `--attributes normal`.
    #[arg(long, value_enum, default_value_t = NormalConfig::Triangle)]
    normals: NormalConfig,
    /// Leave out shapes with fewer parts than this.
    #[arg(long, default_value_t = 1, value_name = "N")]
    min_parts: usize,
    /// Leave out shapes with more parts than this.
    #[arg(long, value_name = "N")]
    max_parts: Option<usize>,
}

/// `0.8/0.1/0.1`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shares(SplitFractions);

impl FromStr for Shares {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shares: Option<Vec<f64>> = text
            .split('/')
            .map(|share| share.trim().parse().ok())
            .collect();
        match shares.as_deref() {
            Some(&[train, valid, test]) => {
                let fractions = SplitFractions { train, valid, test };
                fractions.normalized().map_err(|error| error.to_string())?;
                Ok(Self(fractions))
            }
            _ => Err("three shares are needed, for example 0.8/0.1/0.1".to_owned()),
        }
    }
}

/// `split.json`: the sides by name, and the shapes that were left out.
#[derive(Serialize)]
struct SplitJson<'a> {
    format_version: u32,
    seed: u64,
    shares: [f64; 3],
    train: &'a [String],
    val: &'a [String],
    test: &'a [String],
    duplicates: &'a [partprobe_eval::Duplicate],
    groups: &'a BTreeMap<String, String>,
    /// Ids that are on no side, by reason.
    left_out: &'a BTreeMap<String, Vec<String>>,
}

impl Exporter for PointceptArgs {
    const NAME: &'static str = "pointcept";
    const EXTENSIONS: &'static [&'static str] = &["npy", "json"];
    const FILE_NAMES: &'static [&'static str] = &[
        POINTCEPT_CONFIG,
        POINTCEPT_EXPERIMENTS[0],
        POINTCEPT_EXPERIMENTS[1],
        POINTCEPT_EXPERIMENTS[2],
    ];

    fn export(&self, known: &'static [Outputs]) -> Result<()> {
        if self.max_parts.is_some_and(|most| most < self.min_parts) {
            bail!(UsageError("--max-parts is below --min-parts".to_owned()));
        }
        let SplitFractions { train, valid, test } = self.split.0;
        let settings = json!({
            "split": [train, valid, test], "near_difference": self.near_difference, "points": self.points, "seed": self.seed, "normals": self.normals,
            "min_parts": self.min_parts, "max_parts": self.max_parts,
        });
        let session = ExportSession::with_labels(Self::NAME, &self.common, &settings, known)?;
        let placed = SplitShapes::new(self, &session)?;
        placed.write_split(self, &session.folder)?;
        session
            .folder
            .write(Path::new(POINTCEPT_CONFIG), pointcept_config().as_bytes())?;
        for (name, text) in pointcept_experiments() {
            session.folder.write(Path::new(name), text.as_bytes())?;
        }
        let shapes: Vec<&ShapeInput> = session
            .sources
            .shapes
            .iter()
            .filter(|shape| placed.split.group_of(&shape.id).is_some())
            .collect();
        let mut lines = session.batch().write(&shapes, |shape, carrier| {
            shape_files(self, placed.side(&shape.id), shape, carrier)
        })?;
        for line in &mut lines {
            line.split = Some(placed.side(&line.id).to_owned());
            line.group = placed.split.group_of(&line.id).map(str::to_owned);
        }
        lines.extend(placed.failed);
        lines.extend(session.sources.failed.iter().map(ShapeLine::from));
        let counts: Vec<String> = SIDES
            .iter()
            .map(|side| {
                format!(
                    "{} {side}",
                    lines.iter().filter(|line| line.is_on(side)).count()
                )
            })
            .collect();
        let n_left_out: usize = placed.left_out.values().map(Vec::len).sum();
        crate::stdout::print_line(format_args!("{}, {n_left_out} left out", counts.join(", ")))?;
        session.batch().conclude(&lines)
    }
}

impl ShapeLine {
    fn is_on(&self, side: &str) -> bool {
        self.split.as_deref() == Some(side) && self.reason.is_none()
    }
}

/// The side of each shape, and those that are on none.
struct SplitShapes {
    split: Split,
    left_out: BTreeMap<String, Vec<String>>,
    failed: Vec<ShapeLine>,
}

impl SplitShapes {
    /// Reads every carrier once, for the data that the split needs.
    fn new(args: &PointceptArgs, session: &ExportSession) -> Result<Self> {
        let shapes: Vec<&ShapeInput> = session.sources.shapes.iter().collect();
        let looks = session.batch().map("compare", &shapes, |shape, carrier| {
            Look::at(args, shape, carrier)
        })?;
        let (mut candidates, mut failed) = (Vec::new(), Vec::new());
        let mut left_out: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (shape, look) in shapes.iter().zip(looks) {
            match look {
                Ok(Look::Candidate(candidate)) => candidates.push(*candidate),
                Ok(Look::LeftOut(reason)) => {
                    left_out.entry(reason).or_default().push(shape.id.clone())
                }
                Err(error) => failed.push(ShapeLine::failed(shape, &error)),
            }
        }
        let rule = SplitRule {
            fractions: args.split.0,
            near_difference: args.near_difference,
            train_share: TrainShare::ALL,
            seed: args.seed,
        };
        let split = split(&candidates, &rule).map_err(|error| UsageError(error.to_string()))?;
        if !split.duplicates.is_empty() {
            let ids = split
                .duplicates
                .iter()
                .map(|duplicate| duplicate.id.clone())
                .collect();
            left_out.insert(Duplicate::REASON.to_owned(), ids);
        }
        if !split.near.is_empty() {
            let ids = split.near.iter().map(|near| near.id.clone()).collect();
            left_out.insert(NearShape::REASON.to_owned(), ids);
        }
        ensure!(!split.groups.is_empty(), "no shape is left to export");
        Ok(Self {
            split,
            left_out,
            failed,
        })
    }

    fn side(&self, id: &str) -> &'static str {
        let sides = [&self.split.train, &self.split.valid, &self.split.test];
        let holds = |ids: &[String]| ids.binary_search_by(|other| other.as_str().cmp(id)).is_ok();
        SIDES
            .into_iter()
            .zip(sides)
            .find(|(_, ids)| holds(ids))
            .map_or(SIDES[0], |(side, _)| side)
    }

    fn write_split(&self, args: &PointceptArgs, folder: &ExportFolder) -> Result<()> {
        let SplitFractions { train, valid, test } = args.split.0;
        let document = SplitJson {
            format_version: partprobe_formats::FORMAT_VERSION,
            seed: args.seed,
            shares: [train, valid, test],
            train: &self.split.train,
            val: &self.split.valid,
            test: &self.split.test,
            duplicates: &self.split.duplicates,
            groups: &self.split.groups,
            left_out: &self.left_out,
        };
        folder.write(Path::new(SPLIT_FILE), &json_document(&document)?)
    }
}

/// The result of a first look at a carrier.
enum Look {
    Candidate(Box<SplitCandidate>),
    LeftOut(String),
}

impl Look {
    fn at(args: &PointceptArgs, shape: &ShapeInput, carrier: &Carrier) -> Result<Self> {
        let number_of_face = args.common.label.of_faces(carrier)?;
        let n_parts = Labels::compacted(&number_of_face).n_labels() as usize;
        if n_parts < args.min_parts {
            let reason = format!("fewer than {} parts", args.min_parts);
            return Ok(Self::LeftOut(reason));
        }
        if let Some(most) = args.max_parts.filter(|&most| most < n_parts) {
            return Ok(Self::LeftOut(format!("more than {most} parts")));
        }
        Ok(Self::Candidate(Box::new(SplitCandidate {
            id: shape.id.clone(),
            collection: shape.source.clone(),
            n_parts,
            signature: signature_of_carrier(carrier),
            descriptor: Descriptor::of(carrier.mesh()),
        })))
    }
}

/// The arrays of a shape, in the folder of its side.
fn shape_files(
    args: &PointceptArgs,
    side: &str,
    shape: &ShapeInput,
    carrier: &Carrier,
) -> Result<Files> {
    let config = SampleConfig {
        n_points: args.points as usize,
        normals: args.normals,
        seed: args.seed,
    };
    let sample = points_of(&shape.id, carrier, &config)?;
    let number_of_face = args.common.label.of_faces(carrier)?;
    let class_of_face = classes_of_faces(carrier, &number_of_face);
    let of_points = |of_face: &[i32]| -> Vec<i32> {
        sample
            .triangles
            .iter()
            .map(|&triangle| of_face[carrier.mesh().tri_face[triangle as usize] as usize])
            .collect()
    };
    // Parts without a point do not leave gaps in the numbers.
    let instance = Labels::compacted(&of_points(&number_of_face));
    let folder = Path::new(side).join(&shape.id);
    let files = pointcept_files(&sample, &of_points(&class_of_face), instance.of_triangle());
    Ok(files
        .into_iter()
        .map(|(name, bytes)| (folder.join(name), bytes))
        .collect())
}

/// The class of each face: the primitive type with the largest area among the faces of its label. In a tie, it is the lower one.
fn classes_of_faces(carrier: &Carrier, number_of_face: &[i32]) -> Vec<i32> {
    let faces = &carrier.graph().faces;
    let mut area_of: BTreeMap<(i32, i32), f64> = BTreeMap::new();
    for (face, &number) in faces.iter().zip(number_of_face) {
        *area_of
            .entry((number, i32::from(face.face_type.code())))
            .or_default() += face.area;
    }
    let mut class_of: BTreeMap<i32, (i32, f64)> = BTreeMap::new();
    for ((number, class), area) in area_of {
        let best = class_of.entry(number).or_insert((class, area));
        if area > best.1 {
            *best = (class, area);
        }
    }
    number_of_face
        .iter()
        .map(|number| if *number < 0 { -1 } else { class_of[number].0 })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_three_numbers() {
        let shares: Shares = "0.8/0.1/0.1".parse().unwrap();
        assert_eq!(
            shares.0,
            SplitFractions {
                train: 0.8,
                valid: 0.1,
                test: 0.1
            }
        );
        for bad in ["0.8/0.2", "a/b/c", "", "0/0/0", "1/-1/0", "nan/1/1"] {
            assert!(bad.parse::<Shares>().is_err(), "{bad}");
        }
    }
}
