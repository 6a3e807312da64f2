//! Takes a fraction of the training shapes, for the points of a learning curve. The other sides do not change.

use super::{SplitCandidate, SplitError, seeded_rank};

/// The fraction of the training shapes that are trained on, and the seed of their choice.
///
/// With one seed, the shapes of a smaller fraction are among those of a larger one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrainShare {
    /// The fraction, above 0 and at most 1.
    pub share: f64,
    /// The seed of the random choice of the shapes.
    pub seed: u64,
}

impl TrainShare {
    /// All training shapes.
    pub const ALL: Self = Self {
        share: 1.0,
        seed: 0,
    };

    /// The reason why a shape beyond the fraction is on no side.
    pub const REASON: &str = "beyond split.train_share";

    /// Removes the shapes beyond the fraction, and returns their ids in the given order. At least one shape is kept.
    ///
    /// # Errors
    /// If the share is not above 0 and at most 1.
    pub(super) fn spare(self, train: &mut Vec<&SplitCandidate>) -> Result<Vec<String>, SplitError> {
        if !(self.share > 0.0 && self.share <= 1.0) {
            return Err(SplitError::TrainShare(self.share));
        }
        let n_kept = (self.share * train.len() as f64).ceil() as usize;
        let mut ranks: Vec<(u64, &str)> = train
            .iter()
            .map(|shape| (seeded_rank(self.seed, &shape.id), shape.id.as_str()))
            .collect();
        ranks.sort_unstable();
        let Some(&first_spared) = ranks.get(n_kept) else {
            return Ok(Vec::new());
        };

        let is_kept = |shape: &&SplitCandidate| {
            (seeded_rank(self.seed, &shape.id), shape.id.as_str()) < first_spared
        };
        let (kept, spared): (Vec<_>, Vec<_>) = std::mem::take(train).into_iter().partition(is_kept);
        *train = kept;
        Ok(spared.into_iter().map(|shape| shape.id.clone()).collect())
    }
}
