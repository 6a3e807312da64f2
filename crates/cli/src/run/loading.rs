//! Loads shapes ahead of the update that needs them: loader threads, bounded queues, and the time that the update waited.
//!
//! Each of n loaders takes every n-th shape of the seeded order and has its own queue. The update reads the queues in turn, so
//! the order is that of the seed, even if one loader is faster than another.

use super::training_shapes::TrainingShapes;
use anyhow::{Context, Result};
use partprobe_net::{Batches, LoadedShape, Loading};
use rayon::prelude::*;
use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// The number of batches that all loaders together may load ahead.
const QUEUE_BATCHES: usize = 2;
/// The largest number of shapes that a single loader may load ahead, for any size of a batch.
const MAX_QUEUE_SHAPES: usize = 64;

/// The updates that are loaded, and the number of loader threads.
pub(super) struct LoadingPlan<'a> {
    pub(super) loading: Loading,
    pub(super) shapes: &'a TrainingShapes,
    /// The number of updates that are already done.
    pub(super) first_step: usize,
    /// The number of updates of the whole training.
    pub(super) n_steps: usize,
    /// The number of shapes of an update, and of each of its batches.
    pub(super) update_shapes: usize,
    pub(super) batch_shapes: usize,
    /// The number of loader threads. With 0, shapes are loaded on the threads of the update when they are needed.
    pub(super) n_loaders: usize,
}

impl LoadingPlan<'_> {
    /// The number of shapes that the remaining updates need.
    fn n_needed_shapes(&self) -> usize {
        self.n_steps
            .saturating_sub(self.first_step)
            .saturating_mul(self.update_shapes)
    }

    /// Loads the shape of a turn, and adds the time that this took.
    fn load(&self, turn: Turn, nanoseconds: &AtomicU64) -> Result<LoadedShape> {
        let begun = ThreadClock::now();
        let loaded = self
            .shapes
            .get(turn.idx)
            .and_then(|shape| Ok(self.loading.load(&shape, turn.step)?));
        nanoseconds.fetch_add(begun.nanoseconds_since(), Ordering::Relaxed);
        loaded
    }
}

/// A shape's turn in the sequence of all remaining updates.
#[derive(Clone, Copy)]
struct Turn {
    idx: usize,
    step: usize,
}

/// Walks along this sequence. The order of each update is computed once.
struct Order<'a> {
    plan: &'a LoadingPlan<'a>,
    step: Option<usize>,
    batch: Vec<usize>,
}

impl<'a> Order<'a> {
    fn new(plan: &'a LoadingPlan<'a>) -> Self {
        Self {
            plan,
            step: None,
            batch: Vec::new(),
        }
    }

    /// The turn at a place, counted from the first remaining update.
    fn turn(&mut self, position: usize) -> Result<Turn> {
        let step = self.plan.first_step + position / self.plan.update_shapes;
        if self.step != Some(step) {
            self.batch = self.plan.loading.batch(self.plan.shapes.n(), step);
            self.step = Some(step);
        }
        let idx = self.batch.get(position % self.plan.update_shapes).copied();
        Ok(Turn {
            idx: idx.context("there is no shape to train on")?,
            step,
        })
    }
}

/// The batches of a training, which the loaders fill.
pub(super) struct LoadedBatches<'a> {
    plan: &'a LoadingPlan<'a>,
    order: Order<'a>,
    queues: Vec<Receiver<Result<LoadedShape>>>,
    n_taken: usize,
    clocks: &'a LoadingClocks,
}

/// The time of loading, and the time that the updates waited for it.
#[derive(Default)]
pub(super) struct LoadingClocks {
    /// Nanoseconds of processor time of all loaders.
    loading: AtomicU64,
    /// Nanoseconds that updates waited for their shapes since the last query.
    waiting: AtomicU64,
}

impl LoadingClocks {
    /// Seconds of processor time that loading has taken so far. It is wall time if the system does not count processor time.
    pub(super) fn loading_seconds(&self) -> f64 {
        self.loading.load(Ordering::Relaxed) as f64 * 1e-9
    }

    /// The time that updates have waited since the last call.
    pub(super) fn take_waiting(&self) -> Duration {
        Duration::from_nanos(self.waiting.swap(0, Ordering::Relaxed))
    }
}

impl Batches for LoadedBatches<'_> {
    type Error = anyhow::Error;

    fn next_batch(&mut self) -> Result<Vec<LoadedShape>> {
        let begun = Instant::now();
        let batch = self.take();
        self.clocks
            .waiting
            .fetch_add(begun.elapsed().as_nanos() as u64, Ordering::Relaxed);
        batch
    }
}

impl LoadedBatches<'_> {
    /// The shapes of the next batch, or the first error of one of them.
    fn take(&mut self) -> Result<Vec<LoadedShape>> {
        let places = self.n_taken..self.n_taken + self.plan.batch_shapes;
        self.n_taken = places.end;
        if self.queues.is_empty() {
            let turns = places
                .map(|position| self.order.turn(position))
                .collect::<Result<Vec<Turn>>>()?;
            return turns
                .into_par_iter()
                .map(|turn| self.plan.load(turn, &self.clocks.loading))
                .collect();
        }
        // A loader ends only after its last shape, or with this program's panic.
        let take = |position: usize| {
            self.queues[position % self.queues.len()]
                .recv()
                .context("a loader thread has ended")?
        };
        places.map(take).collect()
    }
}

/// Starts the loaders, does the work with the loaded shapes, and ends the loaders.
///
/// # Errors
/// The errors of the work.
pub(super) fn with_loaders<T>(
    plan: &LoadingPlan,
    clocks: &LoadingClocks,
    work: impl FnOnce(LoadedBatches) -> Result<T>,
) -> Result<T> {
    let queue_shapes = (QUEUE_BATCHES * plan.batch_shapes)
        .div_ceil(plan.n_loaders.max(1))
        .min(MAX_QUEUE_SHAPES);
    thread::scope(|scope| {
        let mut queues = Vec::new();
        for loader in 0..plan.n_loaders {
            let (sender, receiver) = sync_channel(queue_shapes);
            scope.spawn(move || load_all(plan, loader, &sender, &clocks.loading));
            queues.push(receiver);
        }
        // The work owns the queues. When it ends for any reason, the queues are closed, and the loaders also end.
        work(LoadedBatches {
            plan,
            order: Order::new(plan),
            queues,
            n_taken: 0,
            clocks,
        })
    })
}

/// Loads every n-th shape until the last update or until the queue is closed.
fn load_all(
    plan: &LoadingPlan,
    loader: usize,
    queue: &SyncSender<Result<LoadedShape>>,
    nanoseconds: &AtomicU64,
) {
    let mut order = Order::new(plan);
    for position in (loader..plan.n_needed_shapes()).step_by(plan.n_loaders) {
        let loaded = order
            .turn(position)
            .and_then(|turn| plan.load(turn, nanoseconds));
        if queue.send(loaded).is_err() {
            return;
        }
    }
}

/// The processor time of this thread on Linux, and wall time on other systems.
struct ThreadClock {
    wall: Instant,
    processor: Option<u64>,
}

impl ThreadClock {
    fn now() -> Self {
        Self {
            wall: Instant::now(),
            processor: processor_nanoseconds(),
        }
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
    fs::read_to_string("/proc/thread-self/schedstat")
        .ok()?
        .split_ascii_whitespace()
        .next()?
        .parse()
        .ok()
}
