//! The folder of a batch: new, replaced, resumed, or refused.

use super::job::{Existing, LabelJob};
use super::source_files::SourceFile;
use crate::atomic_write::{is_unfinished, make_folder, write_atomically};
use crate::counted::counted;
use crate::dataset::{
    Audit, Dataset, DatasetSettings, FileRecord, INDEX_FILE, IndexEntry, JOURNAL_FILE, Journal, SETTINGS_FILE, Status,
    TIMING_FILE, WrittenFile, is_being_written, write_journal,
};
use crate::json_lines::json_document;
use crate::progress::Progress;
use crate::stderr;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Shapes that are labelled again are named up to this number, and counted beyond.
const MAX_WARNINGS: usize = 10;

/// What a batch finds in its folder.
pub(super) enum Target {
    /// Files are still to be labelled; the journal says which are done.
    Open(Journal),
    /// The data set is there, whole, with the same settings.
    Finished(Dataset),
}

/// Makes the folder ready for a batch.
pub(super) fn prepare(job: &LabelJob, files: &[SourceFile]) -> Result<Target> {
    let settings = DatasetSettings::new(&job.config, files, job.shard);
    match &job.existing {
        Existing::Replaced => remove_dataset(&job.out, files)?,
        Existing::Resumed | Existing::Retried(_) if job.out.join(SETTINGS_FILE).exists() => {
            return resumed(job, &settings);
        }
        _ => {}
    }
    prepare_folder(&job.out)?;
    begun(&job.out, &settings)
}

/// Writes the settings and begins the journal.
fn begun(out: &Path, settings: &DatasetSettings) -> Result<Target> {
    write_atomically(&out.join(SETTINGS_FILE), &json_document(settings)?)?;
    Ok(Target::Open(Journal::open(out, |_| true)?))
}

fn resumed(job: &LabelJob, settings: &DatasetSettings) -> Result<Target> {
    let out = &job.out;
    let known = DatasetSettings::read(out)?;
    let outcomes = if let Existing::Retried(outcomes) = &job.existing { outcomes.as_slice() } else { &[] };
    let differences = match outcomes {
        [] => settings.differences(&known),
        _ => settings.differences_but_raised_budgets(&known),
    };
    ensure!(
        differences.is_empty(),
        UsageError(format!(
            "{} was begun otherwise: {}; call as before, or choose another --out",
            out.display(),
            differences.join("; ")
        ))
    );
    let is_finished = Dataset::is_at(out) && !out.join(JOURNAL_FILE).exists();
    if is_finished || !outcomes.is_empty() {
        // The lock is held until the records to repeat are gone.
        let finished = forget(out, outcomes, is_finished)?;
        if let Some(finished) = finished {
            return Ok(Target::Finished(finished));
        }
    }
    remove_unfinished(out)?;
    let is_whole = |record: &FileRecord| record.written.iter().all(|written| is_there(out, written));
    let journal = Journal::open(out, is_whole)?;
    write_atomically(&out.join(SETTINGS_FILE), &json_document(settings)?)?;
    Ok(Target::Open(journal))
}

/// Whether a file has come to disk as a whole; after a power cut it may not have.
fn is_there(out: &Path, written: &WrittenFile) -> bool {
    fs::metadata(out.join(&written.file)).is_ok_and(|data| data.len() == written.bytes)
}

/// Takes the files with one of these outcomes out of the journal, which a finished data set gets anew; of a finished
/// data set also those whose shapes are no longer as they were labelled.
///
/// Returns the data set if it is finished and there is no such file.
fn forget(out: &Path, outcomes: &[Status], is_finished: bool) -> Result<Option<Dataset>> {
    let (records, damaged) = if is_finished {
        let dataset = Dataset::open_any(out)?;
        (records_of(&dataset), damaged_shapes(&dataset))
    } else {
        (records_in_journal(out)?, BTreeSet::new())
    };
    let is_repeated = |entry: &IndexEntry| outcomes.contains(&entry.status) || damaged.contains(&entry.id);
    let (repeated, kept): (Vec<_>, Vec<_>) =
        records.into_iter().partition(|record: &FileRecord| record.entries.iter().any(is_repeated));
    if is_finished && repeated.is_empty() {
        return Ok(Some(Dataset::open_any(out)?));
    }
    write_journal(out, kept)?;
    // A folder with a journal is unfinished, whatever else stands in it; from here on it can be resumed.
    for stale in [INDEX_FILE, TIMING_FILE].map(str::to_owned).into_iter().chain(written_for(&repeated)) {
        remove_if_there(&out.join(stale))?;
    }
    Ok(None)
}

/// The shapes with a file that is missing, damaged or changed; they are named on stderr, since they are labelled again.
fn damaged_shapes(dataset: &Dataset) -> BTreeSet<String> {
    let carriers = Audit::of(dataset, &Progress::on_terminal()).damaged;
    let mut reasons: BTreeMap<String, String> = carriers.into_iter().map(|damage| (damage.id, damage.reason)).collect();
    for entry in dataset.entries() {
        let is_missing = |file: &&String| !dataset.path_of(entry, file).is_ok_and(|path| path.is_file());
        if let Some(file) = entry.files().find(is_missing) {
            let reason = format!("{} does not exist", dataset.root().join(file).display());
            reasons.entry(entry.id.clone()).or_insert(reason);
        }
    }
    for (id, reason) in reasons.iter().take(MAX_WARNINGS) {
        stderr::print_line(format_args!("warning: {id} is labelled again: {reason}"));
    }
    if reasons.len() > MAX_WARNINGS {
        let more = counted(reasons.len() - MAX_WARNINGS, "more shape is", "more shapes are");
        stderr::print_line(format_args!("warning: and {more} labelled again"));
    }
    reasons.into_keys().collect()
}

fn written_for(records: &[FileRecord]) -> impl Iterator<Item = String> {
    records.iter().flat_map(|record| &record.written).map(|written| written.file.clone())
}

fn records_in_journal(out: &Path) -> Result<Vec<FileRecord>> {
    let mut records = Vec::new();
    Journal::open(out, |_| true)?.for_each_record(|record| {
        records.push(record);
        Ok(())
    })?;
    Ok(records)
}

/// The lines of an index, as the journal had them but for the times.
fn records_of(dataset: &Dataset) -> Vec<FileRecord> {
    let mut records: Vec<FileRecord> = Vec::new();
    for entry in dataset.entries() {
        match records.last_mut().filter(|last| last.source == entry.source && entry.member.is_none()) {
            Some(last) => {
                last.written.extend(written_of(dataset.root(), entry));
                last.entries.push(entry.clone());
            }
            None => records.push(FileRecord {
                source: entry.source.clone(),
                position: entry.member.unwrap_or(0),
                entries: vec![entry.clone()],
                written: written_of(dataset.root(), entry),
                seconds: None,
                ended: 0.0,
            }),
        }
    }
    records
}

fn written_of(root: &Path, entry: &IndexEntry) -> Vec<WrittenFile> {
    let with_size = |file: &String| {
        let bytes = fs::metadata(root.join(file)).map_or(0, |data| data.len());
        WrittenFile { file: file.clone(), bytes }
    };
    entry.files().map(with_size).collect()
}

fn remove_if_there(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(error).with_context(|| format!("removing {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// Removes what a killed program was writing.
fn remove_unfinished(folder: &Path) -> Result<()> {
    for path in files_below(folder)? {
        if is_unfinished(&path.file_name().unwrap_or_default().to_string_lossy()) {
            remove_if_there(&path)?;
        }
    }
    Ok(())
}

/// Removes what labelling has written into the folder, finished or not; anything else in it is a reason to refuse.
fn remove_dataset(out: &Path, files: &[SourceFile]) -> Result<()> {
    if !out.exists() {
        return Ok(());
    }
    ensure!(
        !is_being_written(out),
        UsageError(format!(
            "another partprobe is labelling into {}; stop it before --force replaces it",
            out.display()
        ))
    );
    let out = &out.canonicalize().with_context(|| out.display().to_string())?;
    let inside = |file: &&SourceFile| file.path.canonicalize().is_ok_and(|path| path.starts_with(out));
    if let Some(file) = files.iter().find(inside) {
        bail!(UsageError(format!("{} lies in --out; --force would remove it", file.path.display())));
    }
    if let Some(path) = files_below(out)?.iter().find(|path| !is_ours(path)) {
        bail!(UsageError(format!("{} was not written by `label`, so --force removes nothing", path.display())));
    }
    fs::remove_dir_all(out).with_context(|| format!("removing {}", out.display()))
}

/// Whether a file is a part of a data set, finished or not.
fn is_ours(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    [INDEX_FILE, SETTINGS_FILE, TIMING_FILE, JOURNAL_FILE].contains(&name.as_str())
        || name.ends_with(".npz")
        || (name.starts_with('.') && name.ends_with(".part"))
        || is_unfinished(&name)
}

fn files_below(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).with_context(|| format!("reading {}", folder.display()))? {
            let entry = entry.with_context(|| format!("reading {}", folder.display()))?;
            if entry.file_type()?.is_dir() { open.push(entry.path()) } else { files.push(entry.path()) }
        }
    }
    Ok(files)
}

fn prepare_folder(out: &Path) -> Result<()> {
    make_folder(out)?;
    let is_empty = fs::read_dir(out).with_context(|| format!("reading {}", out.display()))?.next().is_none();
    ensure!(
        is_empty,
        UsageError(format!(
            "{} is not empty; choose another --out, continue with --resume, or replace it with --force",
            out.display()
        ))
    );
    Ok(())
}
