//! Gives a fraction of the faces the label of another part: `step-flipped-<PERCENT>`.
//!
//! The fraction refers to the number of faces, not to their area. A face is wrong or right as a whole.

use crate::degraded::{below, shuffle, step_parts};
use crate::factory::SourceFactory;
use crate::source::SourceLabels;
use partprobe_carrier::{Partition, Rng, ShapeKind, keyed_rng};

/// The faces that are wrong at a lower fraction are wrong in the same way at a higher one.
pub(crate) const STEP_FLIPPED: SourceFactory = SourceFactory::numbered_rule(
    "step-flipped-<PERCENT>",
    "step-parts with PERCENT of the faces in a random other part",
    0..=100,
    |carrier, percent, seed| {
        let mut rng = keyed_rng(seed, &["step-flipped", &carrier.meta().id]);
        let labels = flipped(&step_parts(carrier), percent, &mut rng);
        Ok(SourceLabels::on_partition(
            carrier.mesh(),
            &Partition::from_keys(&labels),
        ))
    },
)
.labeling_faces()
.needing(ShapeKind::Brep);

/// The part of each face after the given fraction of faces was assigned to other parts. A single part does not change.
fn flipped(parts: &Partition, percent: u32, rng: &mut Rng) -> Vec<u32> {
    let n_parts = parts.n_parts() as usize;
    let mut labels = parts.parts().to_vec();
    if n_parts < 2 {
        return labels;
    }

    let mut order: Vec<usize> = (0..labels.len()).collect();
    shuffle(&mut order, rng);
    let n_flipped = (labels.len() * percent as usize + 50) / 100;
    for &face in &order[..n_flipped.min(order.len())] {
        // One of the other parts, all with the same probability.
        let step = 1 + below(rng, n_parts - 1);
        labels[face] = ((labels[face] as usize + step) % n_parts) as u32;
    }
    labels
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_share_of_wrong_faces_is_the_dose(
            keys in proptest::collection::vec(0u8..5, 0..60),
            percent in 0u32..=100,
            seed in 0u64..1000,
        ) {
            let parts = Partition::from_keys(&keys);
            let rng = || keyed_rng(seed, &["test"]);
            let labels = flipped(&parts, percent, &mut rng());
            let wrong = |labels: &[u32]| -> Vec<bool> { labels.iter().zip(parts.parts()).map(|(a, b)| a != b).collect() };
            let n_wrong = wrong(&labels).iter().filter(|&&is_wrong| is_wrong).count();
            let n_expected = if parts.n_parts() < 2 { 0 } else { (keys.len() * percent as usize + 50) / 100 };
            prop_assert_eq!(n_wrong, n_expected);
            prop_assert!(labels.iter().all(|&label| label < parts.n_parts().max(1)));

            // A higher dose keeps the changes of a lower dose.
            let more = flipped(&parts, (percent + 10).min(100), &mut rng());
            for ((&before, &after), is_wrong) in labels.iter().zip(&more).zip(wrong(&labels)) {
                prop_assert!(!is_wrong || before == after);
            }
        }
    }
}
