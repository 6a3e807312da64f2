//! Loaded shapes ahead of the update that wants them: loader threads, bounded queues, and how long the update waited.
//!
//! Each loader takes every n-th shape of the seeded order and has a queue of its own, which the update reads in turn:
//! the order is that of the seed, whoever is faster.

use super::training_shapes::TrainingShapes;
use anyhow::{Context, Result};
use net::{LoadedShape, Loading, Training};
use rayon::prelude::*;
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
    pub(super) shapes: &'a TrainingShapes,
    /// Updates that are done already.
    pub(super) first_step: usize,
    /// Updates of the whole training.
    pub(super) n_steps: usize,
    /// Loader threads; 0 loads on the threads of the update, when it is due.
    pub(super) n_loaders: usize,
}

impl LoadingPlan<'_> {
    /// Loads a shape for an update, and adds what that took.
    fn load(&self, idx: usize, step: usize, nanoseconds: &AtomicU64) -> Result<LoadedShape> {
        let begun = ThreadClock::now();
        let loaded = self.shapes.get(idx).and_then(|shape| Ok(self.loading.load(&shape, step)?));
        nanoseconds.fetch_add(begun.nanoseconds_since(), Ordering::Relaxed);
        loaded
    }
}

/// Where the shapes of the next update come from.
pub(super) struct Batches<'a> {
    plan: &'a LoadingPlan<'a>,
    queues: Vec<Receiver<Result<LoadedShape>>>,
    n_taken: usize,
    nanoseconds: &'a AtomicU64,
}

impl Batches<'_> {
    /// The shapes of the update that `training` makes next.
    ///
    /// # Errors
    /// The first that a shape of the batch met with.
    pub(super) fn next(&mut self, training: &Training) -> Result<Vec<LoadedShape>> {
        if self.queues.is_empty() {
            let step = training.n_steps_done();
            let batch = self.plan.loading.batch(self.plan.shapes.n(), step);
            return batch.into_par_iter().map(|idx| self.plan.load(idx, step, self.nanoseconds)).collect();
        }
        let n_shapes = training.settings().train.update_shapes();
        (0..n_shapes)
            .map(|_| {
                let queue = &self.queues[self.n_taken % self.queues.len()];
                self.n_taken += 1;
                // A loader ends only after its last shape, or with this program's panic.
                queue.recv().context("a loader thread has ended")?
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
fn load_all(plan: &LoadingPlan, loader: usize, queue: &SyncSender<Result<LoadedShape>>, nanoseconds: &AtomicU64) {
    let mut place = 0usize;
    for step in plan.first_step..plan.n_steps {
        for idx in plan.loading.batch(plan.shapes.n(), step) {
            place += 1;
            if (place - 1) % plan.n_loaders != loader {
                continue;
            }
            if queue.send(plan.load(idx, step, nanoseconds)).is_err() {
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
