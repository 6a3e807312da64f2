//! Defines the source of the batches of a training, which the caller supplies.

use super::LoadedShape;

/// Where the shapes of the next batch come from.
pub trait Batches {
    /// Why there is no batch.
    type Error;

    /// The next `train.batch_shapes` shapes of the seeded order. It is called `train.accumulate` times per update.
    ///
    /// # Errors
    /// If a shape of the batch cannot be loaded.
    fn next_batch(&mut self) -> Result<Vec<LoadedShape>, Self::Error>;
}
