//! Defines the source of the batches of a training, and the simplest one: shapes that are all in memory.

use super::{LoadedShape, Loading, TrainError, TrainShape, Training};

/// A source of batches.
pub trait Batches {
    /// The error if a batch cannot be made.
    type Error;

    /// The next `train.batch_shapes` shapes of the seeded order. It is called `train.accumulate` times per update.
    ///
    /// # Errors
    /// If a shape of the batch cannot be loaded.
    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, Self::Error>;
}

/// The batches of shapes that are all in memory. Each shape is prepared when its batch is requested.
///
/// [`Training::batches_of`] makes them.
#[derive(Clone, Debug)]
pub struct MemoryBatches<'a> {
    shapes: &'a [TrainShape],
    loading: Loading,
    /// The number of batches that were taken since the first update of the training.
    n_taken: usize,
}

impl Training {
    /// The batches of these shapes, beginning with the next update.
    ///
    /// `shapes` must be the same in each run of the program, because the seeded order refers to their indices.
    #[must_use]
    pub fn batches_of<'a>(&self, shapes: &'a [TrainShape]) -> MemoryBatches<'a> {
        let loading = self.loading();
        let n_taken = self.n_steps_done() * loading.settings.train.accumulate;
        MemoryBatches {
            shapes,
            loading,
            n_taken,
        }
    }
}

impl Batches for MemoryBatches<'_> {
    type Error = TrainError;

    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, TrainError> {
        let train = &self.loading.settings.train;
        let step = self.n_taken / train.accumulate;
        let of_update = self.n_taken % train.accumulate;
        self.n_taken += 1;

        let update = self.loading.batch(self.shapes.len(), step);
        let mut batches = update.chunks(train.batch_shapes);
        let batch = batches.nth(of_update).unwrap_or_default();
        batch
            .iter()
            .map(|&idx| self.loading.load(&self.shapes[idx], step))
            .collect()
    }
}
