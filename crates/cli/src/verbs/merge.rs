//! `partprobe merge`: the shares of a batch become one data set.

use crate::dataset_settings::DatasetSettings;
use crate::folder_lock::FolderLock;
use crate::interrupt;
use crate::label::{Shard, Summary};
use crate::output_folder::{ensure_empty, make_folder};
use crate::progress::Progress;
use crate::stdout::print_line;
use crate::usage::UsageError;
use anyhow::{Context, Result, bail, ensure};
use partprobe_dataset::{
    Dataset, INDEX_FILE, IndexEntry, SETTINGS_FILE, TIMING_FILE, compare_paths, json_document,
    json_lines, write_atomically, write_atomically_with,
};
use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Join the shares of a batch, made with `label --shard`, into the data set that one machine would have made.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = "Example:
  partprobe label abc/ --out share1/ --shard 1/2            on one machine
  partprobe label abc/ --out share2/ --shard 2/2            on another
  partprobe merge share1/ share2/ --out dataset/

Files are hard links if the shards are on the same disk, and copies if not. Settings and inputs must be the
same, and every share must be there: a missing one is named.")]
pub(crate) struct MergeArgs {
    /// The shares.
    #[arg(required = true, value_name = "SHARE")]
    shares: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, value_name = "DATASET")]
    out: PathBuf,
}

/// Joins the shares; its bytes are those of the unshared batch.
///
/// # Errors
/// If shares are missing, unfinished or of different batches, or the folder is not empty.
pub(crate) fn merge(args: &MergeArgs) -> Result<()> {
    let shares = args
        .shares
        .iter()
        .map(|path| Share::open(path))
        .collect::<Result<Vec<_>>>()?;
    let settings = common_settings(&shares)?;
    let mut entries: Vec<(&Share, &IndexEntry)> = shares
        .iter()
        .flat_map(|share| {
            share
                .dataset
                .entries()
                .iter()
                .map(move |entry| (share, entry))
        })
        .collect();
    // The sort keeps the order of the shapes of one file, which are all in one share.
    entries.sort_by(|(_, a), (_, b)| {
        compare_paths(&a.source, &b.source).then(a.member.cmp(&b.member))
    });
    refuse_repeated_ids(&entries)?;
    ensure_empty(&args.out)?;
    interrupt::end_at_once()?;
    make_folder(&args.out)?;
    let _lock = FolderLock::take(&args.out, "merging into")?;
    link_files(&entries, &args.out)?;
    write_atomically(&args.out.join(SETTINGS_FILE), &json_document(&settings)?)?;
    join_timings(&shares, &args.out)?;
    write_atomically_with(&args.out.join(INDEX_FILE), |file| {
        anyhow::Ok(file.write_all(&json_lines(entries.iter().map(|(_, entry)| entry))?)?)
    })?;
    let entries: Vec<IndexEntry> = entries
        .into_iter()
        .map(|(_, entry)| entry.clone())
        .collect();
    print_line(Summary::of(&entries))
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
}

/// The settings that all shares have, which are there each once.
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

fn refuse_repeated_ids(entries: &[(&Share, &IndexEntry)]) -> Result<()> {
    let mut ids: Vec<&str> = entries.iter().map(|(_, entry)| entry.id.as_str()).collect();
    ids.sort_unstable();
    match ids.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => bail!("the id {} is in two shares", pair[0]),
        None => Ok(()),
    }
}

fn link_files(entries: &[(&Share, &IndexEntry)], out: &Path) -> Result<()> {
    let bar = Progress::on_terminal().bar("merge", entries.len());
    for (share, entry) in entries {
        for file in entry.files() {
            let (from, to) = (share.dataset.path_of(entry, file)?, out.join(file));
            let folder = to.parent().unwrap_or(out);
            fs::create_dir_all(folder).with_context(|| format!("making {}", folder.display()))?;
            if fs::hard_link(&from, &to).is_err() {
                fs::copy(&from, &to).with_context(|| format!("copying {}", from.display()))?;
            }
        }
        bar.inc(1);
    }
    Ok(())
}

/// The times of all shares, where they have them.
fn join_timings(shares: &[Share], out: &Path) -> Result<()> {
    write_atomically_with(&out.join(TIMING_FILE), |file| {
        for share in shares {
            if let Ok(bytes) = fs::read(share.path.join(TIMING_FILE)) {
                file.write_all(&bytes)?;
            }
        }
        anyhow::Ok(())
    })?;
    Ok(())
}
