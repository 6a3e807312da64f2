//! Runs `partprobe merge`: the shares of a batch become one data set.

use crate::audit::audited;
use crate::counted::counted;
use crate::dataset_settings::DatasetSettings;
use crate::interrupt;
use crate::label::{Shard, Summary, belongs_to_data_set};
use crate::output_folder::{make_folder, remove_content};
use crate::own_output::OwnOutput;
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_dataset::{Dataset, DatasetWriter, FileRecord, SETTINGS_FILE, TIMING_FILE, Timing};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Join the shares of a batch, which `label --shard` made, into the data set that one machine would have made.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:
  partprobe label abc/ --out share1/ --shard 1/2            on one machine
  partprobe label abc/ --out share2/ --shard 2/2            on another
  partprobe merge share1/ share2/ --out dataset/

Files are hard links if the shares are on the same disk, and copies if not. Settings and inputs must be the same, and no share may
be missing: a missing one is named.
Exit codes: 0 at least one share has a shape, 1 none, 2 wrong usage.")]
pub(crate) struct MergeArgs {
    /// The shares.
    #[arg(required = true, value_name = "SHARE")]
    shares: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, short, value_name = "DATASET")]
    out: PathBuf,
    /// Replace the output of an earlier call.
    #[arg(long)]
    force: bool,
    /// Do not check that the carriers of the shares are as they were labeled.
    #[arg(long)]
    quick: bool,
}

/// The files of the verb: those of a data set.
const OUTPUT: OwnOutput = OwnOutput {
    verb: "merge",
    marker: Some(SETTINGS_FILE),
    is_own: belongs_to_data_set,
};

/// Joins the shares. The bytes of the result are those of a batch without shares.
///
/// # Errors
/// If shares are missing, unfinished, damaged or of different batches, the folder is not empty, or no share has a shape.
pub(crate) fn merge(args: &MergeArgs) -> Result<()> {
    let shares = args
        .shares
        .iter()
        .map(|path| Share::open(path))
        .collect::<Result<Vec<_>>>()?;
    let settings = common_settings(&shares)?;
    refuse_repeated_ids(&shares)?;
    if !args.quick {
        shares.iter().try_for_each(Share::ensure_undamaged)?;
    }
    interrupt::end_at_once()?;
    let _lock = OUTPUT.take(&args.out, "merging into", args.force, &args.shares)?;

    let joined = joined(&shares, &settings, &args.out);
    let summary = joined.inspect_err(|_| {
        // The shares have everything. A failed removal does no harm, because the original error is reported.
        let _ = remove_content(&args.out, &[]);
    })?;
    print_line(&summary)?;
    summary.ensure_labeled(&args.out)
}

/// Writes the data set.
fn joined(shares: &[Share], settings: &DatasetSettings, out: &Path) -> Result<Summary> {
    let mut writer = DatasetWriter::create(out, settings)?;
    let n_entries = shares.iter().map(|share| share.dataset.entries().len());
    let bar = Progress::on_terminal().bar("merge", n_entries.sum());
    for share in shares {
        let times = share.times();
        for record in share.dataset.records() {
            share.link_files(&record, out)?;
            bar.inc(record.entries.len() as u64);
            writer.record(with_times(record, &times))?;
        }
    }
    let mut summary = Summary::default();
    writer.finish_visiting(|entries| summary.add(entries))?;
    Ok(summary)
}

/// One share of a batch.
struct Share {
    path: PathBuf,
    settings: DatasetSettings,
    shard: Shard,
    dataset: Dataset,
}

impl Share {
    fn open(path: &Path) -> Result<Self> {
        let settings = DatasetSettings::read(path)?;
        let dataset = Dataset::open_any(path)?;
        let Some(shard) = settings.shard else {
            bail!(UsageError(format!(
                "{} is not a share: it was labeled without --shard",
                path.display()
            )));
        };
        Ok(Self {
            path: path.to_owned(),
            settings: DatasetSettings {
                shard: None,
                ..settings
            },
            shard,
            dataset,
        })
    }

    /// Refuses a share with carriers that are missing, damaged or changed.
    fn ensure_undamaged(&self) -> Result<()> {
        let damaged = audited(&self.dataset).damaged;
        if let Some(first) = damaged.first() {
            bail!(
                "{}: {} not as labeled, first {}: {}; label this share again with --resume",
                self.path.display(),
                counted(damaged.len(), "carrier is", "carriers are"),
                first.id,
                first.reason
            );
        }
        Ok(())
    }

    /// The time at which each file was labeled and its duration, by source. It is empty if the share has no such list.
    fn times(&self) -> BTreeMap<String, Timing> {
        let text = fs::read_to_string(self.path.join(TIMING_FILE)).unwrap_or_default();
        text.lines()
            .filter_map(|line| serde_json::from_str(line).ok())
            .map(|timing: Timing| (timing.source.clone(), timing))
            .collect()
    }

    /// Puts the files of a record into the folder `out`, as links if possible, and otherwise as copies.
    fn link_files(&self, record: &FileRecord, out: &Path) -> Result<()> {
        for entry in &record.entries {
            for file in entry.files() {
                let from = self.dataset.path_of(entry, file)?;
                let to = out.join(file);
                make_folder(to.parent().unwrap_or(out))?;
                if fs::hard_link(&from, &to).is_err() {
                    fs::copy(&from, &to).with_context(|| format!("copying {}", from.display()))?;
                }
            }
        }
        Ok(())
    }
}

/// The settings that all shares have. Each share must occur exactly once.
fn common_settings(shares: &[Share]) -> Result<DatasetSettings> {
    let first = shares.first().context("no share was given")?;
    let mut known: BTreeMap<Shard, &Path> = BTreeMap::new();
    for share in shares {
        let differences = share.settings.differences(&first.settings);
        let (path, first_path) = (share.path.display(), first.path.display());
        ensure!(
            differences.is_empty() && share.shard.of == first.shard.of,
            UsageError(format!(
                "{path} and {first_path} are of different batches: {}",
                if differences.is_empty() {
                    format!("share {} and share {}", share.shard, first.shard)
                } else {
                    differences.join("; ")
                }
            ))
        );
        if let Some(other) = known.insert(share.shard, &share.path) {
            bail!(UsageError(format!(
                "{path} and {} are both share {}",
                other.display(),
                share.shard
            )));
        }
    }
    let of = first.shard.of;
    let missing: Vec<String> = (1..=of)
        .map(|index| Shard { index, of })
        .filter(|shard| !known.contains_key(shard))
        .map(|shard| shard.to_string())
        .collect();
    ensure!(
        missing.is_empty(),
        UsageError(format!("shares are missing: {}", missing.join(", ")))
    );
    Ok(first.settings.clone())
}

fn refuse_repeated_ids(shares: &[Share]) -> Result<()> {
    let mut seen = BTreeSet::new();
    for entry in shares.iter().flat_map(|share| share.dataset.entries()) {
        ensure!(
            seen.insert(&entry.id),
            "the id {} is in two shares",
            entry.id
        );
    }
    Ok(())
}

/// The record with the times from its share.
fn with_times(record: FileRecord, times: &BTreeMap<String, Timing>) -> FileRecord {
    match times.get(&record.source) {
        Some(timing) => FileRecord {
            seconds: timing.seconds,
            ended: timing.ended,
            ..record
        },
        None => record,
    }
}
