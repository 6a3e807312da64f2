//! Runs `partprobe status`: shows the progress of a batch, its failures with their reasons, and the use of its time.

use crate::audit::audited;
use crate::counted::{counted, file_size};
use crate::dataset_settings::DatasetSettings;
use crate::label::ReasonCounts;
use crate::markdown_table::Alignment::{self, Left, Right};
use crate::markdown_table::markdown_table;
use crate::stdout::{print_line, print_tables};
use anyhow::{Context, Result, ensure};
use partprobe_dataset::{
    Audit, Damage, Dataset, DatasetError, FileRecord, INDEX_FILE, IndexEntry, JOURNAL_FILE,
    JournalLine, Status, TIMING_FILE, Timing, for_each_line, is_being_written, json_document,
};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

/// The number of the slowest files, of the largest results and of the reasons that are shown.
const N_SHOWN: usize = 10;
/// A pause longer than this between two files belongs to no session.
const LONGEST_PAUSE_S: f64 = 3600.0;

/// Show the progress of a batch, and which files failed and why. The batch can be running, stopped or finished.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example: partprobe status dataset/
Reasons that differ only in numbers share one line, which has … instead of these numbers.
Every carrier of a finished data set is read and compared with the index; if one is missing, damaged, changed or that of another
shape, it is named and the exit code is 1. --quick skips this check.")]
pub(crate) struct StatusArgs {
    /// The data set.
    #[arg(value_name = "DATASET")]
    dataset: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Do not read the carriers of a finished data set.
    #[arg(long)]
    quick: bool,
}

/// Prints the state of the batch.
///
/// # Errors
/// If the folder has no data set, finished or not, or carriers of it are not those that were labeled.
pub(crate) fn status(args: &StatusArgs) -> Result<()> {
    let mut report = Report::of(&args.dataset)?;
    if report.state == State::Finished && !args.quick && Dataset::open(&args.dataset).is_ok() {
        report.carriers = Some(audited(&Dataset::open(&args.dataset)?));
    }
    if args.json {
        let text = json_document(&report)?;
        print_line(String::from_utf8_lossy(&text).trim_end())?;
    } else {
        print_tables(&report)?;
    }
    let n_damaged = report.carriers.map_or(0, |audit| audit.damaged.len());
    let carriers = format!(
        "{} of {}",
        counted(n_damaged, "carrier", "carriers"),
        args.dataset.display()
    );
    let verb = if n_damaged == 1 {
        "is not the one that was"
    } else {
        "are not those that were"
    };
    ensure!(n_damaged == 0, "{carriers} {verb} labeled");
    Ok(())
}

/// The state of a batch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
enum State {
    Running,
    Stopped,
    Finished,
}

/// The progress of a batch.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Report {
    state: State,
    /// The share of the batch, if it is one.
    shard: Option<String>,
    /// Files that are done.
    n_done: u64,
    /// The total number of files, according to the lists of the archives. It is `None` if the batch is finished.
    n_files: Option<u64>,
    /// Whether there may be more files, because a tar archive has no list.
    may_have_more: bool,
    n_shapes: u64,
    by_status: BTreeMap<&'static str, u64>,
    failures: Vec<FailureCount>,
    /// The files that are not read because they are neither STEP nor archives.
    skipped: Vec<FailureCount>,
    /// Bytes of the files that were written.
    bytes: u64,
    /// Seconds of all workers together.
    worker_seconds: f64,
    /// Files per second of wall time over all sessions. It is `None` if too few files are done.
    files_per_second: Option<f64>,
    slowest: Vec<Costly>,
    largest: Vec<Costly>,
    /// The result of a check of the carriers, or `None` if they were not checked.
    carriers: Option<Audit>,
}

/// A reason, with the number of times that it was given.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct FailureCount {
    status: &'static str,
    reason: String,
    n: u64,
    /// The source of the first of them.
    first: String,
}

impl FailureCount {
    fn of(counts: &ReasonCounts<Status>) -> Vec<Self> {
        let rows = counts.ranked().into_iter();
        rows.map(|row| Self {
            status: row.kind.name(),
            reason: row.reason.to_owned(),
            n: row.n,
            first: row.first.to_owned(),
        })
        .collect()
    }
}

/// A file that took long, or became large.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct Costly {
    source: String,
    seconds: Option<f64>,
    bytes: u64,
}

/// The numbers of a batch while they are added up.
#[derive(Default)]
struct Tally {
    n_done: u64,
    n_shapes: u64,
    by_status: BTreeMap<&'static str, u64>,
    failures: ReasonCounts<Status>,
    skipped: ReasonCounts<Status>,
    timings: Vec<Timing>,
    session_starts: Vec<f64>,
    expected: Option<(u64, bool)>,
}

impl Tally {
    fn add_entries(&mut self, entries: &[IndexEntry]) {
        self.n_done += u64::from(entries.iter().any(|entry| entry.status != Status::Skipped));
        for entry in entries {
            self.n_shapes += u64::from(entry.status == Status::Ok);
            let n = entry.n_skipped.unwrap_or(1);
            *self.by_status.entry(entry.status.name()).or_default() += n;
            if let Some(reason) = &entry.reason {
                let counts = if entry.status == Status::Skipped {
                    &mut self.skipped
                } else {
                    &mut self.failures
                };
                counts.add(entry.status, reason, n, &entry.source);
            }
        }
    }

    /// Reads the journal twice, because a later line of a file replaces an earlier one. So memory does not grow with its lines.
    fn of_journal(folder: &Path) -> Result<Self> {
        let mut tally = Self::default();
        let mut journal = File::open(folder.join(JOURNAL_FILE)).context("opening the journal")?;
        let mut last_line: BTreeMap<[u8; 16], u64> = BTreeMap::new();
        for_each_line(&mut journal, |line, start, _| match line {
            JournalLine::Session {
                started,
                n_files,
                has_more,
            } => {
                tally.session_starts.push(started);
                tally.expected = Some((n_files, has_more));
            }
            JournalLine::File(record) => {
                last_line.insert(key_of(&record), start);
            }
        })?;
        for_each_line(&mut journal, |line, start, _| {
            if let JournalLine::File(record) = line
                && last_line.get(&key_of(&record)) == Some(&start)
            {
                tally.add_entries(&record.entries);
                tally.timings.push(Timing::of(&record));
            }
        })?;
        Ok(tally)
    }

    fn of_finished(folder: &Path) -> Result<Self> {
        let mut tally = Self::default();
        let dataset = Dataset::open_any(folder)?;
        dataset
            .entries()
            .chunk_by(|a, b| a.source == b.source && b.member.is_none())
            .for_each(|file| tally.add_entries(file));
        // The times do not belong to a data set, so their file may be missing.
        let times = fs::read_to_string(folder.join(TIMING_FILE)).unwrap_or_default();
        tally.timings = times
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .collect();
        Ok(tally)
    }

    /// The wall time in which files were processed, in seconds. Pauses between sessions are left out.
    fn working_seconds(&self) -> f64 {
        let is_known = |time: &f64| *time > 0.0;
        let mut ends: Vec<f64> = self
            .timings
            .iter()
            .map(|timing| timing.ended)
            .filter(is_known)
            .collect();
        ends.sort_by(f64::total_cmp);
        let is_pause = |from: f64, to: f64| {
            to - from > LONGEST_PAUSE_S
                || self
                    .session_starts
                    .iter()
                    .any(|&start| from < start && start < to)
        };
        ends.windows(2)
            .filter(|pair| !is_pause(pair[0], pair[1]))
            .map(|pair| pair[1] - pair[0])
            .sum()
    }

    /// The files with the largest cost.
    fn costliest(&self, cost: impl Fn(&Timing) -> f64) -> Vec<Costly> {
        let mut timings: Vec<&Timing> = self
            .timings
            .iter()
            .filter(|timing| cost(timing) > 0.0)
            .collect();
        timings.sort_by(|a, b| cost(b).total_cmp(&cost(a)));
        let costly = |timing: &&Timing| Costly {
            source: timing.source.clone(),
            seconds: timing.seconds,
            bytes: timing.bytes,
        };
        timings.iter().take(N_SHOWN).map(costly).collect()
    }
}

/// A hash of the key that distinguishes the files of a journal.
fn key_of(record: &FileRecord) -> [u8; 16] {
    let hash = Sha256::digest(format!("{}\n{}", record.position, record.source));
    *hash.first_chunk().unwrap_or(&[0; 16])
}

impl Report {
    fn of(folder: &Path) -> Result<Self> {
        let settings = DatasetSettings::read(folder)?;
        let (is_begun, has_index) = (
            folder.join(JOURNAL_FILE).exists(),
            folder.join(INDEX_FILE).exists(),
        );
        ensure!(
            is_begun || has_index,
            DatasetError::NotADataset(folder.to_owned())
        );
        let state = match (is_begun, is_being_written(folder)) {
            (false, _) => State::Finished,
            (true, true) => State::Running,
            (true, false) => State::Stopped,
        };
        let tally = if is_begun {
            Tally::of_journal(folder)?
        } else {
            Tally::of_finished(folder)?
        };
        let working_seconds = tally.working_seconds();
        Ok(Self {
            state,
            shard: settings.shard.map(|shard| shard.to_string()),
            n_done: tally.n_done,
            n_files: tally.expected.map(|(n_files, _)| n_files),
            may_have_more: tally.expected.is_some_and(|(_, has_more)| has_more),
            n_shapes: tally.n_shapes,
            failures: FailureCount::of(&tally.failures),
            skipped: FailureCount::of(&tally.skipped),
            bytes: tally.timings.iter().map(|timing| timing.bytes).sum(),
            worker_seconds: tally
                .timings
                .iter()
                .filter_map(|timing| timing.seconds)
                .sum(),
            files_per_second: (working_seconds > 0.0)
                .then(|| tally.timings.len() as f64 / working_seconds),
            slowest: tally.costliest(|timing| timing.seconds.unwrap_or(0.0)),
            largest: tally.costliest(|timing| timing.bytes as f64),
            by_status: tally.by_status,
            carriers: None,
        })
    }
}

/// Writes a table with an empty line before it.
fn write_table<const N: usize>(
    f: &mut fmt::Formatter<'_>,
    heading: [&str; N],
    alignment: [Alignment; N],
    rows: impl Iterator<Item = [String; N]>,
) -> fmt::Result {
    writeln!(f, "\n{}", markdown_table(heading, alignment, rows))
}

fn write_reasons(f: &mut fmt::Formatter<'_>, reasons: &[FailureCount]) -> fmt::Result {
    let rows = reasons.iter().take(N_SHOWN).map(|row| {
        let (n, status) = (row.n.to_string(), row.status.to_owned());
        [n, status, row.first.clone(), row.reason.clone()]
    });
    let heading = ["n", "status", "first", "reason"];
    write_table(f, heading, [Right, Left, Left, Left], rows)?;
    match reasons.len().saturating_sub(N_SHOWN) {
        0 => Ok(()),
        n_more => writeln!(f, "\nand {n_more} more, see --json"),
    }
}

fn write_costly(
    f: &mut fmt::Formatter<'_>,
    what: &str,
    unit: &str,
    files: &[Costly],
    cost: impl Fn(&Costly) -> String,
) -> fmt::Result {
    if files.is_empty() {
        return Ok(());
    }
    let rows = files.iter().map(|file| [cost(file), file.source.clone()]);
    write_table(f, [unit, &format!("{what} files")], [Right, Left], rows)
}

fn write_audit(f: &mut fmt::Formatter<'_>, audit: &Audit) -> fmt::Result {
    let Audit {
        n_read,
        n_without_hash,
        damaged,
    } = audit;
    write!(f, "\ncarriers: {n_read} read, ")?;
    match damaged.len() {
        0 => write!(f, "all as they were labeled")?,
        n => write!(f, "{n} missing, damaged or changed")?,
    }
    if *n_without_hash > 0 {
        write!(
            f,
            ", {n_without_hash} of an earlier version, without a hash"
        )?;
    }
    for Damage { id, reason } in damaged.iter().take(N_SHOWN) {
        write!(f, "\n  {id}: {reason}")?;
    }
    if damaged.len() > N_SHOWN {
        write!(f, "\n  and {} more, see --json", damaged.len() - N_SHOWN)?;
    }
    Ok(())
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = match self.state {
            State::Running => "running",
            State::Stopped => "stopped; continue with `partprobe label … --resume`",
            State::Finished => "finished",
        };
        let shard = self
            .shard
            .as_ref()
            .map(|shard| format!(", share {shard}"))
            .unwrap_or_default();
        writeln!(f, "state: {state}{shard}")?;
        write!(f, "files: {}", self.n_done)?;
        if let Some(n_files) = self.n_files {
            let at_least = if self.may_have_more { "at least " } else { "" };
            write!(f, " of {at_least}{}", n_files.max(self.n_done))?;
        }
        let rate = self
            .files_per_second
            .map(|rate| format!(", {rate:.1} per second"))
            .unwrap_or_default();
        writeln!(f, "{rate}, {:.0} s in workers", self.worker_seconds)?;
        writeln!(f, "shapes: {}, {}", self.n_shapes, file_size(self.bytes))?;
        let statuses = self.by_status.iter();
        let rows = statuses.map(|(status, n)| [(*status).to_owned(), n.to_string()]);
        write_table(f, ["status", "files or shapes"], [Left, Right], rows)?;
        if !self.failures.is_empty() {
            let n_reasons = counted(self.failures.len(), "reason", "reasons");
            writeln!(f, "\n{n_reasons} why files or shapes have no carrier:")?;
            write_reasons(f, &self.failures)?;
        }
        if !self.skipped.is_empty() {
            let n_skipped: u64 = self.skipped.iter().map(|row| row.n).sum();
            writeln!(f, "\nskipped: {n_skipped}")?;
            write_reasons(f, &self.skipped)?;
        }
        write_costly(f, "slowest", "seconds", &self.slowest, |file| {
            format!("{:.2}", file.seconds.unwrap_or(0.0))
        })?;
        write_costly(f, "largest", "size", &self.largest, |file| {
            file_size(file.bytes)
        })?;
        self.carriers
            .as_ref()
            .map_or(Ok(()), |audit| write_audit(f, audit))
    }
}
