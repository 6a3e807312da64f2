//! Queues files for the workers: one thread reads ahead, and waits if the workers are slower.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// The largest number of waiting files.
const MAX_TASKS: usize = 64;
/// The largest number of waiting bytes. A single file may be larger.
const MAX_BYTES: usize = 64 << 20;

/// A file to label.
#[derive(Debug)]
pub(super) struct Task {
    pub(super) id: String,
    /// The file's name in the index.
    pub(super) source: String,
    pub(super) text: TaskText,
}

/// The place of the text of a file.
#[derive(Debug)]
pub(super) enum TaskText {
    /// On disk. The worker reads it.
    Path(PathBuf),
    /// In memory, from an archive.
    Bytes(Vec<u8>),
}

impl Task {
    fn n_bytes(&self) -> usize {
        match &self.text {
            TaskText::Path(_) => 0,
            TaskText::Bytes(bytes) => bytes.len(),
        }
    }
}

/// A queue between one reader and many workers. Its memory is limited.
#[derive(Debug, Default)]
pub(super) struct TaskQueue {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    tasks: VecDeque<Task>,
    n_bytes: usize,
    /// No more tasks will come.
    is_closed: bool,
    /// No more tasks are wanted.
    is_abandoned: bool,
}

impl TaskQueue {
    /// Adds a task as soon as there is room. Returns `false` if no more tasks are wanted.
    pub(super) fn push(&self, task: Task) -> bool {
        let n_bytes = task.n_bytes();
        let has_no_room = |state: &mut State| {
            let is_full = state.tasks.len() >= MAX_TASKS || state.n_bytes + n_bytes > MAX_BYTES;
            !state.is_abandoned && !state.tasks.is_empty() && is_full
        };
        let mut state = self
            .changed
            .wait_while(self.state(), has_no_room)
            .unwrap_or_else(PoisonError::into_inner);
        if state.is_abandoned {
            return false;
        }
        state.n_bytes += n_bytes;
        state.tasks.push_back(task);
        self.changed.notify_all();
        true
    }

    /// The next task, as soon as there is one. Returns `None` at the end.
    pub(super) fn pop(&self) -> Option<Task> {
        let must_wait =
            |state: &mut State| state.tasks.is_empty() && !state.is_closed && !state.is_abandoned;
        let mut state = self
            .changed
            .wait_while(self.state(), must_wait)
            .unwrap_or_else(PoisonError::into_inner);
        let task = state.tasks.pop_front()?;
        state.n_bytes -= task.n_bytes();
        self.changed.notify_all();
        Some(task)
    }

    /// Marks the end of the tasks.
    pub(super) fn close(&self) {
        self.state().is_closed = true;
        self.changed.notify_all();
    }

    /// Drops the waiting tasks, and accepts no further ones.
    pub(super) fn abandon(&self) {
        let mut state = self.state();
        state.is_abandoned = true;
        state.tasks.clear();
        state.n_bytes = 0;
        self.changed.notify_all();
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task(id: usize, n_bytes: usize) -> Task {
        Task {
            id: id.to_string(),
            source: String::new(),
            text: TaskText::Bytes(vec![0; n_bytes]),
        }
    }

    #[test]
    fn tasks_come_in_order_and_the_reader_waits_for_room() {
        let queue = TaskQueue::default();
        let ids = std::thread::scope(|scope| {
            scope.spawn(|| {
                (0..300).for_each(|id| assert!(queue.push(task(id, MAX_BYTES / 3))));
                queue.close();
            });
            std::iter::from_fn(|| queue.pop())
                .map(|task| task.id)
                .collect::<Vec<_>>()
        });
        assert_eq!(ids, (0..300).map(|id| id.to_string()).collect::<Vec<_>>());
        assert_eq!(queue.state().n_bytes, 0);
    }

    #[test]
    fn a_task_larger_than_the_queue_passes_alone_and_an_abandoned_queue_takes_none() {
        let queue = TaskQueue::default();
        assert!(queue.push(task(0, MAX_BYTES + 1)));
        assert!(queue.pop().is_some());
        assert!(queue.push(task(1, 1)));
        queue.abandon();
        assert!(!queue.push(task(2, 1)));
        assert!(queue.pop().is_none());
    }
}
