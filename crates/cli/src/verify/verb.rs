//! The verb itself: files in parallel, the table in order.

use super::{GroupCounts, Observed, ReferenceFile, Verdict, compare, read_reference, table};
use crate::config;
use crate::measured::{MeasureSettings, Measured, MeasuredSolid};
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, ensure};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The partition column leaves files out in which two faces of one type meet this close to θ, in degrees.
const ANGLE_SLACK_DEG: f64 = 1e-3;
/// Volumes agree within this fraction.
const VOLUME_TOLERANCE: f64 = 0.01;
/// Deep files must not end the program: threads get more stack than by default.
const STACK_BYTES: usize = 64 << 20;

/// Compare the kernel with a reference reading of the same files.
///
/// A reference is a file with one JSON object a line (`.zst` is unpacked): `file` (a path below DIR, its first
/// component is the group), `status`, `volume`, `faces` as `[step id, occurrence, type, part, shell, area, mesh area]`
/// and `edges` as `[face index, face index, φ, length]`.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe verify --reference corpus.jsonl.zst corpus/
  partprobe verify --reference corpus.jsonl.zst corpus/ --only fusion/ --list

Areas count as equal within 1 % of the reference's analytic or mesh area. Files in which two faces of one type
meet within 0.001° of θ are left out of the partition column. Volumes are compared where every solid closes
and no product occurs twice.")]
pub struct VerifyArgs {
    /// The reference lines.
    #[arg(long, value_name = "REF.jsonl[.zst]")]
    reference: PathBuf,
    /// The folder that the reference's paths start from.
    dir: PathBuf,
    /// Name each disagreement with its `#` numbers.
    #[arg(long)]
    list: bool,
    /// Compare only files whose path contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Change one setting, for example label.angle_rad=0.1.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Threads; all cores by default.
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    jobs: usize,
}

/// Our side of one file.
enum Outcome {
    Absent,
    Failed(String),
    Read(Box<Comparison>),
}

struct Comparison {
    verdict: Verdict,
    partition_counts: bool,
    /// Whether the volume of the true surfaces agrees, and that of the mesh; none where they cannot be compared.
    volumes_agree: Option<[bool; 2]>,
    watertight: (usize, usize),
}

/// Compares, and prints the table.
///
/// # Errors
/// If the reference cannot be read, or the folder holds none of its files.
pub fn verify(args: &VerifyArgs) -> Result<()> {
    ensure!(args.dir.is_dir(), UsageError(format!("{} is no folder", args.dir.display())));
    let only = args.only.as_deref().unwrap_or_default();
    let mut files = read_reference(&args.reference).map_err(as_usage_error)?;
    files.retain(|file| file.status == "ok" && file.file.contains(only));
    let settings = MeasureSettings::from_config(&config::load("base", &args.set)?.config.label);
    let progress = Progress::on_terminal().bar("compare", files.len());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(args.jobs).stack_size(STACK_BYTES).build()?;
    let compare_one = |file: &ReferenceFile| {
        let outcome = outcome_of(file, &args.dir, &settings);
        progress.inc(1);
        outcome
    };
    let outcomes: Vec<Outcome> = pool.install(|| files.par_iter().map(compare_one).collect());
    progress.finish_and_clear();
    if args.list {
        files.iter().zip(&outcomes).try_for_each(|(file, outcome)| list(file, outcome))?;
    }
    report(&files, &outcomes, &args.dir)
}

fn outcome_of(file: &ReferenceFile, dir: &Path, settings: &MeasureSettings) -> Outcome {
    let path = dir.join(&file.file);
    if !path.is_file() {
        return Outcome::Absent;
    }
    let measured = fs::read(&path).context("reading").and_then(|text| Measured::from_step(&text, settings));
    match measured {
        Ok(measured) => Outcome::Read(Box::new(comparison(file, &measured, settings.theta_deg))),
        Err(error) => Outcome::Failed(format!("{error:#}")),
    }
}

fn comparison(file: &ReferenceFile, measured: &Measured, theta_deg: f64) -> Comparison {
    let mut verdict = compare(&Observed::from(measured), &file.observed());
    let closed = || measured.solids.iter().filter(|solid| solid.closed);
    let watertight = (closed().filter(|solid| solid.mesh.watertight).count(), closed().count());
    let is_comparable = watertight.1 > 0 && watertight.0 == measured.solids.len() && !file.repeats();
    let total = |volume: fn(&MeasuredSolid) -> f64| measured.solids.iter().map(volume).sum::<f64>();
    let ours = [total(|solid| solid.volume), total(|solid| solid.mesh.volume)];
    let agrees = |ours: f64, theirs: f64| (ours - theirs).abs() <= VOLUME_TOLERANCE * theirs.abs();
    let volumes_agree = file.volume.filter(|_| is_comparable).map(|theirs| ours.map(|ours| agrees(ours, theirs)));
    if volumes_agree.is_some_and(|agree| !agree[0]) {
        let theirs = file.volume.unwrap_or(f64::NAN);
        verdict.disagreements.push(format!("volume: {:.6} mm³, reference {theirs:.6}", ours[0]));
    }
    for (solid, measured) in measured.brep.solids.iter().zip(&measured.solids) {
        if measured.closed && !measured.mesh.watertight {
            verdict.disagreements.push(format!("watertight: solid #{} does not close", solid.step_id));
        }
    }
    Comparison {
        verdict,
        partition_counts: !file.has_angle_near(theta_deg, ANGLE_SLACK_DEG),
        volumes_agree,
        watertight,
    }
}

fn list(file: &ReferenceFile, outcome: &Outcome) -> Result<()> {
    match outcome {
        Outcome::Absent => print_line(format_args!("{}: not in the folder", file.file)),
        Outcome::Failed(reason) => print_line(format_args!("{}: failed: {reason}", file.file)),
        Outcome::Read(comparison) => {
            let mut disagreements = comparison.verdict.disagreements.iter();
            disagreements.try_for_each(|text| print_line(format_args!("{}: {text}", file.file)))
        }
    }
}

fn report(files: &[ReferenceFile], outcomes: &[Outcome], dir: &Path) -> Result<()> {
    let mut groups: BTreeMap<String, GroupCounts> = BTreeMap::new();
    let mut n_absent = 0;
    for (file, outcome) in files.iter().zip(outcomes) {
        match outcome {
            Outcome::Absent => n_absent += 1,
            Outcome::Failed(_) => groups.entry(file.group().to_owned()).or_default().add_failure(),
            Outcome::Read(comparison) => add(groups.entry(file.group().to_owned()).or_default(), comparison),
        }
    }
    ensure!(!groups.is_empty(), "{} holds no file that the reference could read", dir.display());
    print_line(table(&groups).trim_end())?;
    if n_absent > 0 {
        eprintln!("{n_absent} files of the reference are not in {}", dir.display());
    }
    Ok(())
}

fn add(counts: &mut GroupCounts, comparison: &Comparison) {
    counts.add(&comparison.verdict, comparison.partition_counts);
    if let Some([agrees, mesh_agrees]) = comparison.volumes_agree {
        counts.volumes.0 += usize::from(agrees);
        counts.volumes.1 += 1;
        counts.mesh_volumes.0 += usize::from(mesh_agrees);
        counts.mesh_volumes.1 += 1;
    }
    counts.watertight.0 += comparison.watertight.0;
    counts.watertight.1 += comparison.watertight.1;
}
