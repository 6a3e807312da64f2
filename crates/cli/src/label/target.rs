//! Prepares the folder of a batch: new, replaced, resumed, or refused.

use super::changed_inputs::{ChangedInputs, Comparison};
use super::input_files::InputFile;
use super::job::{ExistingDataset, LabelJob};
use super::renamed_inputs::RenamedInputs;
use crate::audit::audited;
use crate::counted::counted;
use crate::dataset_settings::DatasetSettings;
use crate::folder_lock::FolderLock;
use crate::interrupt::Interrupt;
use crate::output_folder::{
    ensure_empty, make_folder, remove_content, remove_if_all_unfinished, remove_if_there,
    remove_unfinished,
};
use crate::own_output::ensure_replaceable;
use crate::stderr;
use crate::usage::UsageError;
use anyhow::{Result, bail, ensure};
use partprobe_dataset::{
    Dataset, DatasetWriter, FileRecord, INDEX_FILE, IndexEntry, JOURNAL_FILE, Journal,
    SETTINGS_FILE, TIMING_FILE, is_being_written, is_unfinished, write_journal,
};
use std::collections::BTreeMap;
use std::path::Path;

/// The largest number of shapes that are named because they are labeled again. Further ones are only counted.
const MAX_WARNINGS: usize = 10;

/// The state of the folder of a batch.
pub(super) enum Target {
    /// Files must still be labeled. The writer's journal records the finished ones.
    Open(DatasetWriter),
    /// The data set is complete, with the same settings.
    Finished(Dataset),
}

/// Prepares the folder for a batch, and locks it against other programs.
pub(super) fn prepare(
    job: &LabelJob,
    files: &[InputFile],
    interrupt: &Interrupt,
) -> Result<(Target, FolderLock)> {
    make_folder(&job.out)?;
    let lock = FolderLock::take(&job.out, "labeling into")?;
    let released = job.released.as_deref();
    let settings = DatasetSettings {
        package_sha256: released.map(|released| released.package().sha256.clone()),
        ..DatasetSettings::new(&job.config, files, job.shard)
    };
    match &job.existing {
        ExistingDataset::Replaced => remove_dataset(&job.out, files)?,
        ExistingDataset::Resumed | ExistingDataset::Retried(_)
            if job.out.join(SETTINGS_FILE).exists() =>
        {
            return Ok((resumed(job, &settings, files, interrupt)?, lock));
        }
        _ => {}
    }
    // A program that was killed before it wrote anything else may have left an unfinished file.
    remove_if_all_unfinished(&job.out)?;
    ensure_empty(
        &job.out,
        "choose another --out, continue with --resume, or replace it with --force",
    )?;
    let writer = DatasetWriter::create(&job.out, &settings)?;
    Ok((Target::Open(writer), lock))
}

fn resumed(
    job: &LabelJob,
    settings: &DatasetSettings,
    files: &[InputFile],
    interrupt: &Interrupt,
) -> Result<Target> {
    let out = &job.out;
    let known = DatasetSettings::read(out)?;
    let comparison = Comparison {
        files,
        shard: job.shard,
        max_bytes: job.config.label.max_file_mb << 20,
        interrupt,
    };
    let is_finished = Dataset::is_at(out) && !out.join(JOURNAL_FILE).exists();
    let records = if is_finished {
        Dataset::open_any(out)?.records()
    } else {
        records_in_journal(out)?
    };
    let retried = match &job.existing {
        ExistingDataset::Retried(outcomes) => outcomes.as_slice(),
        _ => &[],
    };
    let differences = match retried {
        [] => settings.differences(&known),
        _ => settings.differences_except_raised_budgets(&known),
    };
    if !differences.is_empty() {
        let has_other_inputs = settings.inputs != known.inputs;
        let changes = if has_other_inputs {
            input_changes(&records, &comparison, is_finished)?
        } else {
            Vec::new()
        };
        bail!(resume_error(out, &differences, &changes));
    }

    let changed = ChangedInputs::find(&records, &comparison)?;
    let damaged = if is_finished {
        damaged_shapes(&Dataset::open_any(out)?)
    } else {
        BTreeMap::new()
    };
    changed.warn();
    warn_of_damaged(&damaged);
    let is_damaged =
        |entry: &IndexEntry| retried.contains(&entry.status) || damaged.contains_key(&entry.id);
    let is_repeated =
        |record: &FileRecord| changed.has(record) || record.entries.iter().any(is_damaged);
    let (repeated, kept): (Vec<_>, Vec<_>) = records.into_iter().partition(is_repeated);
    let is_as_it_was = repeated.is_empty() && changed.is_empty();
    if is_finished && is_as_it_was {
        return Ok(Target::Finished(Dataset::open_any(out)?));
    }
    if !is_as_it_was {
        forget(out, &repeated, kept)?;
    }
    reopened(out, settings)
}

/// Resumes the journal without the incomplete records of a stopped program, and writes the current settings.
fn reopened(out: &Path, settings: &DatasetSettings) -> Result<Target> {
    remove_unfinished(out)?;
    Ok(Target::Open(DatasetWriter::resume(out, settings)?))
}

/// The files in which the inputs differ from the previous inputs: one text per kind of difference.
fn input_changes(
    records: &[FileRecord],
    comparison: &Comparison<'_>,
    is_finished: bool,
) -> Result<Vec<String>> {
    // A share only has records of its own files.
    let has_all_records = is_finished && comparison.shard.is_none();
    let mut changes = RenamedInputs::find(records, comparison.files, has_all_records).named();
    let changed = ChangedInputs::find(records, comparison)?;
    if !changed.is_empty() {
        changes.push(format!("edited or unreadable: {}", changed.named()));
    }
    Ok(changes)
}

/// The reason why a data set cannot be resumed with these settings and inputs.
fn resume_error(out: &Path, differences: &[String], changes: &[String]) -> UsageError {
    let changes = match changes {
        [] => String::new(),
        _ => format!(" ({})", changes.join("; ")),
    };
    let out = out.display();
    let differences = differences.join("; ");
    UsageError(format!(
        "{out} was created with different settings: {differences}{changes}; use the same arguments as before, or choose another --out"
    ))
}

/// Removes files from the journal, which is made again for a finished data set, and removes their written files.
fn forget(out: &Path, repeated: &[FileRecord], kept: Vec<FileRecord>) -> Result<()> {
    write_journal(out, kept)?;
    // A folder with a journal is unfinished, even if it has other files. From now on, it can be resumed.
    for stale in [INDEX_FILE, TIMING_FILE]
        .map(str::to_owned)
        .into_iter()
        .chain(files_of_records(repeated))
    {
        remove_if_there(&out.join(stale))?;
    }
    Ok(())
}

/// The shapes with a file that is missing, damaged or changed, each with the reason.
fn damaged_shapes(dataset: &Dataset) -> BTreeMap<String, String> {
    let carriers = audited(dataset).damaged;
    let mut reasons: BTreeMap<String, String> = carriers
        .into_iter()
        .map(|damage| (damage.id, damage.reason))
        .collect();
    for entry in dataset.entries() {
        let is_missing = |file: &&String| {
            !dataset
                .path_of(entry, file)
                .is_ok_and(|path| path.is_file())
        };
        if let Some(file) = entry.files().find(is_missing) {
            let reason = format!("{} does not exist", dataset.root().join(file).display());
            reasons.entry(entry.id.clone()).or_insert(reason);
        }
    }
    reasons
}

/// Prints on stderr which shapes are labeled again.
fn warn_of_damaged(reasons: &BTreeMap<String, String>) {
    for (id, reason) in reasons.iter().take(MAX_WARNINGS) {
        stderr::print_line(format_args!("warning: {id} is labeled again: {reason}"));
    }
    if reasons.len() > MAX_WARNINGS {
        let more = counted(
            reasons.len() - MAX_WARNINGS,
            "more shape is",
            "more shapes are",
        );
        stderr::print_line(format_args!("warning: and {more} labeled again"));
    }
}

fn files_of_records(records: &[FileRecord]) -> impl Iterator<Item = String> {
    records
        .iter()
        .flat_map(|record| &record.written)
        .map(|written| written.file.clone())
}

fn records_in_journal(out: &Path) -> Result<Vec<FileRecord>> {
    let mut records = Vec::new();
    Journal::open(out, |_| true)?.for_each_record(|record| {
        records.push(record);
        anyhow::Ok(())
    })?;
    Ok(records)
}

/// Removes the data set from the folder, finished or not. It refuses to do so if the folder has other files.
fn remove_dataset(out: &Path, files: &[InputFile]) -> Result<()> {
    ensure!(
        !is_being_written(out),
        UsageError(format!(
            "another partprobe is labeling into {}; stop it before --force replaces it",
            out.display()
        ))
    );
    let inputs = files.iter().map(|file| file.path.as_path());
    ensure_replaceable(out, "label", inputs, |path| {
        belongs_to_data_set(&path.file_name().unwrap_or_default().to_string_lossy())
    })?;
    // The folder itself is kept, because it is locked.
    remove_content(out, &[])
}

/// Whether a file with this name belongs to a data set, finished or not.
pub(crate) fn belongs_to_data_set(name: &str) -> bool {
    [INDEX_FILE, SETTINGS_FILE, TIMING_FILE, JOURNAL_FILE].contains(&name)
        || name.ends_with(".npz")
        || (name.starts_with('.') && name.ends_with(".part"))
        || is_unfinished(name)
}
