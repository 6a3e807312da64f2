//! Runs a worker for its supervisor: requests go in, and replies or the end of the process come out.

use super::frames::{read_frame, write_frame};
use super::over_budget::OVER_MEMORY;
use super::path_text::path_bytes;
use super::protocol::{
    EmittedFile, Follows, Outcome, ReplyHead, ReplyShape, Request, WorkerSettings,
};
use super::task_queue::{Task, TaskText};
use anyhow::{Context, Result};
use partprobe_dataset::{IndexEntry, Status};
use std::io::{BufReader, Read};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// The number of bytes of a reply that are read at once. It is the capacity of a pipe in Linux.
const REPLY_BUFFER_BYTES: usize = 1 << 16;

/// A labeled file: the index lines, each with the files that were emitted for it.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) shapes: Vec<(IndexEntry, Vec<EmittedFile>)>,
    pub(super) seconds: f64,
}

/// The reason why a file has no carrier.
#[derive(Debug)]
pub(super) struct Failure {
    pub(super) status: Status,
    pub(super) reason: String,
    /// Whether the process has ended, so the next file needs a new one.
    pub(super) is_fatal: bool,
}

/// A running worker.
pub(super) struct WorkerProcess {
    child: Child,
    requests: ChildStdin,
    replies: Receiver<(ReplyHead, Vec<Vec<u8>>)>,
    /// Gives the end of what the worker wrote to stderr, once it has ended.
    stderr_tail: Option<JoinHandle<String>>,
    watchdog: Duration,
}

impl WorkerProcess {
    /// Starts `program worker` and sends it the settings.
    pub(super) fn start(program: &Path, settings: &WorkerSettings) -> Result<Self> {
        let mut child = Command::new(program)
            .arg("worker")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            // The output of a dying worker distinguishes memory from stack errors. On the terminal, it would only confuse.
            .stderr(Stdio::piped())
            .spawn()
            .with_context(|| format!("starting a worker, {}", program.display()))?;
        let mut requests = child.stdin.take().context("a worker without an input")?;
        let pipe = child.stdout.take().context("a worker without an output")?;
        let mut errors = child
            .stderr
            .take()
            .context("a worker without an error output")?;
        let (sender, replies) = channel();
        let mut pipe = BufReader::with_capacity(REPLY_BUFFER_BYTES, pipe);
        std::thread::spawn(move || forward_replies(&mut pipe, &sender));
        let stderr_tail = Some(std::thread::spawn(move || stderr_tail_of(&mut errors)));
        write_frame(&mut requests, &serde_json::to_vec(settings)?)?;
        let watchdog = Duration::from_secs(settings.label.watchdog_s);
        Ok(Self {
            child,
            requests,
            replies,
            stderr_tail,
            watchdog,
        })
    }

    /// Labels one file.
    pub(super) fn label(&mut self, task: &Task) -> Result<Reply, Failure> {
        if self.send(task).is_err() {
            return Err(self.exit_failure());
        }
        match self.replies.recv_timeout(self.watchdog) {
            Ok((head, carriers)) => reply_from(head, carriers),
            Err(RecvTimeoutError::Disconnected) => Err(self.exit_failure()),
            Err(RecvTimeoutError::Timeout) => {
                let reason = format!(
                    "not done after {} s; raise label.watchdog_s to wait longer",
                    self.watchdog.as_secs()
                );
                Err(Failure {
                    status: Status::TimedOut,
                    reason,
                    is_fatal: true,
                })
            }
        }
    }

    fn send(&mut self, task: &Task) -> Result<()> {
        let follows = match &task.text {
            TaskText::Path(_) => Follows::Path,
            TaskText::Bytes(_) => Follows::Bytes,
        };
        let request = Request {
            follows,
            id: task.id.clone(),
            source: task.source.clone(),
        };
        write_frame(&mut self.requests, &serde_json::to_vec(&request)?)?;
        match &task.text {
            TaskText::Path(path) => write_frame(&mut self.requests, &path_bytes(path)),
            TaskText::Bytes(bytes) => write_frame(&mut self.requests, bytes),
        }
    }

    /// The reason why the process ended, in words that are the same in each run.
    fn exit_failure(&mut self) -> Failure {
        // If the pipe has ended, the process is ending, and the signal has no effect. But a process that only broke the protocol
        // must be killed, because waiting for it would never end.
        let _ = self.child.kill();
        let ended = self.child.wait();
        let stderr_tail = self
            .stderr_tail
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default();
        let (status, reason) = match ended {
            Ok(_)
                if OUT_OF_MEMORY
                    .iter()
                    .any(|words| stderr_tail.contains(words)) =>
            {
                (Status::OverBudget, OVER_MEMORY.to_owned())
            }
            Ok(status) => (Status::Crashed, describe_exit(status)),
            Err(error) => (Status::Crashed, error.to_string()),
        };
        Failure {
            status,
            reason,
            is_fatal: true,
        }
    }
}

/// The messages of the standard library for a failed allocation, in code that aborts and in code that returns an error.
const OUT_OF_MEMORY: [&str; 2] = ["memory allocation of", "out of memory"];
/// The number of last bytes of a worker's stderr that are kept.
const MAX_STDERR_TAIL: usize = 4096;

/// The end of what a worker writes to stderr.
fn stderr_tail_of(errors: &mut impl Read) -> String {
    let (mut kept, mut piece) = (Vec::new(), [0; 1024]);
    while let Ok(n_read) = errors.read(&mut piece)
        && n_read > 0
    {
        kept.extend_from_slice(&piece[..n_read]);
        let surplus = kept.len().saturating_sub(MAX_STDERR_TAIL);
        kept.drain(..surplus);
    }
    String::from_utf8_lossy(&kept).into_owned()
}

impl Drop for WorkerProcess {
    fn drop(&mut self) {
        // The process may have ended by itself. Then there is nothing to kill.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn reply_from(head: ReplyHead, files: Vec<Vec<u8>>) -> Result<Reply, Failure> {
    let failure = |status, reason| {
        Err(Failure {
            status,
            reason,
            is_fatal: false,
        })
    };
    match head.outcome {
        Outcome::Labeled(shapes) => {
            let mut files = files.into_iter();
            let with_files = |ReplyShape { entry, emits }| {
                let emitted = emits
                    .into_iter()
                    .zip(files.by_ref())
                    .map(|(emit, bytes)| EmittedFile { emit, bytes });
                (entry, emitted.collect())
            };
            Ok(Reply {
                shapes: shapes.into_iter().map(with_files).collect(),
                seconds: head.seconds,
            })
        }
        Outcome::Failed(reason) => failure(Status::Failed, reason),
        Outcome::OverBudget(reason) => failure(Status::OverBudget, reason),
        Outcome::Panicked(text) => {
            failure(Status::Crashed, format!("a defect of partprobe: {text}"))
        }
    }
}

/// Forwards complete replies until the pipe ends or breaks.
fn forward_replies(pipe: &mut impl Read, sender: &Sender<(ReplyHead, Vec<Vec<u8>>)>) {
    while let Ok(Some(reply)) = read_reply(pipe) {
        if sender.send(reply).is_err() {
            return;
        }
    }
}

fn read_reply(pipe: &mut impl Read) -> Result<Option<(ReplyHead, Vec<Vec<u8>>)>> {
    let Some(head) = read_frame(pipe)? else {
        return Ok(None);
    };
    let head: ReplyHead = serde_json::from_slice(&head)?;
    let shapes = if let Outcome::Labeled(shapes) = &head.outcome {
        shapes.as_slice()
    } else {
        &[]
    };
    let n_files: usize = shapes.iter().map(|shape| shape.emits.len()).sum();
    let files = (0..n_files)
        .map(|_| read_frame(pipe)?.context("a file is missing"))
        .collect::<Result<_>>()?;
    Ok(Some((head, files)))
}

#[cfg(unix)]
fn describe_exit(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match status.signal() {
        Some(6) => "the worker was aborted, for example out of stack".to_owned(),
        Some(signal) => format!("the worker was ended by signal {signal}"),
        None => format!("the worker ended, {status}"),
    }
}

#[cfg(not(unix))]
fn describe_exit(status: ExitStatus) -> String {
    format!("the worker ended, {status}")
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::LabelConfig;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    /// Runs a shell script instead of a worker, and returns the failure of a file.
    fn failure_of(script: &str, watchdog_s: u64) -> Failure {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        let config = crate::config::load("base", &[]).unwrap().config;
        let label = LabelConfig {
            watchdog_s,
            ..config.label
        };
        let mut worker = WorkerProcess::start(
            &program,
            &WorkerSettings {
                label,
                sample: config.sample,
            },
        )
        .unwrap();
        let text = TaskText::Path("a.step".into());
        worker
            .label(&Task {
                id: "a".to_owned(),
                source: "a.step".to_owned(),
                text,
            })
            .unwrap_err()
    }

    #[track_caller]
    fn check(script: &str, watchdog_s: u64, status: Status, reason: &str) {
        let failure = failure_of(script, watchdog_s);
        assert_eq!(failure.status, status);
        assert!(
            failure.is_fatal && failure.reason.contains(reason),
            "{}",
            failure.reason
        );
    }

    #[test]
    fn the_end_of_a_worker_is_described() {
        // Each script reads its input first. So it does not end while the test writes to it.
        check(
            "head -c 100 > /dev/null; kill -ABRT $$",
            60,
            Status::Crashed,
            "out of stack",
        );
        let failing =
            "head -c 100 > /dev/null; echo memory allocation of 9 bytes failed >&2; kill -ABRT $$";
        check(failing, 60, Status::OverBudget, "label.memory_mb");
        check(
            "head -c 100 > /dev/null; kill -SEGV $$",
            60,
            Status::Crashed,
            "signal 11",
        );
        check(
            "head -c 100 > /dev/null; exit 3",
            60,
            Status::Crashed,
            "exit status: 3",
        );
        check(
            "exec sleep 60",
            0,
            Status::TimedOut,
            "raise label.watchdog_s",
        );
        check("exec cat", 60, Status::Crashed, "");
    }
}
