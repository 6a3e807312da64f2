//! Loaded shapes ahead of the update that wants them: loader threads, bounded queues, and how long the update waited.
//!
//! Each loader takes every n-th shape of the seeded order and has a queue of its own, which the update reads in turn:
//! the order is that of the seed, whoever is faster.

use anyhow::Result;
use net::{LoadedShape, Loading, TrainError, TrainShape, Training};
use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::Instant;

/// Shapes that each loader may be ahead.
const QUEUE_SHAPES: usize = 4;

/// Which updates are loaded, and by how many threads.
pub(super) struct LoadingPlan<'a> {
    pub(super) loading: Loading,
    pub(super) shapes: &'a [TrainShape],
    /// Updates that are done already.
    pub(super) first_step: usize,
    /// Updates of the whole training.
    pub(super) n_steps: usize,
    /// Loader threads; 0 loads on the threads of the update, when it is due.
    pub(super) n_loaders: usize,
}

/// Where the shapes of the next update come from.
pub(super) struct Batches<'a> {
    plan: &'a LoadingPlan<'a>,
    queues: Vec<Receiver<Result<LoadedShape, TrainError>>>,
    n_taken: usize,
    nanoseconds: &'a AtomicU64,
}

impl Batches<'_> {
    /// The shapes of the update that `training` makes next.
    ///
    /// # Errors
    /// The first that a shape of the batch met with.
    pub(super) fn next(&mut self, training: &Training) -> Result<Vec<LoadedShape>, TrainError> {
        if self.queues.is_empty() {
            let begun = Instant::now();
            let batch = training.load(self.plan.shapes);
            self.nanoseconds.fetch_add(begun.elapsed().as_nanos() as u64, Ordering::Relaxed);
            return batch;
        }
        let n_shapes = training.settings().train.update_shapes();
        (0..n_shapes)
            .map(|_| {
                let queue = &self.queues[self.n_taken % self.queues.len()];
                self.n_taken += 1;
                // A loader ends only after its last shape, or with this program's panic.
                queue.recv().unwrap_or(Err(TrainError::NoShapes))
            })
            .collect()
    }

    /// Seconds of processor time that loading has taken so far; wall time where the system does not count it.
    pub(super) fn loading_seconds(&self) -> f64 {
        self.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9
    }
}

/// Starts the loaders, does the work with what they load, and ends them.
///
/// # Errors
/// Those of the work.
pub(super) fn with_loaders<T>(plan: &LoadingPlan, work: impl FnOnce(Batches) -> Result<T>) -> Result<T> {
    let nanoseconds = AtomicU64::new(0);
    thread::scope(|scope| {
        let mut queues = Vec::new();
        for loader in 0..plan.n_loaders {
            let (sender, receiver) = sync_channel(QUEUE_SHAPES);
            let nanoseconds = &nanoseconds;
            scope.spawn(move || load_all(plan, loader, &sender, nanoseconds));
            queues.push(receiver);
        }
        // The work owns the queues: when it ends, for whatever reason, the loaders find them closed and end too.
        work(Batches { plan, queues, n_taken: 0, nanoseconds: &nanoseconds })
    })
}

/// Loads every n-th shape until the last update or until nobody listens.
fn load_all(
    plan: &LoadingPlan,
    loader: usize,
    queue: &SyncSender<Result<LoadedShape, TrainError>>,
    nanoseconds: &AtomicU64,
) {
    let mut place = 0usize;
    for step in plan.first_step..plan.n_steps {
        for idx in plan.loading.batch(plan.shapes.len(), step) {
            place += 1;
            if (place - 1) % plan.n_loaders != loader {
                continue;
            }
            let begun = ThreadClock::now();
            let loaded = plan.loading.load(&plan.shapes[idx], step);
            nanoseconds.fetch_add(begun.nanoseconds_since(), Ordering::Relaxed);
            if queue.send(loaded).is_err() {
                return;
            }
        }
    }
}

/// The processor time of this thread where Linux tells it, and wall time elsewhere.
struct ThreadClock {
    wall: Instant,
    processor: Option<u64>,
}

impl ThreadClock {
    fn now() -> Self {
        Self { wall: Instant::now(), processor: processor_nanoseconds() }
    }

    fn nanoseconds_since(&self) -> u64 {
        match (self.processor, processor_nanoseconds()) {
            (Some(before), Some(after)) => after.saturating_sub(before),
            _ => self.wall.elapsed().as_nanos() as u64,
        }
    }
}

/// The first number of `schedstat`: nanoseconds on a processor.
fn processor_nanoseconds() -> Option<u64> {
    fs::read_to_string("/proc/thread-self/schedstat").ok()?.split_ascii_whitespace().next()?.parse().ok()
}
