//! The thread that reads ahead: files and members of archives go into the queue, what is refused goes into the journal.

use super::record::Recorder;
use super::shape_id::id_of;
use super::shard::Shard;
use super::source_files::{SourceFile, has_step_extension};
use super::task_queue::{Task, TaskQueue, TaskText};
use crate::dataset::{IndexEntry, Status};
use crate::interrupt::Interrupt;
use anyhow::Result;
use formats::{ArchiveKind, ContentError, Member, MemberName, Refusal, listed_names, walk_archive};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::BufReader;
use std::ops::ControlFlow;
use std::path::Path;

/// An archive is read in pieces of this size.
const BUFFER_BYTES: usize = 1 << 18;

/// How many files a batch has, as far as the archives' own lists tell.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Expected {
    pub(super) n_files: u64,
    /// An archive without a list may hold more.
    pub(super) has_more: bool,
}

impl Expected {
    /// Counts the files of a share; an archive that cannot be opened counts nothing here.
    pub(super) fn of(files: &[SourceFile], shard: Option<Shard>) -> Self {
        let mut expected = Self::default();
        let is_held = |id: &str| shard.is_none_or(|shard| shard.holds(id));
        for file in files {
            let Some(kind) = file.archive_kind() else {
                expected.n_files += u64::from(is_held(&file.id));
                continue;
            };
            match File::open(&file.path).ok().and_then(|source| listed_names(kind, BufReader::new(source))) {
                Some(names) => expected.n_files += n_held(file, &names, is_held),
                None => expected.has_more = true,
            }
        }
        expected
    }
}

fn n_held(archive: &SourceFile, names: &[String], is_held: impl Fn(&str) -> bool) -> u64 {
    let is_counted = |name: &&String| {
        let components: Vec<String> = name.split('/').map(str::to_owned).collect();
        has_step_extension(Path::new(name)) && is_held(&id_of(&archive.id, &components))
    };
    names.iter().filter(is_counted).count() as u64
}

/// The reader of a batch.
pub(super) struct Feed<'a> {
    pub(super) files: &'a [SourceFile],
    pub(super) shard: Option<Shard>,
    pub(super) max_bytes: u64,
    pub(super) queue: &'a TaskQueue,
    pub(super) recorder: &'a Recorder,
    pub(super) interrupt: &'a Interrupt,
}

/// Hashes of the ids that are taken; a million of them take 30 MB.
struct TakenIds(BTreeSet<[u8; 16]>);

impl TakenIds {
    fn of(files: &[SourceFile]) -> Self {
        let mut taken = Self(BTreeSet::new());
        files.iter().filter(|file| file.archive_kind().is_none()).for_each(|file| {
            taken.take(&file.id);
        });
        taken
    }

    /// Takes an id; says no if it is taken.
    fn take(&mut self, id: &str) -> bool {
        let hash = Sha256::digest(id);
        self.0.insert(*hash.first_chunk().unwrap_or(&[0; 16]))
    }
}

impl Feed<'_> {
    /// Feeds the queue until the files end; says whether they did.
    pub(super) fn run(&self) -> Result<bool> {
        let mut taken = TakenIds::of(self.files);
        for file in self.files {
            if self.interrupt.is_set() {
                return Ok(false);
            }
            let goes_on = match file.archive_kind() {
                Some(kind) => self.feed_archive(file, kind, &mut taken)?,
                None => self.feed_file(file),
            };
            if !goes_on {
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn feed_file(&self, file: &SourceFile) -> bool {
        if !self.is_held(&file.id) || self.recorder.has(&file.name) {
            return true;
        }
        let text = TaskText::Path(file.path.clone());
        self.queue.push(Task { id: file.id.clone(), source: file.name.clone(), text })
    }

    fn feed_archive(&self, archive: &SourceFile, kind: ArchiveKind, taken: &mut TakenIds) -> Result<bool> {
        let source = match File::open(&archive.path) {
            Ok(source) => BufReader::with_capacity(BUFFER_BYTES, source),
            Err(error) => {
                self.record_damage(archive, format!("opening the archive: {error}"))?;
                return Ok(true);
            }
        };
        let mut ended = Ok(true);
        let walked = walk_archive(kind, source, &mut |member| {
            ended = if self.interrupt.is_set() { Ok(false) } else { self.feed_member(archive, member, taken) };
            if matches!(ended, Ok(true)) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        if let (Ok(true), Err(damage)) = (&ended, walked) {
            self.record_damage(archive, damage.to_string())?;
        }
        ended
    }

    fn record_damage(&self, archive: &SourceFile, reason: String) -> Result<()> {
        let id = format!("{}#damage", archive.id);
        if !self.is_held(&id) {
            return Ok(());
        }
        self.recorder.record_without_worker(IndexEntry::without_carrier(&id, &archive.name, Status::Failed, reason))
    }

    /// Queues a member, or notes why not; says whether anybody wants more.
    fn feed_member(&self, archive: &SourceFile, member: Member<'_>, taken: &mut TakenIds) -> Result<bool> {
        let Member { position, given_name, content } = member;
        let (name, content) = match content {
            Ok(usable) => usable,
            Err(refusal) => {
                if has_step_extension(Path::new(&given_name)) || is_about_the_name(&refusal) {
                    self.refuse(archive, position, &given_name, refusal_outcome(&refusal))?;
                }
                return Ok(true);
            }
        };
        if !is_step(&name) {
            return Ok(true);
        }
        let id = id_of(&archive.id, name.components());
        if !taken.take(&id) {
            let reason = format!("another file of the batch has the id `{id}`; label them into two data sets");
            self.refuse(archive, position, &given_name, (Status::Refused, reason))?;
            return Ok(true);
        }
        let source = format!("{}/{}", archive.name, name.components().join("/"));
        if !self.is_held(&id) || self.recorder.has(&source) {
            return Ok(true);
        }
        match content.read(self.max_bytes) {
            Ok(bytes) => Ok(self.queue.push(Task { id, source, text: TaskText::Bytes(bytes) })),
            Err(error) => {
                let (status, reason) = content_outcome(&error);
                self.recorder.record_without_worker(IndexEntry::without_carrier(&id, &source, status, reason))?;
                Ok(true)
            }
        }
    }

    fn refuse(
        &self,
        archive: &SourceFile,
        position: u64,
        given_name: &str,
        (status, reason): (Status, String),
    ) -> Result<()> {
        let member = position + 1;
        let id = format!("{}#{member}", archive.id);
        if !self.is_held(&id) {
            return Ok(());
        }
        // The name is shown as it is, but for what a terminal would obey.
        let shown = given_name.replace(char::is_control, "\u{fffd}");
        let entry = IndexEntry::without_carrier(&id, &format!("{}/{shown}", archive.name), status, reason);
        self.recorder.record_without_worker(IndexEntry { member: Some(member), ..entry })
    }

    fn is_held(&self, id: &str) -> bool {
        self.shard.is_none_or(|shard| shard.holds(id))
    }
}

fn is_step(name: &MemberName) -> bool {
    name.components().last().is_some_and(|last| has_step_extension(Path::new(last)))
}

/// Such members are named whatever they hold.
fn is_about_the_name(refusal: &Refusal) -> bool {
    matches!(refusal, Refusal::UnsafeName(_) | Refusal::Nested)
}

fn refusal_outcome(refusal: &Refusal) -> (Status, String) {
    let status = if *refusal == Refusal::BehindDamage { Status::Failed } else { Status::Refused };
    (status, refusal.to_string())
}

fn content_outcome(error: &ContentError) -> (Status, String) {
    match error {
        ContentError::TooLarge { limit } => (Status::OverBudget, too_large(*limit)),
        ContentError::Damaged(_) => (Status::Failed, error.to_string()),
    }
}

/// What is said of a file with more text than the settings allow.
pub(super) fn too_large(max_bytes: u64) -> String {
    format!("the file has more than {} MiB; raise label.max_file_mb to read it", max_bytes >> 20)
}
