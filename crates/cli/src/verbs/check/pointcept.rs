//! Runs `partprobe check pointcept`: checks every array of every shape, and that no shape is on two sides of the split.

use crate::counted::counted;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::shape_input::SHAPES_FILE;
use crate::stdout::print_line;
use crate::usage::UsageError;
use crate::verbs::export::{SIDES, ShapeLine};
use anyhow::{Context, Result, bail, ensure};
use partprobe_formats::{POINTCEPT_FILES, check_pointcept_shape};
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// What `check pointcept` takes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct PointceptArgs {
    /// The folder with train, val and test.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// The number of classes that `segment` may have. `export pointcept` writes the 11 primitive types.
    #[arg(long, default_value_t = 11, value_parser = clap::value_parser!(u16).range(1..))]
    classes: u16,
    /// The number of threads; one per core if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

/// The folder of one shape.
struct Shape {
    side: &'static str,
    name: String,
    path: PathBuf,
}

impl Shape {
    fn place(&self) -> String {
        format!("{}/{}", self.side, self.name)
    }
}

/// The result of checking one shape.
struct ShapeCheck {
    problems: Vec<String>,
    /// The hash of the positions, if they could be read.
    hash: Option<[u8; 32]>,
}

/// Checks the folder and prints one line per problem.
pub(super) fn check_pointcept(args: &PointceptArgs) -> Result<()> {
    let mut problems = Vec::new();
    let shapes = shapes_in(&args.folder, &mut problems)?;
    let checked = check_shapes(args, &shapes)?;
    for (shape, checked) in shapes.iter().zip(&checked) {
        problems.extend(
            checked
                .problems
                .iter()
                .map(|problem| format!("{}: {problem}", shape.place())),
        );
    }
    problems.extend(shapes_on_two_sides(&shapes, &checked));
    problems.extend(against_list(&args.folder, &shapes)?);
    problems.iter().try_for_each(print_line)?;
    let count = |side: &str| shapes.iter().filter(|shape| shape.side == side).count();
    print_line(format_args!(
        "{}: {} train, {} val, {} test, {} problems",
        args.folder.display(),
        count(SIDES[0]),
        count(SIDES[1]),
        count(SIDES[2]),
        problems.len()
    ))?;
    ensure!(
        problems.is_empty(),
        "{} is not ready for Pointcept",
        args.folder.display()
    );
    Ok(())
}

/// The shapes of all sides, sorted. Everything else in the folder of a side is a problem, because Pointcept opens it.
fn shapes_in(folder: &Path, problems: &mut Vec<String>) -> Result<Vec<Shape>> {
    let mut shapes = Vec::new();
    for side in SIDES {
        let path = folder.join(side);
        if !path.is_dir() {
            continue;
        }
        let mut entries = fs::read_dir(&path)
            .and_then(|entries| entries.collect::<Result<Vec<_>, _>>())
            .with_context(|| format!("reading {}", path.display()))?;
        entries.sort_by_key(fs::DirEntry::file_name);
        for entry in entries {
            let name = entry.file_name().to_string_lossy().into_owned();
            if entry.path().is_dir() {
                shapes.push(Shape {
                    side,
                    name,
                    path: entry.path(),
                });
            } else if !name.starts_with('.') {
                problems.push(format!(
                    "{side}/{name}: not a folder, but DefaultDataset opens it as a shape"
                ));
            }
        }
    }
    ensure!(
        !shapes.is_empty(),
        UsageError(format!(
            "{} has no shape in train, val or test",
            folder.display()
        ))
    );
    Ok(shapes)
}

fn check_shapes(args: &PointceptArgs, shapes: &[Shape]) -> Result<Vec<ShapeCheck>> {
    let interrupt = Interrupt::listen()?;
    let n_threads = args.jobs.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .context("starting threads")?;
    let bar = Progress::on_terminal().bar("check", shapes.len());
    let one = |shape: &Shape| {
        bar.inc(1);
        (!interrupt.is_set()).then(|| check_shape(shape, args.classes))
    };
    let checked: Vec<Option<ShapeCheck>> = pool.install(|| shapes.par_iter().map(one).collect());
    bar.finish_and_clear();
    let checked: Vec<ShapeCheck> = checked.into_iter().flatten().collect();
    if checked.len() < shapes.len() {
        bail!(
            "stopped after {} of {}",
            checked.len(),
            counted(shapes.len(), "shape", "shapes")
        );
    }
    Ok(checked)
}

fn check_shape(shape: &Shape, n_classes: u16) -> ShapeCheck {
    let mut files = BTreeMap::new();
    let mut problems = Vec::new();
    for name in POINTCEPT_FILES {
        match fs::read(shape.path.join(name)) {
            Ok(bytes) => drop(files.insert(name.to_owned(), bytes)),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
            Err(error) => problems.push(format!("{name}: {error}")),
        }
    }
    problems.extend(
        check_pointcept_shape(&files, n_classes)
            .iter()
            .map(ToString::to_string),
    );
    ShapeCheck {
        problems,
        hash: files
            .get(POINTCEPT_FILES[0])
            .map(|bytes| Sha256::digest(bytes).into()),
    }
}

/// Shapes on two sides with the same name or the same points.
fn shapes_on_two_sides(shapes: &[Shape], checked: &[ShapeCheck]) -> Vec<String> {
    let mut problems = Vec::new();
    let mut first_of_name: BTreeMap<&str, &Shape> = BTreeMap::new();
    let mut first_of_hash: BTreeMap<[u8; 32], &Shape> = BTreeMap::new();
    for (shape, checked) in shapes.iter().zip(checked) {
        let first = *first_of_name.entry(&shape.name).or_insert(shape);
        if first.side != shape.side {
            problems.push(format!("{}: also in {}", shape.place(), first.side));
            continue;
        }
        let Some(hash) = checked.hash else { continue };
        let first = *first_of_hash.entry(hash).or_insert(shape);
        if first.side != shape.side {
            problems.push(format!(
                "{}: the same points as {}",
                shape.place(),
                first.place()
            ));
        }
    }
    problems
}

/// The contradictions to `shapes.jsonl`, if it exists: related shapes on two sides, and missing shapes.
fn against_list(folder: &Path, shapes: &[Shape]) -> Result<Vec<String>> {
    let path = folder.join(SHAPES_FILE);
    let Ok(text) = fs::read_to_string(&path) else {
        return Ok(Vec::new());
    };
    let lines = text
        .lines()
        .enumerate()
        .map(|(idx, line)| {
            serde_json::from_str(line)
                .with_context(|| format!("{}, line {}", path.display(), idx + 1))
        })
        .collect::<Result<Vec<ShapeLine>>>()?;
    let mut problems = Vec::new();
    let found: BTreeMap<&str, &Shape> = shapes
        .iter()
        .map(|shape| (shape.name.as_str(), shape))
        .collect();
    let mut side_of_group: BTreeMap<&str, &Shape> = BTreeMap::new();
    for line in lines.iter().filter(|line| line.reason.is_none()) {
        let Some(shape) = found.get(line.id.as_str()) else {
            let side = line.split.as_deref().unwrap_or("?");
            problems.push(format!(
                "{side}/{}: listed in {SHAPES_FILE}, but not there",
                line.id
            ));
            continue;
        };
        if let Some(group) = &line.group {
            let first = *side_of_group.entry(group).or_insert(shape);
            if first.side != shape.side {
                problems.push(format!(
                    "{}: related to {}, which is on another side",
                    shape.place(),
                    first.place()
                ));
            }
        }
    }
    Ok(problems)
}
