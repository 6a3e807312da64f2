//! Chooses the shapes of an update: one seeded permutation of all shapes per epoch.

use partprobe_carrier::keyed_rng;
use rand::Rng as _;

/// The indices of the shapes of the batch with index `step`.
///
/// In each epoch, each shape comes once, in an order that depends only on the seed and the epoch.
pub(crate) fn batch(seed: u64, n_shapes: usize, batch_shapes: usize, step: usize) -> Vec<usize> {
    let first = step * batch_shapes;
    let (mut epoch, mut order) = (usize::MAX, Vec::new());
    (first..first + batch_shapes)
        .map(|position| {
            if position / n_shapes != epoch {
                epoch = position / n_shapes;
                order = permutation(seed, epoch, n_shapes);
            }
            order[position % n_shapes]
        })
        .collect()
}

fn permutation(seed: u64, epoch: usize, n: usize) -> Vec<usize> {
    let rng = &mut keyed_rng(seed, &["shape order", &epoch.to_string()]);
    let mut order: Vec<usize> = (0..n).collect();
    for last in (1..n).rev() {
        order.swap(last, (rng.next_u64() % (last as u64 + 1)) as usize);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_epoch_holds_each_shape_once(seed: u64, n_shapes in 1usize..20, batch_shapes in 1usize..7, epoch in 0usize..4) {
            let n_steps = ((epoch + 1) * n_shapes).div_ceil(batch_shapes);
            let stream: Vec<usize> = (0..n_steps).flat_map(|step| batch(seed, n_shapes, batch_shapes, step)).collect();
            let mut one = stream[epoch * n_shapes..][..n_shapes].to_vec();
            one.sort_unstable();
            prop_assert_eq!(one, (0..n_shapes).collect::<Vec<_>>());
        }
    }

    #[test]
    fn epochs_and_seeds_differ() {
        assert_ne!(permutation(0, 0, 50), permutation(0, 1, 50));
        assert_ne!(permutation(0, 0, 50), permutation(1, 0, 50));
    }
}
