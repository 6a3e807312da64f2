//! Reads ahead in a thread: files and members of archives go into the queue, and refused ones go into the journal.

use super::input_files::{InputFile, InputList};
use super::other_endings::OtherEndings;
use super::over_budget::too_large;
use super::record::Recorder;
use super::released::{NotReleased, ReleasedLabels};
use super::shape_id::{IdForm, SKIPPED_MARK, distinct_forms, id_of};
use super::shard::Shard;
use super::task_queue::{Task, TaskQueue, TaskText};
use super::text_hash::{hash_of_file, hash_of_member};
use crate::interrupt::Interrupt;
use anyhow::Result;
use partprobe_dataset::{IndexEntry, Status};
use partprobe_formats::{
    ArchiveKind, Content, ContentError, Member, Refusal, listed_names, step_stem, walk_archive,
};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;

/// The end of the id of a file that the package does not have.
const REFUSED_MARK: &str = "#refused";
/// An archive is read in pieces of this size.
const BUFFER_BYTES: usize = 1 << 18;

/// The number of files of a batch, according to the lists in the archives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ExpectedFiles {
    pub(super) n_files: u64,
    /// Whether there may be more, because an archive has no list.
    pub(super) has_more: bool,
}

impl ExpectedFiles {
    /// Counts the files of a share. An archive that cannot be opened does not count here.
    pub(super) fn of(sources: &InputList, shard: Option<Shard>) -> Self {
        let is_held = |id: &str| shard.is_none_or(|shard| shard.holds(id));
        let counts = |entry: &&IndexEntry| entry.status != Status::Skipped && is_held(&entry.id);
        let n_failed = sources.unread.iter().filter(counts).count() as u64;
        let mut expected = Self {
            n_files: n_failed,
            has_more: false,
        };
        for file in &sources.files {
            let Some(kind) = file.archive else {
                expected.n_files += u64::from(is_held(&file.id));
                continue;
            };
            match File::open(&file.path)
                .ok()
                .and_then(|source| listed_names(kind, BufReader::new(source)))
            {
                Some(names) => expected.n_files += n_members_in_share(file, &names, is_held),
                None => expected.has_more = true,
            }
        }
        expected
    }
}

/// The number of STEP members in a share. It uses the shortest ids, also for members whose ids must be longer.
fn n_members_in_share(
    archive: &InputFile,
    names: &[String],
    is_held: impl Fn(&str) -> bool,
) -> u64 {
    let steps = names.iter().filter(|name| is_step(name));
    steps
        .filter(|name| is_held(&id_of(&member_components(archive, name), IdForm::Stem)))
        .count() as u64
}

/// The components of a member's id.
fn member_components(archive: &InputFile, name: &str) -> Vec<String> {
    let parts = name
        .split('/')
        .filter(|part| !part.is_empty() && *part != ".");
    std::iter::once(archive.id.as_str())
        .chain(parts)
        .map(str::to_owned)
        .collect()
}

/// The reader of a batch.
pub(super) struct Producer<'a> {
    pub(super) sources: &'a InputList,
    pub(super) shard: Option<Shard>,
    pub(super) max_bytes: u64,
    pub(super) queue: &'a TaskQueue,
    pub(super) recorder: &'a Recorder,
    pub(super) interrupt: &'a Interrupt,
    pub(super) released: Option<&'a ReleasedLabels>,
}

/// Hashes of ids. A million of them need 30 MB.
#[derive(Default)]
struct IdSet(BTreeSet<[u8; 16]>);

impl IdSet {
    /// The ids of the files that are not archives.
    fn of(files: &[InputFile]) -> Self {
        let mut ids = Self::default();
        files
            .iter()
            .filter(|file| file.archive.is_none())
            .for_each(|file| {
                ids.insert(&file.id);
            });
        ids
    }

    /// Adds an id. Returns `false` if it already exists.
    fn insert(&mut self, id: &str) -> bool {
        let hash = Sha256::digest(id);
        self.0.insert(*hash.first_chunk().unwrap_or(&[0; 16]))
    }
}

/// The state of an archive while it is walked.
struct Walking<'a> {
    archive: &'a InputFile,
    /// Members of the archive's list whose ids must be longer than the shortest.
    longer_ids: BTreeMap<String, IdForm>,
    /// Names of the members so far.
    names: IdSet,
    /// Members that are not STEP.
    other_endings: OtherEndings,
}

impl<'a> Walking<'a> {
    fn of(archive: &'a InputFile, kind: ArchiveKind) -> Self {
        let names = File::open(&archive.path)
            .ok()
            .and_then(|file| listed_names(kind, BufReader::new(file)));
        let names: Vec<String> = names
            .into_iter()
            .flatten()
            .filter(|name| is_step(name))
            .collect();
        let components: Vec<Vec<String>> = names
            .iter()
            .map(|name| member_components(archive, name))
            .collect();
        let forms = distinct_forms(&components, vec![IdForm::Stem; names.len()], |_| 0);
        let usable_names = components.iter().map(|parts| parts[1..].join("/"));
        let mut longer_ids: BTreeMap<String, IdForm> = usable_names.zip(forms).collect();
        longer_ids.retain(|_, form| *form != IdForm::Stem);
        Self {
            archive,
            longer_ids,
            names: IdSet::default(),
            other_endings: OtherEndings::default(),
        }
    }

    /// The shortest id of a member that no other source has. It is marked as taken.
    fn take_id(&self, name: &str, taken: &mut IdSet) -> Option<String> {
        let components = member_components(self.archive, name);
        let shortest = self.longer_ids.get(name).copied().unwrap_or(IdForm::Stem);
        let forms = [IdForm::Stem, IdForm::Whole, IdForm::Hashed]
            .into_iter()
            .filter(|&form| form >= shortest);
        forms
            .map(|form| id_of(&components, form))
            .find(|id| taken.insert(id))
    }
}

impl Producer<'_> {
    /// Fills the queue until the files end. Returns whether they did.
    pub(super) fn run(&self) -> Result<bool> {
        let mut taken = IdSet::of(&self.sources.files);
        for entry in &self.sources.unread {
            self.record_unread(entry.clone())?;
        }
        for file in &self.sources.files {
            if self.interrupt.is_set() {
                return Ok(false);
            }
            let goes_on = match file.archive {
                Some(kind) => self.feed_archive(file, kind, &mut taken)?,
                None => self.feed_file(file)?,
            };
            if !goes_on {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn feed_file(&self, file: &InputFile) -> Result<bool> {
        let hash = || hash_of_file(&file.path, self.max_bytes);
        let Some(id) = self.released_id(&file.id, &file.name, hash)? else {
            return Ok(true);
        };
        if !self.is_held(&id) || self.recorder.has(&file.name) {
            return Ok(true);
        }
        let text = TaskText::Path(file.path.clone());
        Ok(self.queue.push(Task {
            id,
            source: file.name.clone(),
            text,
        }))
    }

    /// The id of a file: that of the package, if the batch has one. Returns `None` if the package does not have the file, which
    /// is recorded then.
    ///
    /// Files are given to the package in the order of the inputs, including those that an earlier call has finished, so a resumed
    /// batch gives the same ids.
    fn released_id(
        &self,
        own_id: &str,
        source: &str,
        hash: impl FnOnce() -> Option<String>,
    ) -> Result<Option<String>> {
        let Some(released) = self.released else {
            return Ok(Some(own_id.to_owned()));
        };
        // A file that cannot be read goes to a worker, which reports the reason.
        let Some(sha256) = hash() else {
            return Ok(Some(own_id.to_owned()));
        };
        let reason = match released.take(&sha256, source) {
            Ok(id) => return Ok(Some(id)),
            Err(NotReleased::Unknown) => {
                format!("the package has no file with this SHA-256: {sha256}")
            }
            Err(NotReleased::Repeated) => {
                "the package has this file, and it was given more often than the package has it"
                    .to_owned()
            }
        };
        let id = format!("{own_id}{REFUSED_MARK}");
        let entry = IndexEntry::without_carrier(&id, source, Status::Refused, reason);
        self.record_unread(IndexEntry {
            sha256: Some(sha256),
            ..entry
        })?;
        Ok(None)
    }

    fn feed_archive(
        &self,
        archive: &InputFile,
        kind: ArchiveKind,
        taken: &mut IdSet,
    ) -> Result<bool> {
        let source = match File::open(&archive.path) {
            Ok(source) => BufReader::with_capacity(BUFFER_BYTES, source),
            Err(error) => {
                self.record_damage(archive, format!("opening the archive: {error}"))?;
                return Ok(true);
            }
        };
        let mut walking = Walking::of(archive, kind);
        let mut ended = Ok(true);
        let walked = walk_archive(kind, source, &mut |member| {
            ended = if self.interrupt.is_set() {
                Ok(false)
            } else {
                self.feed_member(&mut walking, member, taken)
            };
            if matches!(ended, Ok(true)) {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        });
        if let (Ok(true), Err(damage)) = (&ended, walked) {
            self.record_damage(archive, damage.to_string())?;
        }
        if matches!(ended, Ok(true)) {
            self.record_other_endings(walking)?;
        }
        ended
    }

    /// Records the members of an archive that are not STEP.
    fn record_other_endings(&self, walking: Walking<'_>) -> Result<()> {
        let archive = walking.archive;
        for (pattern, line) in walking.other_endings.into_lines() {
            let id = format!("{}__{pattern}{SKIPPED_MARK}", archive.id);
            self.record_unread(line.entry(&id, &format!("{}/{pattern}", archive.name)))?;
        }
        Ok(())
    }

    fn record_unread(&self, entry: IndexEntry) -> Result<()> {
        if self.is_held(&entry.id) && !self.recorder.has(&entry.source) {
            self.recorder.record_without_worker(entry)?;
        }
        Ok(())
    }

    fn record_damage(&self, archive: &InputFile, reason: String) -> Result<()> {
        let id = format!("{}#damage", archive.id);
        if !self.is_held(&id) {
            return Ok(());
        }
        self.recorder
            .record_without_worker(IndexEntry::without_carrier(
                &id,
                &archive.name,
                Status::Failed,
                reason,
            ))
    }

    /// Queues a member, or records why not. Returns whether more members are wanted.
    fn feed_member(
        &self,
        walking: &mut Walking<'_>,
        member: Member<'_>,
        taken: &mut IdSet,
    ) -> Result<bool> {
        let archive = walking.archive;
        let Member {
            position,
            given_name,
            content,
        } = member;
        let (name, content) = match content {
            Ok(usable) => usable,
            Err(refusal) => {
                if is_step(&given_name) || concerns_name(&refusal) {
                    self.refuse(archive, position, &given_name, refusal_outcome(&refusal))?;
                } else {
                    walking.other_endings.add(&given_name);
                }
                return Ok(true);
            }
        };
        let name = name.components().join("/");
        if !is_step(&name) {
            walking.other_endings.add(&name);
            return Ok(true);
        }
        let is_first = walking.names.insert(&name);
        let Some(id) = is_first.then(|| walking.take_id(&name, taken)).flatten() else {
            let reason =
                "another member of the archive has the same name, so it is not clear which one is meant".to_owned();
            self.refuse(archive, position, &given_name, (Status::Refused, reason))?;
            return Ok(true);
        };
        let source = format!("{}/{name}", archive.name);
        self.feed_content(&id, &source, content)
    }

    /// Queues the content of a member, or records why not. Returns whether more members are wanted.
    fn feed_content(&self, id: &str, source: &str, content: Content<'_>) -> Result<bool> {
        // The package must process a member even if it is done.
        let is_done = self.recorder.has(source);
        if !self.is_held(id) || (is_done && self.released.is_none()) {
            return Ok(true);
        }
        match content.read(self.max_bytes) {
            Ok(bytes) => {
                let hash = || hash_of_member(bytes.clone(), self.max_bytes);
                let id = self.released_id(id, source, hash)?;
                let Some(id) = id.filter(|_| !is_done) else {
                    return Ok(true);
                };
                Ok(self.queue.push(Task {
                    id,
                    source: source.to_owned(),
                    text: TaskText::Bytes(bytes),
                }))
            }
            Err(_) if is_done => Ok(true),
            Err(error) => {
                let (status, reason) = content_outcome(&error);
                self.recorder
                    .record_without_worker(IndexEntry::without_carrier(
                        id, source, status, reason,
                    ))?;
                Ok(true)
            }
        }
    }

    fn refuse(
        &self,
        archive: &InputFile,
        position: u64,
        given_name: &str,
        (status, reason): (Status, String),
    ) -> Result<()> {
        let member = position + 1;
        let id = format!("{}#{member}", archive.id);
        if !self.is_held(&id) {
            return Ok(());
        }
        // The name is shown without changes, except for control characters.
        let shown = given_name.replace(char::is_control, "\u{fffd}");
        let entry =
            IndexEntry::without_carrier(&id, &format!("{}/{shown}", archive.name), status, reason);
        self.recorder.record_without_worker(IndexEntry {
            member: Some(member),
            ..entry
        })
    }

    fn is_held(&self, id: &str) -> bool {
        self.shard.is_none_or(|shard| shard.holds(id))
    }
}

/// Whether the last component of a member's name has an ending of STEP.
fn is_step(name: &str) -> bool {
    name.rsplit('/')
        .next()
        .is_some_and(|last| step_stem(last).is_some())
}

/// Whether a refusal is about the name. Such members are reported for any content.
fn concerns_name(refusal: &Refusal) -> bool {
    matches!(refusal, Refusal::UnsafeName(_) | Refusal::Nested)
}

fn refusal_outcome(refusal: &Refusal) -> (Status, String) {
    let status = if *refusal == Refusal::BehindDamage {
        Status::Failed
    } else {
        Status::Refused
    };
    (status, refusal.to_string())
}

fn content_outcome(error: &ContentError) -> (Status, String) {
    match error {
        ContentError::TooLarge { limit } => (Status::OverBudget, too_large(*limit)),
        ContentError::Damaged(_) => (Status::Failed, error.to_string()),
    }
}
