//! A worker as its supervisor sees it: requests go in, replies or an obituary come out.

use super::frames::{read_frame, write_frame};
use super::source_files::SourceFile;
use super::worker::{Outcome, ReplyHead, Request};
use crate::config::LabelConfig;
use crate::dataset::{IndexEntry, Status};
use anyhow::{Context, Result};
use std::io::Read;
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// A labelled file: the index lines, each with the bytes of its carrier if it has one.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) shapes: Vec<(IndexEntry, Option<Vec<u8>>)>,
    pub(super) seconds: f64,
}

/// Why a file has no carrier.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) status: Status,
    pub(super) reason: String,
    /// The process is gone; the next file needs a new one.
    pub(super) is_fatal: bool,
}

/// A running worker.
pub(super) struct WorkerProcess {
    child: Child,
    requests: ChildStdin,
    replies: Receiver<(ReplyHead, Vec<Vec<u8>>)>,
    watchdog: Duration,
}

impl WorkerProcess {
    /// Starts `program worker` and sends it the settings.
    pub(super) fn start(program: &Path, config: &LabelConfig) -> Result<Self> {
        let mut child = Command::new(program)
            .arg("worker")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // What a dying worker says is in the index; on the terminal it would only disturb.
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("starting a worker, {}", program.display()))?;
        let mut requests = child.stdin.take().context("a worker without an input")?;
        let mut pipe = child.stdout.take().context("a worker without an output")?;
        let (sender, replies) = channel();
        std::thread::spawn(move || forward_replies(&mut pipe, &sender));
        write_frame(&mut requests, &serde_json::to_vec(config)?)?;
        Ok(Self { child, requests, replies, watchdog: Duration::from_secs(config.watchdog_s) })
    }

    /// Labels one file.
    pub(super) fn label(&mut self, file: &SourceFile) -> Result<Reply, Failure> {
        let request = Request { path: file.path.clone(), id: file.id.clone(), name: file.name.clone() };
        let sent = serde_json::to_vec(&request)
            .map_err(anyhow::Error::from)
            .and_then(|request| write_frame(&mut self.requests, &request));
        if sent.is_err() {
            return Err(self.obituary());
        }
        match self.replies.recv_timeout(self.watchdog) {
            Ok((head, carriers)) => reply_from(head, carriers),
            Err(RecvTimeoutError::Disconnected) => Err(self.obituary()),
            Err(RecvTimeoutError::Timeout) => {
                let reason =
                    format!("not done after {} s; raise label.watchdog_s to wait longer", self.watchdog.as_secs());
                Err(Failure { status: Status::TimedOut, reason, is_fatal: true })
            }
        }
    }

    /// What ended the process, in words that are the same on each run.
    fn obituary(&mut self) -> Failure {
        // A pipe that ends belongs to a process that is ending, and the signal changes nothing then;
        // one that only broke the protocol would be waited for without end.
        let _ = self.child.kill();
        let reason = match self.child.wait() {
            Ok(status) => cause_of_death(status),
            Err(error) => error.to_string(),
        };
        Failure { status: Status::Crashed, reason, is_fatal: true }
    }
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // It may have ended by itself, and then there is nothing to kill.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn reply_from(head: ReplyHead, carriers: Vec<Vec<u8>>) -> Result<Reply, Failure> {
    match head.outcome {
        Outcome::Labelled(entries) => {
            let mut carriers = carriers.into_iter();
            let with_carrier = |entry: IndexEntry| {
                let carrier = (entry.status == Status::Ok).then(|| carriers.next()).flatten();
                (entry, carrier)
            };
            Ok(Reply { shapes: entries.into_iter().map(with_carrier).collect(), seconds: head.seconds })
        }
        Outcome::Failed(reason) => Err(Failure { status: Status::Failed, reason, is_fatal: false }),
        Outcome::Panicked(text) => {
            Err(Failure { status: Status::Crashed, reason: format!("a defect of partprobe: {text}"), is_fatal: false })
        }
    }
}

/// Sends whole replies on until the pipe ends or breaks.
fn forward_replies(pipe: &mut impl Read, sender: &Sender<(ReplyHead, Vec<Vec<u8>>)>) {
    while let Ok(Some(reply)) = read_reply(pipe) {
        if sender.send(reply).is_err() {
            return;
        }
    }
}

fn read_reply(pipe: &mut impl Read) -> Result<Option<(ReplyHead, Vec<Vec<u8>>)>> {
    let Some(head) = read_frame(pipe)? else { return Ok(None) };
    let head: ReplyHead = serde_json::from_slice(&head)?;
    let entries = if let Outcome::Labelled(entries) = &head.outcome { entries.as_slice() } else { &[] };
    let n_carriers = entries.iter().filter(|entry| entry.status == Status::Ok).count();
    let carriers = (0..n_carriers).map(|_| read_frame(pipe)?.context("a carrier is missing")).collect::<Result<_>>()?;
    Ok(Some((head, carriers)))
}

#[cfg(unix)]
fn cause_of_death(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.signal() {
        Some(6) => "the worker was aborted: out of memory (raise label.memory_mb) or out of stack".to_owned(),
        Some(signal) => format!("the worker was ended by signal {signal}"),
        None => format!("the worker ended, {status}"),
    }
}

#[cfg(not(unix))]
fn cause_of_death(status: ExitStatus) -> String {
    format!("the worker ended, {status}")
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    /// Runs a shell script in place of a worker, and gives what becomes of a file.
    fn failure_of(script: &str, watchdog_s: u64) -> Failure {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let label = crate::config::load("base", &[]).unwrap().config.label;
        let mut worker = WorkerProcess::start(&program, &LabelConfig { watchdog_s, ..label }).unwrap();
        let file = SourceFile { path: "a.step".into(), id: "a".to_owned(), name: "a.step".to_owned() };
        worker.label(&file).unwrap_err()
    }

    #[track_caller]
    fn check(script: &str, watchdog_s: u64, status: Status, reason: &str) {
        let failure = failure_of(script, watchdog_s);
        assert_eq!(failure.status, status);
        assert!(failure.is_fatal && failure.reason.contains(reason), "{}", failure.reason);
    }

    #[test]
    fn the_end_of_a_worker_is_told() {
        // Each script reads its input first, so that writing to it does not race with its end.
        check("head -c 100 > /dev/null; kill -ABRT $$", 60, Status::Crashed, "out of memory");
        check("head -c 100 > /dev/null; kill -SEGV $$", 60, Status::Crashed, "signal 11");
        check("head -c 100 > /dev/null; exit 3", 60, Status::Crashed, "exit status: 3");
        check("exec cat > /dev/null", 0, Status::TimedOut, "raise label.watchdog_s");
        check("exec cat", 60, Status::Crashed, "");
    }
}
