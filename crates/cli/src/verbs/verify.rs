//! Runs `partprobe verify`: it compares partprobe's kernel with itself, and with the results of a reference program for the same
//! files.
//!
//! A folder of STEP files goes in, optionally with a file of reference lines and one of volumes. A table by group, or one JSON
//! document, comes out, with each face and solid that contradicts itself, and on request every other disagreement with its `#`
//! numbers. `partprobe_verify` compares. This module reads files in parallel and prints results in order.

use crate::config;
use crate::counted::counted;
use crate::interrupt;
use crate::label::step_text;
use crate::progress::Progress;
use crate::stderr;
use crate::stdout::print_line;
use crate::usage::{UsageError, as_usage_error};
use anyhow::{Context, Result, ensure};
use partprobe_dataset::json_document;
use partprobe_formats::{ZstdReader, step_stem};
use partprobe_verify::{
    Counts, FileComparison, FindingRow, GroupCounts, MeasureSettings, MeasuredFile, ReferenceFile,
    ReferenceSolid, TextRow, VerificationReport, VolumesLine, own_table, table,
};
use rayon::prelude::*;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The size of the stack. It is larger than the default, so that deeply nested files do not end the program.
const STACK_BYTES: usize = 64 << 20;

/// Compare the kernel with itself, and with a reference reading of the same files.
///
/// Each face's area is computed twice, by a quadrature of its surface and from its triangles, and so is the volume of each
/// closed solid. If the two values differ by more than the chords explain, a line gives the file, the `#` number and both values.
/// Without a reference, nothing else is compared.
///
/// A reference is a file with one JSON object per line (`.zst` is unpacked): `file` (a path below DIR, its first
/// component is the group), `status`, `faces` as `[step id, occurrence, type, part, shell, area, mesh area]` and `edges`
/// as `[face index, face index, φ, length]`. Volumes are in a separate file: `file`, and `solids` as `[step id,
/// whether closed, volume, whether valid]`; `tools/occt/volumes.py` makes it.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe verify corpus/
  partprobe verify corpus/ --json
  partprobe verify --reference corpus.jsonl.zst corpus/
  partprobe verify --reference corpus.jsonl.zst corpus/ --only fusion/ --list
  partprobe verify --reference corpus.jsonl.zst --volumes volumes.jsonl corpus/

Areas count as equal within 1 % of the reference's analytic or mesh area, if one of them is above zero. Files in which two faces
of one type meet within 0.001° of θ are left out of the partition column. Volumes are compared on every solid that the reference
calls closed.")]
pub(crate) struct VerifyArgs {
    /// The reference lines.
    #[arg(long, value_name = "REF.jsonl[.zst]")]
    reference: Option<PathBuf>,
    /// The reference's exact volume of each solid.
    #[arg(long, value_name = "VOLUMES.jsonl[.zst]", requires = "reference")]
    volumes: Option<PathBuf>,
    /// The folder of STEP files. The paths in the reference are relative to it.
    dir: PathBuf,
    /// Print each disagreement with its `#` numbers.
    #[arg(long)]
    list: bool,
    /// Print one JSON document instead of the table: counts, rates and every finding.
    #[arg(long)]
    json: bool,
    /// Compare only files whose path contains this text.
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Change one setting, for example label.angle_rad=0.1.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The number of threads; one per core if not given. The result does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

/// The result of partprobe's kernel for one file.
enum Outcome {
    Absent,
    Failed(String),
    Read(Box<FileComparison>),
}

/// The solids of each file, by `#` number.
type ReferenceVolumes = BTreeMap<String, BTreeMap<u64, ReferenceSolid>>;

/// Compares, and prints the table.
///
/// # Errors
/// If the reference cannot be read, or the folder has none of its files (without a reference: no STEP file).
pub(crate) fn verify(args: &VerifyArgs) -> Result<()> {
    ensure!(
        args.dir.is_dir(),
        UsageError(format!("{} is not a folder", args.dir.display()))
    );
    interrupt::end_at_once()?;
    let only = args.only.as_deref().unwrap_or_default();
    let mut files = match &args.reference {
        Some(reference) => read_lines(reference).map_err(as_usage_error)?,
        None => step_files(&args.dir)?,
    };
    let volumes = args
        .volumes
        .as_deref()
        .map(read_volumes)
        .transpose()
        .map_err(as_usage_error)?
        .unwrap_or_default();
    files.retain(|file| file.status == "ok" && file.file.contains(only));
    let settings = config::load("base", &args.set)?
        .config
        .label
        .measure_settings();
    let progress = Progress::on_terminal().bar("compare", files.len());
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(args.jobs.map_or(0, usize::from))
        .stack_size(STACK_BYTES)
        .build()?;
    let compare_one = |file: &ReferenceFile| {
        let outcome = outcome_of(file, &volumes, &args.dir, &settings);
        progress.inc(1);
        outcome
    };
    let outcomes: Vec<Outcome> = pool.install(|| files.par_iter().map(compare_one).collect());
    progress.finish_and_clear();
    if args.json {
        return report_json(&files, &outcomes, args);
    }
    for (file, outcome) in files.iter().zip(&outcomes) {
        list_findings(file, outcome)?;
        if args.list {
            list(file, outcome)?;
        }
    }
    let make_table = if args.reference.is_some() {
        table
    } else {
        own_table
    };
    report(&files, &outcomes, &args.dir, make_table)
}

/// Reads the volumes of each file's solids.
fn read_volumes(path: &Path) -> Result<ReferenceVolumes> {
    let lines: Vec<VolumesLine> = read_lines(path)?;
    Ok(lines
        .into_iter()
        .map(|line| (line.file.clone(), line.by_number()))
        .collect())
}

/// Reads a file of one JSON object per line, compressed with zstd if the name ends in `.zst`.
fn read_lines<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>> {
    let file = File::open(path).with_context(|| format!("reading {}", path.display()))?;
    let is_compressed = path.extension().is_some_and(|extension| extension == "zst");
    let reader: Box<dyn Read> = if is_compressed {
        Box::new(ZstdReader::new(file))
    } else {
        Box::new(file)
    };
    let lines = BufReader::new(reader).lines().enumerate();
    let parsed = lines.map(|(index, line)| {
        let position = || format!("{}, line {}", path.display(), index + 1);
        serde_json::from_str(&line.with_context(position)?).with_context(position)
    });
    parsed.collect()
}

/// Every STEP file below a folder as an empty reference, in the order of their paths.
fn step_files(dir: &Path) -> Result<Vec<ReferenceFile>> {
    let mut open = vec![dir.to_path_buf()];
    let mut files = Vec::new();
    while let Some(folder) = open.pop() {
        for entry in
            fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))?
        {
            let path = entry?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if path.is_dir() && !path.is_symlink() {
                open.push(path);
            } else if step_stem(&name).is_some() {
                let below = path.strip_prefix(dir).unwrap_or(&path);
                files.push(below.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    files.sort_unstable();
    Ok(files.into_iter().map(ReferenceFile::unseen).collect())
}

fn outcome_of(
    file: &ReferenceFile,
    volumes: &ReferenceVolumes,
    dir: &Path,
    settings: &MeasureSettings,
) -> Outcome {
    let path = dir.join(&file.file);
    if !path.is_file() {
        return Outcome::Absent;
    }
    let measured = step_text(&path, settings.budget.max_bytes)
        .and_then(|text| Ok(MeasuredFile::from_step(&text, settings)?));
    match measured {
        Ok(measured) => Outcome::Read(Box::new(FileComparison::of(
            &measured,
            file,
            volumes.get(&file.file),
            settings,
        ))),
        Err(error) => Outcome::Failed(format!("{error:#}")),
    }
}

/// Prints the faces and solids of a file that contradict themselves. This is done in every run.
fn list_findings(file: &ReferenceFile, outcome: &Outcome) -> Result<()> {
    let Outcome::Read(comparison) = outcome else {
        return Ok(());
    };
    comparison
        .findings
        .iter()
        .try_for_each(|text| print_line(format_args!("{}: finding: {text}", file.file)))
}

fn list(file: &ReferenceFile, outcome: &Outcome) -> Result<()> {
    match outcome {
        Outcome::Absent => print_line(format_args!("{}: not in the folder", file.file)),
        Outcome::Failed(reason) => print_line(format_args!("{}: failed: {reason}", file.file)),
        Outcome::Read(comparison) => {
            let mut disagreements = comparison.agreement.disagreements.iter();
            disagreements.try_for_each(|text| print_line(format_args!("{}: {text}", file.file)))
        }
    }
}

/// The counts of each group, and the files of the reference that are not in the folder.
fn grouped<'a>(
    files: &'a [ReferenceFile],
    outcomes: &[Outcome],
    dir: &Path,
) -> Result<(BTreeMap<String, GroupCounts>, Vec<&'a str>)> {
    let mut groups: BTreeMap<String, GroupCounts> = BTreeMap::new();
    let mut absent = Vec::new();
    for (file, outcome) in files.iter().zip(outcomes) {
        match outcome {
            Outcome::Absent => absent.push(file.file.as_str()),
            Outcome::Failed(_) => groups
                .entry(file.group().to_owned())
                .or_default()
                .add_failure(),
            Outcome::Read(comparison) => {
                comparison.add_to(groups.entry(file.group().to_owned()).or_default());
            }
        }
    }
    ensure!(
        !groups.is_empty(),
        "{} holds no STEP file, or none that the reference could read",
        dir.display()
    );
    Ok((groups, absent))
}

/// Prints everything as one JSON document.
fn report_json(files: &[ReferenceFile], outcomes: &[Outcome], args: &VerifyArgs) -> Result<()> {
    let has_reference = args.reference.is_some();
    let (groups, absent) = grouped(files, outcomes, &args.dir)?;
    let mut all = GroupCounts::default();
    groups.values().for_each(|counts| all.merge(counts));

    let (mut findings, mut failed, mut disagreements) = (Vec::new(), Vec::new(), Vec::new());
    for (file, outcome) in files.iter().zip(outcomes) {
        let row = |reason: &String| TextRow {
            path: file.file.clone(),
            reason: reason.clone(),
        };
        match outcome {
            Outcome::Absent => {}
            Outcome::Failed(reason) => failed.push(row(reason)),
            Outcome::Read(comparison) => {
                findings.extend(
                    comparison
                        .findings
                        .iter()
                        .map(|finding| FindingRow::new(&file.file, finding)),
                );
                disagreements.extend(comparison.agreement.disagreements.iter().map(row));
            }
        }
    }
    let report = VerificationReport {
        groups: groups
            .iter()
            .map(|(name, counts)| (name.clone(), Counts::new(counts, has_reference)))
            .collect(),
        all: Counts::new(&all, has_reference),
        findings,
        failed,
        absent: absent.into_iter().map(str::to_owned).collect(),
        disagreements: has_reference.then_some(disagreements),
    };
    print_line(String::from_utf8_lossy(&json_document(&report)?).trim_end())
}

fn report(
    files: &[ReferenceFile],
    outcomes: &[Outcome],
    dir: &Path,
    table: fn(&BTreeMap<String, GroupCounts>) -> String,
) -> Result<()> {
    let (groups, absent) = grouped(files, outcomes, dir)?;
    print_line(table(&groups).trim_end())?;
    if !absent.is_empty() {
        let absent = counted(
            absent.len(),
            "file of the reference is",
            "files of the reference are",
        );
        stderr::print_line(format_args!("{absent} not in {}", dir.display()));
    }
    Ok(())
}
