//! Runs `partprobe release`: the labels of a data set become a package without geometry.

use crate::counted::{counted, file_size};
use crate::damaged_carriers::refuse_damaged_carriers;
use crate::dataset_settings::{DatasetSettings, settings_sha256};
use crate::interrupt;
use crate::label::ReasonCounts;
use crate::own_output::OwnOutput;
use crate::program_version::COMMIT;
use crate::progress::Progress;
use crate::stderr;
use crate::stdout::print_line;
use anyhow::{Context, Result, ensure};
use indicatif::ProgressBar;
use partprobe_carrier::{STEP_PARTS, STEP_PARTS_RAW, ShapeKind};
use partprobe_dataset::{Dataset, IndexEntry, Status, json_document, write_atomically};
use partprobe_formats::step_stem;
use partprobe_release::{
    Counts, DATASHEET_FILE, DatasheetFacts, FileFacts, LICENSE_NOTE_FILE, MANIFEST_FILE, Manifest,
    PACKAGE_VERSION, ReleasedRow, Unlabeled, datasheet, labels_file, license_note, rows_to_parquet,
};
use partprobe_tables::ShapeLabels;
use rayon::prelude::*;
use serde_json::json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The number of hexadecimal digits of the hash that form the id of a file in an anonymous package.
const ID_DIGITS: usize = 16;
/// The text of the datasheet about files that are not in the package.
const NO_HASH: &str = "files that could not be read, or are not STEP files";
const NO_BREP: &str = "meshes and clouds, which have no STEP faces";
const DAMAGED: &str = "shapes whose carrier is damaged";

/// Write the labels of a data set as a package without geometry, which others join with their copies of the STEP files.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:
  partprobe label parts/ --out dataset/
  partprobe release dataset/ --out package/ --license CC-BY-4.0
  partprobe attach package/ parts/ --out again/             on another machine, with the same files

PACKAGE contains labels-00000.parquet and so on (per shape the SHA-256 of its STEP text, and per face its # number, type and part;
per shared edge its faces and its dihedral angle), DATASHEET.md, LICENSE-NOTE.md, and release.json with the settings and the hash
of each file, written last. It contains no coordinates, areas or product names.
Exit codes: 0 done, 1 a carrier is damaged (the rest is written), 2 wrong usage.")]
pub(crate) struct ReleaseArgs {
    /// The data set, with carriers.
    #[arg(value_name = "DATASET")]
    dataset: PathBuf,
    /// The folder to write.
    #[arg(long, short, value_name = "PACKAGE")]
    out: PathBuf,
    /// Replace the output of an earlier call.
    #[arg(long)]
    force: bool,
    /// Leave out the names of files; ids are made from the hash of the STEP text.
    #[arg(long)]
    anonymous: bool,
    /// The license of the labels, which LICENSE-NOTE.md names, for example CC-BY-4.0.
    #[arg(long, value_name = "TEXT")]
    license: Option<String>,
    /// The most shapes in one file.
    #[arg(long, default_value_t = 10_000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    shard_size: u32,
    /// The number of threads; one per core if not given. The package does not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
}

/// The files of a package.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "release",
    marker: None,
    is_own: |name| {
        [MANIFEST_FILE, DATASHEET_FILE, LICENSE_NOTE_FILE].contains(&name)
            || (name.starts_with("labels-") && name.ends_with(".parquet"))
    },
};

/// Writes the package, and prints a summary of its content.
///
/// # Errors
/// If the data set has no carriers or no settings, the folder is not empty or cannot be written, or a carrier is damaged.
pub(crate) fn release(args: &ReleaseArgs) -> Result<()> {
    let settings = DatasetSettings::read(&args.dataset)?;
    let dataset = Dataset::open(&args.dataset)?;
    interrupt::end_at_once()?;
    let inputs = [args.dataset.clone()];
    let _lock = OUTPUT.take(&args.out, "releasing into", args.force, &inputs)?;

    let label = serde_json::to_value(&settings.label)?;
    let is_further = |name: &&String| ![STEP_PARTS, STEP_PARTS_RAW].contains(&name.as_str());
    let layers: BTreeSet<String> = settings
        .label
        .layers
        .iter()
        .filter(is_further)
        .cloned()
        .collect();
    let mut package = Package {
        root: &args.out,
        layers,
        shard_size: args.shard_size as usize,
        rows: Vec::new(),
        files: BTreeMap::new(),
        counts: Counts::default(),
        labeled_files: BTreeSet::new(),
    };
    let facts = write_labels(args, &dataset, &mut package)?;
    let n_damaged = package.counts.left_out.get(DAMAGED).copied().unwrap_or(0);
    let manifest = Manifest {
        format_version: PACKAGE_VERSION,
        program_version: settings.program_version,
        commit: COMMIT.map(str::to_owned),
        is_anonymous: args.anonymous,
        license: args.license.clone(),
        settings_sha256: settings_sha256(&label).context("the settings are not a table")?,
        settings: json!({ "label": label }),
        layers: package.layers.iter().cloned().collect(),
        counts: std::mem::take(&mut package.counts),
        files: BTreeMap::new(),
    };
    let manifest = package.conclude(manifest, &facts)?;
    print_line(summary(&args.out, &manifest))?;
    refuse_damaged_carriers(usize::try_from(n_damaged)?)
}

/// A line of the index, with the id of its file.
struct Item<'a> {
    entry: &'a IndexEntry,
    file_id: String,
    /// The prefix of the ids of the file in the package.
    released_id: String,
}

/// The result of a line.
enum Released {
    Row(Box<ReleasedRow>),
    LeftOut(&'static str),
}

/// Writes the rows of all lines, in the order of the index.
fn write_labels(
    args: &ReleaseArgs,
    dataset: &Dataset,
    package: &mut Package<'_>,
) -> Result<DatasheetFacts> {
    let items = items(dataset, args.anonymous);
    let mut reasons = ReasonCounts::default();
    let mut n_lost = 0;
    for Item { entry, .. } in &items {
        n_lost += entry.lost.len() as u64;
        if let Some(reason) = &entry.reason
            && entry.status != Status::Skipped
        {
            reasons.add(entry.status, reason, 1, &entry.source);
        }
    }
    let bar = Progress::on_terminal().bar("release", items.len());
    let n_threads = args.jobs.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .context("starting threads")?;
    for chunk in items.chunks(package.shard_size.min(256)) {
        let one = |item: &Item<'_>| released(dataset, item, args.anonymous, &bar);
        let rows: Vec<Released> = pool.install(|| chunk.par_iter().map(one).collect());
        for (item, row) in chunk.iter().zip(rows) {
            match row {
                Released::Row(mut row) => {
                    if let Some(labels) = &mut row.labels {
                        labels
                            .layers
                            .retain(|name, _| package.layers.contains(name));
                    }
                    package.add(&item.file_id, *row)?;
                }
                Released::LeftOut(reason) => package.leave_out(reason, item.entry),
            }
        }
    }
    bar.finish_and_clear();
    let ranked = reasons.ranked();
    let unlabeled = ranked.iter().map(|row| Unlabeled {
        status: row.kind.name().to_owned(),
        reason: row.reason.to_owned(),
        n: row.n,
    });
    Ok(DatasheetFacts {
        unlabeled: unlabeled.collect(),
        n_lost,
    })
}

/// The lines of the index with the ids of their files.
fn items(dataset: &Dataset, is_anonymous: bool) -> Vec<Item<'_>> {
    let is_of_one_file =
        |a: &IndexEntry, b: &IndexEntry| a.source == b.source && b.member.is_none();
    let mut n_of_text: BTreeMap<&str, usize> = BTreeMap::new();
    let mut items = Vec::new();
    for entries in dataset.entries().chunk_by(is_of_one_file) {
        let file_id = file_id(entries);
        let sha256 = entries.iter().find_map(|entry| entry.sha256.as_deref());
        let released_id = match sha256 {
            Some(sha256) if is_anonymous => {
                let n = n_of_text.entry(sha256).or_default();
                *n += 1;
                let id = format!("file-{}", &sha256[..ID_DIGITS.min(sha256.len())]);
                if *n == 1 { id } else { format!("{id}-{n}") }
            }
            _ => file_id.clone(),
        };
        items.extend(entries.iter().map(|entry| Item {
            entry,
            file_id: file_id.clone(),
            released_id: released_id.clone(),
        }));
    }
    items
}

/// The id of a file: that of its shape, or that of its solids without `__s<k>`. The name of a file may look like the id of a
/// solid.
fn file_id(entries: &[IndexEntry]) -> String {
    let without_solid = |id: &str| {
        let (file, number) = id.rsplit_once("__s")?;
        let is_number = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
        is_number.then(|| file.to_owned())
    };
    let of_solid = |entry: &IndexEntry| {
        let is_solid = entry.solid_step_id.is_some();
        is_solid.then(|| without_solid(&entry.id)).flatten()
    };
    // The line of a solid without a carrier does not record that it is a solid. The id of a file ends like its name.
    let of_any = |entry: &IndexEntry| {
        let name = entry.source.rsplit('/').next().unwrap_or_default();
        let stem = step_stem(name).unwrap_or(name);
        let is_of_file = |id: &str| id.ends_with(stem) || id.ends_with(name);
        let of_file = without_solid(&entry.id).filter(|id| is_of_file(id));
        match of_file {
            Some(id) if !is_of_file(&entry.id) => id,
            _ => entry.id.clone(),
        }
    };
    entries
        .iter()
        .find_map(of_solid)
        .or_else(|| entries.first().map(of_any))
        .unwrap_or_default()
}

/// The row of a line.
fn released(dataset: &Dataset, item: &Item<'_>, is_anonymous: bool, bar: &ProgressBar) -> Released {
    let Item {
        entry,
        file_id,
        released_id,
    } = item;
    bar.inc(1);
    let Some(sha256) = &entry.sha256 else {
        return Released::LeftOut(NO_HASH);
    };
    let rest = entry.id.strip_prefix(file_id.as_str()).unwrap_or_default();
    let id = format!("{released_id}{rest}");
    let mut row = if entry.file.is_none() {
        ReleasedRow::without_labels(&id, released_id, sha256, entry.status.name())
    } else {
        let carrier = match dataset.carrier(entry) {
            Ok(carrier) => carrier,
            Err(error) => {
                bar.suspend(|| {
                    let error = anyhow::Error::from(error);
                    stderr::print_line(format_args!("warning: {}: {error:#}", entry.id));
                });
                return Released::LeftOut(DAMAGED);
            }
        };
        if carrier.kind() != ShapeKind::Brep {
            return Released::LeftOut(NO_BREP);
        }
        ReleasedRow::with_labels(&id, released_id, sha256, ShapeLabels::of(&carrier))
    };
    row.shape.solid_step_id = entry.solid_step_id;
    if !is_anonymous {
        row.shape.source = entry.source.rsplit('/').next().map(str::to_owned);
        row.shape.content_hash.clone_from(&entry.content_hash);
    }
    Released::Row(Box::new(row))
}

/// A package that is being written.
struct Package<'a> {
    root: &'a Path,
    layers: BTreeSet<String>,
    shard_size: usize,
    /// The rows that wait for their file.
    rows: Vec<ReleasedRow>,
    files: BTreeMap<String, FileFacts>,
    counts: Counts,
    labeled_files: BTreeSet<String>,
}

impl Package<'_> {
    fn add(&mut self, file_id: &str, row: ReleasedRow) -> Result<()> {
        self.count(file_id, &row);
        self.rows.push(row);
        if self.rows.len() < self.shard_size {
            return Ok(());
        }
        self.write_rows()
    }

    fn count(&mut self, file_id: &str, row: &ReleasedRow) {
        let counts = &mut self.counts;
        let Some(labels) = &row.labels else {
            let status = row.shape.status.clone();
            *counts.without_labels.entry(status).or_default() += 1;
            return;
        };
        if self.labeled_files.insert(file_id.to_owned()) {
            counts.n_files += 1;
        }
        counts.n_shapes += 1;
        counts.n_faces += row.shape.n_faces;
        counts.n_edges += labels.edge_faces.len() as u64;
        counts.n_undefined_angles +=
            labels.phi_deg.iter().filter(|phi| phi.is_none()).count() as u64;
        counts.n_parts += row.shape.n_parts;
        counts.n_labels += row.shape.n_labels;
        for kind in &labels.face_type {
            let n = counts.faces_by_type.entry(kind.name().to_owned());
            *n.or_default() += 1;
        }
    }

    fn leave_out(&mut self, reason: &str, entry: &IndexEntry) {
        let n = self.counts.left_out.entry(reason.to_owned()).or_default();
        *n += entry.n_skipped.unwrap_or(1);
    }

    fn write_rows(&mut self) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let bytes = rows_to_parquet(&self.rows, &self.layers)?;
        self.rows.clear();
        let name = labels_file(self.files.len());
        self.write(&name, &bytes)
    }

    fn write(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        write_atomically(&self.root.join(name), bytes)?;
        self.files.insert(name.to_owned(), FileFacts::of(bytes));
        Ok(())
    }

    /// Writes the texts, and `release.json` last.
    fn conclude(mut self, manifest: Manifest, facts: &DatasheetFacts) -> Result<Manifest> {
        ensure!(
            manifest.counts.n_shapes > 0,
            "no shape of the data set has labels that can be released"
        );
        self.write_rows()?;
        self.write(DATASHEET_FILE, datasheet(&manifest, facts).as_bytes())?;
        self.write(
            LICENSE_NOTE_FILE,
            license_note(manifest.license.as_deref()).as_bytes(),
        )?;
        let manifest = Manifest {
            files: self.files,
            ..manifest
        };
        write_atomically(&self.root.join(MANIFEST_FILE), &json_document(&manifest)?)?;
        Ok(manifest)
    }
}

/// A text with the number of shapes with labels that are not in the package. It is empty if all are in it.
fn left_out(counts: &Counts) -> String {
    let n: u64 = counts.left_out.values().sum();
    match n {
        0 => String::new(),
        n => format!("\nleft out: {n}, DATASHEET.md says why"),
    }
}

fn summary(out: &Path, manifest: &Manifest) -> String {
    let counts = &manifest.counts;
    let number = |n: u64, one, many| counted(usize::try_from(n).unwrap_or(usize::MAX), one, many);
    let bytes: u64 = manifest.files.values().map(|file| file.bytes).sum();
    format!(
        "{}: labels of {} in {}, {}, {}\nwithout labels: {}{}",
        out.display(),
        number(counts.n_shapes, "shape", "shapes"),
        number(counts.n_files, "file", "files"),
        number(counts.n_faces, "face", "faces"),
        file_size(bytes),
        number(
            counts.without_labels.values().sum(),
            "file or solid",
            "files or solids"
        ),
        left_out(counts),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The id of a file whose lines have these ids and solids.
    #[track_caller]
    fn check(source: &str, lines: &[(&str, Option<u64>)], expected: &str) {
        let entry = |&(id, solid_step_id): &(&str, Option<u64>)| IndexEntry {
            source: source.to_owned(),
            solid_step_id,
            ..IndexEntry::new(id, Status::Failed)
        };
        let entries: Vec<IndexEntry> = lines.iter().map(entry).collect();
        assert_eq!(file_id(&entries), expected);
    }

    #[test]
    fn solids_share_the_id_of_their_file() {
        check("d/a.step", &[("d__a", None)], "d__a");
        check("d/a.step", &[("d__a__s3", Some(7))], "d__a");
        check(
            "d/a.step",
            &[("d__a__s1", None), ("d__a__s2", Some(7))],
            "d__a",
        );
        check("d/a.step", &[("d__a__s1", None)], "d__a");
        check("d/a.step", &[("d__a.step__s1", None)], "d__a.step");
        check("d/a__s1.step", &[("d__a__s1", None)], "d__a__s1");
        check("d/a__s1.step", &[("d__a__s1__s1", None)], "d__a__s1");
        check("d/a__s1.step", &[("d__a__s1__s1", Some(7))], "d__a__s1");
    }
}
