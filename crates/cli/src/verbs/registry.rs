//! Runs `partprobe registry`: packages are joined by the hash of the STEP text.

use crate::counted::counted;
use crate::label_package::LabelPackage;
use crate::markdown_table::{Alignment, markdown_table};
use crate::stdout::{print_line, print_tables};
use crate::usage::UsageError;
use anyhow::{Result, ensure};
use partprobe_dataset::write_atomically;
use partprobe_release::{Disagreement, PackagePair, PackageShapes, Registry, joined_table};
use partprobe_tables::{schema_metadata, table_to_parquet};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The version of the table that `--out` writes.
const REGISTRY_VERSION: u32 = 1;
/// The number of disagreements of two packages that are named. `--json` names all of them.
const MAX_DISAGREEMENTS: usize = 10;
/// The number of shown digits of a hash.
const SHOWN_DIGITS: usize = 12;

/// Join packages of released labels by the hash of the STEP text, and show which files have which labels and where labels
/// disagree.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Examples:
  partprobe registry ours/ theirs/
  partprobe registry ours/ theirs/ --out labels.parquet     a row per shape, with lists that have an element per package
  partprobe registry ours/ theirs/ --json

Labels disagree if the settings of two packages are the same and the labels of a shape are not. Labels that were made with
different settings may differ; the shapes with equal parts are counted.")]
pub(crate) struct RegistryArgs {
    /// The packages.
    #[arg(required = true, value_name = "PACKAGE")]
    packages: Vec<PathBuf>,
    /// Write the joined shapes as Parquet.
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
}

/// Joins the packages, and prints their common shapes.
///
/// # Errors
/// If a package is damaged or given twice, or the file cannot be written.
pub(crate) fn registry(args: &RegistryArgs) -> Result<()> {
    let mut names = BTreeSet::new();
    let mut packages = Vec::new();
    for path in &args.packages {
        let package = package(path)?;
        ensure!(
            names.insert(package.name.clone()),
            UsageError(format!("{} is given twice", path.display()))
        );
        packages.push(package);
    }
    let registry = Registry::of(&packages);
    if let Some(out) = &args.out {
        let table = joined_table(&registry.shapes)?;
        let metadata = schema_metadata("registry", REGISTRY_VERSION);
        write_atomically(out, &table_to_parquet(&table, &metadata)?)?;
    }
    if args.json {
        return print_line(serde_json::to_string_pretty(&registry)?);
    }
    print_tables(text_of(&registry))
}

fn package(path: &Path) -> Result<PackageShapes> {
    let package = LabelPackage::open(path)?;
    let shapes = package.shapes()?;
    Ok(PackageShapes {
        name: path.display().to_string(),
        settings_sha256: package.manifest.settings_sha256,
        program_version: package.manifest.program_version,
        shapes: shapes.into_iter().map(|shape| shape.shape).collect(),
    })
}

fn text_of(registry: &Registry) -> String {
    use Alignment::{Left, Right};
    let rows = registry.packages.iter().map(|package| {
        [
            package.name.clone(),
            shown(&package.settings_sha256),
            package.program_version.clone(),
            package.n_files.to_string(),
            package.n_shapes.to_string(),
        ]
    });
    let packages = markdown_table(
        ["package", "settings", "program", "files", "shapes"],
        [Left, Left, Left, Right, Right],
        rows,
    );
    let by_number = registry.files_by_n_packages.iter().map(|(n, files)| {
        let files = counted(*files, "file has", "files have");
        let packages = counted(*n, "package", "packages");
        format!("{files} labels in {packages}")
    });
    let mut sections = vec![packages, by_number.collect::<Vec<_>>().join("\n")];
    sections.extend(registry.pairs.iter().map(text_of_pair));
    sections.join("\n\n")
}

fn text_of_pair(pair: &PackagePair) -> String {
    let [first, second] = &pair.packages;
    let settings = if pair.has_same_settings {
        "the same settings"
    } else {
        "other settings"
    };
    let mut lines = vec![
        format!("{first} and {second}: {settings}"),
        format!(
            "  in both: {}, and {} of one unit",
            counted(pair.n_files, "file", "files"),
            counted(pair.n_shapes, "shape", "shapes")
        ),
        format!("  equal parts: {}", pair.n_same_parts),
        format!("  equal labels: {}", pair.n_same_labels),
    ];
    if pair.has_same_settings {
        lines.push(format!("  disagreements: {}", pair.disagreements.len()));
    }
    let named = pair.disagreements.iter().take(MAX_DISAGREEMENTS);
    lines.extend(named.map(|disagreement| format!("    {}", name_of(disagreement))));
    if pair.disagreements.len() > MAX_DISAGREEMENTS {
        let more = pair.disagreements.len() - MAX_DISAGREEMENTS;
        lines.push(format!("    and {more} more, see --json"));
    }
    lines.join("\n")
}

fn name_of(disagreement: &Disagreement) -> String {
    let hash = shown(&disagreement.source_sha256);
    let file = match &disagreement.source {
        Some(source) => format!("{source} ({hash})"),
        None => hash,
    };
    match disagreement.solid_step_id {
        Some(solid) => format!("{file}, solid #{solid}"),
        None => file,
    }
}

/// The first digits of a hash.
fn shown(hash: &str) -> String {
    hash.chars().take(SHOWN_DIGITS).collect()
}
