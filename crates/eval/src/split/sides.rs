//! Chooses the collections that are held out, so that each K bin gets its fraction.

use super::collections::{Collection, CountOfBin};
use partprobe_carrier::keyed_rng;
use rand::Rng as _;

/// The index of a side: 0 train, 1 valid, 2 test.
pub(super) type Side = usize;

pub(super) const TRAIN: Side = 0;
pub(super) const VALID: Side = 1;
pub(super) const TEST: Side = 2;

/// A held-out side takes collections of at most this fraction of its target first, so that it gets many collections.
const SMALL: f64 = 0.1;

/// The side of each collection. Test shapes are chosen first, then validation shapes. The rest is for training.
///
/// `fractions` are of train, valid and test, and their sum is 1.
pub(super) fn place_collections(
    mut collections: Vec<Collection<'_>>,
    fractions: [f64; 3],
    seed: u64,
) -> Vec<(Side, Collection<'_>)> {
    shuffle(&mut collections, seed);
    let all = sum(collections.iter().map(Collection::count_of_bin));
    let rest = (TRAIN..=TEST).find(|&side| fractions[side] > 0.0);
    let rest = rest.unwrap_or(TRAIN);

    let mut placed = Vec::with_capacity(collections.len());
    for side in [TEST, VALID] {
        if side == rest || fractions[side] == 0.0 {
            continue;
        }
        // The later sides get at least one collection each. If there are too few, validation gets none.
        let n_later = (TRAIN..side)
            .filter(|&later| fractions[later] > 0.0)
            .count();
        let n_later = n_later.min(collections.len().saturating_sub(1)).max(1);
        let target = all.map(|count| count * fractions[side]);
        let taken = Chooser::new(target, n_later).choose(&mut collections);
        placed.extend(taken.into_iter().map(|collection| (side, collection)));
    }
    placed.extend(collections.into_iter().map(|collection| (rest, collection)));
    placed
}

/// Takes collections until the counts of all bins are near their targets.
struct Chooser<'a> {
    /// The number of shapes of each bin that the side should get.
    target: CountOfBin,
    /// The number of shapes of each bin that it has.
    count: CountOfBin,
    /// The number of collections that must be left.
    n_later: usize,
    taken: Vec<Collection<'a>>,
}

impl<'a> Chooser<'a> {
    fn new(target: CountOfBin, n_later: usize) -> Self {
        Self {
            target,
            count: CountOfBin::default(),
            n_later,
            taken: Vec::new(),
        }
    }

    /// Takes small collections first, then larger ones by their size if bins still lack shapes. Takes at least one.
    fn choose(mut self, collections: &mut Vec<Collection<'a>>) -> Vec<Collection<'a>> {
        let small = (SMALL * self.target.iter().sum::<f64>()).max(1.0);
        for largest in [small, f64::INFINITY] {
            if largest > small {
                // The sort is stable, so collections of equal size keep their random order.
                collections.sort_by_key(|collection| collection.shapes.len());
            }
            let mut left = Vec::with_capacity(collections.len());
            let mut n_left = collections.len();
            for collection in collections.drain(..) {
                let is_small = collection.shapes.len() as f64 <= largest;
                if is_small && n_left > self.n_later && self.gain(&collection) > 0.0 {
                    self.take(collection);
                    n_left -= 1;
                } else {
                    left.push(collection);
                }
            }
            *collections = left;
        }
        if self.taken.is_empty() && collections.len() > self.n_later {
            let best = self.best(collections);
            self.take(collections.remove(best));
        }
        self.taken
    }

    fn take(&mut self, collection: Collection<'a>) {
        self.count = sum([self.count, collection.count_of_bin()].into_iter());
        self.taken.push(collection);
    }

    /// The amount by which a collection brings the counts nearer to their targets, as a sum of squares.
    fn gain(&self, collection: &Collection<'_>) -> f64 {
        let added = collection.count_of_bin();
        (0..added.len())
            .map(|bin| added[bin] * (2.0 * (self.target[bin] - self.count[bin]) - added[bin]))
            .sum()
    }

    /// The index of the collection that brings the counts nearest to their targets. If several are equal, it is the first one.
    fn best(&self, collections: &[Collection<'_>]) -> usize {
        let mut best = 0;
        for (idx, collection) in collections.iter().enumerate() {
            if self.gain(collection) > self.gain(&collections[best]) {
                best = idx;
            }
        }
        best
    }
}

fn sum(counts: impl Iterator<Item = CountOfBin>) -> CountOfBin {
    counts.fold(CountOfBin::default(), |sum, counts| {
        std::array::from_fn(|bin| sum[bin] + counts[bin])
    })
}

/// Puts the collections in a random order that depends only on the seed (Fisher and Yates).
fn shuffle<T>(collections: &mut [T], seed: u64) {
    let mut rng = keyed_rng(seed, &["split"]);
    for last in (1..collections.len()).rev() {
        let other = (u128::from(rng.next_u64()) * (last as u128 + 1)) >> 64;
        collections.swap(last, other as usize);
    }
}
