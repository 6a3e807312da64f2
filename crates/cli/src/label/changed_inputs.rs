//! Finds files that were edited after they were labeled: their texts are read again, and the hashes are compared with the
//! recorded ones.
//!
//! Names, sizes and times of files are not used. So a file that was only copied or touched is not labeled again, and an edited
//! file is, even if its size is the same. Members of archives are compared one by one.

use super::input_files::InputFile;
use super::renamed_inputs::first_of;
use super::shard::Shard;
use super::text_hash::{hash_of_file, hash_of_member};
use crate::counted::counted;
use crate::interrupt::Interrupt;
use crate::progress::Progress;
use crate::stderr;
use anyhow::{Result, ensure};
use partprobe_dataset::{FileRecord, Status};
use partprobe_formats::{ArchiveKind, walk_archive};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;

/// The largest number of edited files that are named. Further ones are only counted.
const MAX_NAMED: usize = 10;
/// The size of the blocks in which an archive is read.
const BUFFER_BYTES: usize = 1 << 18;

/// The inputs and the limits of a comparison.
pub(super) struct Comparison<'a> {
    pub(super) files: &'a [InputFile],
    pub(super) shard: Option<Shard>,
    pub(super) max_bytes: u64,
    pub(super) interrupt: &'a Interrupt,
}

/// The sources that have changed since they were labeled.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct ChangedInputs {
    sources: BTreeSet<String>,
    /// The prefixes of the sources of changed archives.
    archives: BTreeSet<String>,
}

/// The recorded hash of each source. It is `None` if the text could not be read.
type NotedHashes<'a> = BTreeMap<&'a str, Option<&'a str>>;

fn noted_hash(record: &FileRecord) -> Option<&str> {
    record
        .entries
        .first()
        .and_then(|entry| entry.sha256.as_deref())
}

impl ChangedInputs {
    /// Reads every source that has a record, and compares its hash.
    ///
    /// # Errors
    /// If the user stops the program.
    pub(super) fn find(records: &[FileRecord], comparison: &Comparison<'_>) -> Result<Self> {
        let is_read = |record: &&FileRecord| {
            record.position == 0
                && record
                    .entries
                    .iter()
                    .all(|entry| entry.status != Status::Skipped)
        };
        let noted: NotedHashes<'_> = records
            .iter()
            .filter(is_read)
            .map(|record| (record.source.as_str(), noted_hash(record)))
            .collect();

        let bar = Progress::on_terminal().bar("compare inputs", comparison.files.len());
        let compare = |file: &InputFile| {
            let changed = match file.archive {
                _ if comparison.interrupt.is_set() => Self::default(),
                Some(kind) => comparison.changed_members(file, kind, &noted),
                None => comparison.changed_file(file, &noted),
            };
            bar.inc(1);
            changed
        };
        let changed: Vec<Self> = comparison.files.par_iter().map(compare).collect();
        bar.finish_and_clear();
        ensure!(
            !comparison.interrupt.is_set(),
            "stopped while the inputs were compared; nothing was changed"
        );

        let mut all = Self::default();
        for one in changed {
            all.sources.extend(one.sources);
            all.archives.extend(one.archives);
        }
        Ok(all)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.sources.is_empty()
    }

    /// Whether a record is outdated. The records of counted or refused members of a changed archive are also outdated.
    pub(super) fn has(&self, record: &FileRecord) -> bool {
        let is_unread = || record.entries.iter().all(|entry| entry.sha256.is_none());
        self.sources.contains(&record.source)
            || (is_unread()
                && self
                    .archives
                    .iter()
                    .any(|archive| record.source.starts_with(archive)))
    }

    /// The first of the sources, for a message.
    pub(super) fn named(&self) -> String {
        first_of(&self.sources)
    }

    /// Prints on stderr which files are labeled again.
    pub(super) fn warn(&self) {
        for source in self.sources.iter().take(MAX_NAMED) {
            stderr::print_line(format_args!(
                "warning: {source} is labeled again, because it was edited or cannot be read any more"
            ));
        }
        if self.sources.len() > MAX_NAMED {
            let more = counted(
                self.sources.len() - MAX_NAMED,
                "other such file is",
                "other such files are",
            );
            stderr::print_line(format_args!("warning: and {more} labeled again"));
        }
    }
}

impl Comparison<'_> {
    fn changed_file(&self, file: &InputFile, noted: &NotedHashes<'_>) -> ChangedInputs {
        let mut changed = ChangedInputs::default();
        if let Some(&hash) = noted.get(file.name.as_str())
            && hash_of_file(&file.path, self.max_bytes).as_deref() != hash
        {
            changed.sources.insert(file.name.clone());
        }
        changed
    }

    fn changed_members(
        &self,
        archive: &InputFile,
        kind: ArchiveKind,
        noted: &NotedHashes<'_>,
    ) -> ChangedInputs {
        let prefix = format!("{}/", archive.name);
        let (found, is_whole) = self.member_hashes(archive, kind, &prefix, noted);
        let of_archive = noted
            .range(prefix.as_str()..)
            .take_while(|(source, _)| source.starts_with(&prefix));
        let is_changed = |(source, hash): &(&&str, &Option<&str>)| {
            found.get(**source).and_then(|hash| hash.as_deref()) != **hash
        };
        let sources = of_archive
            .filter(is_changed)
            .map(|(source, _)| (*source).to_owned());
        let mut changed = ChangedInputs {
            sources: sources.collect(),
            archives: BTreeSet::new(),
        };

        // A line whose source is the archive itself means that the archive is damaged.
        let has_line = self
            .shard
            .is_none_or(|shard| shard.holds(&format!("{}#damage", archive.id)));
        if has_line && is_whole == noted.contains_key(archive.name.as_str()) {
            changed.sources.insert(archive.name.clone());
        }
        if !changed.sources.is_empty() {
            changed.archives.insert(prefix);
        }
        changed
    }

    /// The hashes of the members that have a record, and whether the archive could be read to its end.
    fn member_hashes(
        &self,
        archive: &InputFile,
        kind: ArchiveKind,
        prefix: &str,
        noted: &NotedHashes<'_>,
    ) -> (BTreeMap<String, Option<String>>, bool) {
        let mut hashes = BTreeMap::new();
        let Ok(file) = File::open(&archive.path) else {
            return (hashes, false);
        };
        let source = BufReader::with_capacity(BUFFER_BYTES, file);
        let walked = walk_archive(kind, source, &mut |member| {
            if let Ok((name, content)) = member.content {
                let source = format!("{prefix}{}", name.components().join("/"));
                if noted.contains_key(source.as_str()) && !hashes.contains_key(&source) {
                    let bytes = content.read(self.max_bytes).ok();
                    hashes.insert(
                        source,
                        bytes.and_then(|bytes| hash_of_member(bytes, self.max_bytes)),
                    );
                }
            }
            if self.interrupt.is_set() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        (hashes, walked.is_ok())
    }
}
