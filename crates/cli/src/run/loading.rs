//! Loads shapes ahead of the update that needs them: loader threads, bounded queues, and the time that the update waited.
//!
//! Each loader takes every n-th shape of the seeded order and has a queue of its own, which the update reads in turn:
//! the order is that of the seed, whichever loader is faster.

use super::training_shapes::TrainingShapes;
use anyhow::{Context, Result};
use partprobe_net::{Batches, LoadedShape, Loading};
use rayon::prelude::*;
use std::fs;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

/// Batches that all loaders together may be ahead.
const QUEUE_BATCHES: usize = 2;
/// Shapes that a single loader may be ahead, however large a batch is.
const MAX_QUEUE_SHAPES: usize = 64;

/// Which updates are loaded, and by how many threads.
pub(super) struct LoadingPlan<'a> {
    pub(super) loading: Loading,
    pub(super) shapes: &'a TrainingShapes,
    /// Updates that are done already.
    pub(super) first_step: usize,
    /// Updates of the whole training.
    pub(super) n_steps: usize,
    /// Shapes of an update, and of each of the batches that it is made of.
    pub(super) update_shapes: usize,
    pub(super) batch_shapes: usize,
    /// Loader threads; 0 loads on the threads of the update, when it is due.
    pub(super) n_loaders: usize,
}

impl LoadingPlan<'_> {
    /// How many shapes the updates to come want.
    fn n_places(&self) -> usize {
        self.n_steps
            .saturating_sub(self.first_step)
            .saturating_mul(self.update_shapes)
    }

    /// Loads the shape whose turn it is, and adds what that took.
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

/// A shape's turn in the row of all updates to come.
#[derive(Clone, Copy)]
struct Turn {
    idx: usize,
    step: usize,
}

/// Walks along that row; the order of an update is worked out once.
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

    /// Whose turn it is at a place, counted from the first update to come.
    fn turn(&mut self, place: usize) -> Result<Turn> {
        let step = self.plan.first_step + place / self.plan.update_shapes;
        if self.step != Some(step) {
            self.batch = self.plan.loading.batch(self.plan.shapes.n(), step);
            self.step = Some(step);
        }
        let idx = self.batch.get(place % self.plan.update_shapes).copied();
        Ok(Turn {
            idx: idx.context("there is no shape to train on")?,
            step,
        })
    }
}

/// The batches of a training, as the loaders fill them.
pub(super) struct LoadedBatches<'a> {
    plan: &'a LoadingPlan<'a>,
    order: Order<'a>,
    queues: Vec<Receiver<Result<LoadedShape>>>,
    n_taken: usize,
    clocks: &'a LoadingClocks,
}

/// How long loading took, and how long the updates waited for it.
#[derive(Default)]
pub(super) struct LoadingClocks {
    /// Nanoseconds of processor time of all loaders.
    loading: AtomicU64,
    /// Nanoseconds that updates waited for their shapes, since they were last asked for.
    waiting: AtomicU64,
}

impl LoadingClocks {
    /// Seconds of processor time that loading has taken so far; wall time where the system does not count it.
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
    /// The shapes of the next batch, or the first error that one of them met with.
    fn take(&mut self) -> Result<Vec<LoadedShape>> {
        let places = self.n_taken..self.n_taken + self.plan.batch_shapes;
        self.n_taken = places.end;
        if self.queues.is_empty() {
            let turns = places
                .map(|place| self.order.turn(place))
                .collect::<Result<Vec<Turn>>>()?;
            return turns
                .into_par_iter()
                .map(|turn| self.plan.load(turn, &self.clocks.loading))
                .collect();
        }
        // A loader ends only after its last shape, or with this program's panic.
        let take = |place: usize| {
            self.queues[place % self.queues.len()]
                .recv()
                .context("a loader thread has ended")?
        };
        places.map(take).collect()
    }
}

/// Starts the loaders, does the work with what they load, and ends them.
///
/// # Errors
/// Those of the work.
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
        // The work owns the queues: when it ends, for any reason, the loaders find them closed and end too.
        work(LoadedBatches {
            plan,
            order: Order::new(plan),
            queues,
            n_taken: 0,
            clocks,
        })
    })
}

/// Loads every n-th shape until the last update or until nobody listens.
fn load_all(
    plan: &LoadingPlan,
    loader: usize,
    queue: &SyncSender<Result<LoadedShape>>,
    nanoseconds: &AtomicU64,
) {
    let mut order = Order::new(plan);
    for place in (loader..plan.n_places()).step_by(plan.n_loaders) {
        let loaded = order
            .turn(place)
            .and_then(|turn| plan.load(turn, nanoseconds));
        if queue.send(loaded).is_err() {
            return;
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
