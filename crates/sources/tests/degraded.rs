//! Tests laws of the degraded sources: the bound holds, the same seed gives the same labels, and agreement with
//! `step-parts` falls as the dose rises.
#![allow(
    clippy::unwrap_used,
    reason = "a test that cannot label its own part has failed"
)]

use partprobe_carrier::{Carrier, NormalKind, PointSample, keyed_rng, sample_by_area};
use partprobe_label::{LabelOptions, label};
use partprobe_sources::source_named;
use proptest::prelude::*;
use std::collections::BTreeSet;

fn part(index: u64) -> (Carrier, PointSample) {
    let part = partprobe_synth::part(
        &partprobe_synth::SynthSettings {
            seed: 5,
            min_parts: 4,
            max_parts: 20,
        },
        index,
    );
    let file = label(
        part.step.as_bytes(),
        &format!("part-{index}"),
        &LabelOptions::default(),
    )
    .unwrap();
    let carrier = file.shapes.into_iter().next().unwrap().carrier.unwrap();
    let mut rng = keyed_rng(1, &["test"]);
    let sample = sample_by_area(carrier.mesh(), 2000, NormalKind::Triangle, &mut rng).unwrap();
    (carrier, sample)
}

fn labels(name: &str, (carrier, sample): &(Carrier, PointSample), seed: u64) -> Vec<i32> {
    source_named(name)
        .unwrap()
        .labels(carrier, seed)
        .unwrap()
        .label_of_points(sample)
        .unwrap()
}

fn n_distinct(labels: &[i32]) -> usize {
    labels.iter().collect::<BTreeSet<_>>().len()
}

/// The fraction of points that have the same label in both lists.
fn equal_share(a: &[i32], b: &[i32]) -> f64 {
    a.iter().zip(b).filter(|(a, b)| a == b).count() as f64 / a.len() as f64
}

/// The Rand index: the fraction of pairs of points for which two labelings agree whether they belong together.
fn rand_index(a: &[i32], b: &[i32]) -> f64 {
    let pairs = (0..a.len()).flat_map(|i| (0..i).map(move |j| (a[i] == a[j]) == (b[i] == b[j])));
    let (agree, all) = pairs.fold((0u32, 0u32), |(agree, all), is_equal| {
        (agree + u32::from(is_equal), all + 1)
    });
    f64::from(agree) / f64::from(all)
}

/// Whether the agreement does not rise from one dose to the next.
fn falls(agreements: &[f64]) -> bool {
    agreements.windows(2).all(|pair| pair[1] <= pair[0])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn merging_keeps_the_bound_and_agreement_falls(index in 0u64..40, seed in 0u64..1000) {
        let part = part(index);
        let truth = labels("step-parts", &part, seed);
        let at = |k: usize| labels(&format!("step-merged-{k}"), &part, seed);
        let n_parts = part.0.n_parts();
        for k in [1, 2, 5, 12, 1000] {
            let merged = at(k);
            prop_assert!(n_distinct(&merged) <= k.min(n_parts));
            prop_assert_eq!(&merged, &at(k));
            // Points of one part stay together.
            let pairs: BTreeSet<(i32, i32)> = truth.iter().copied().zip(merged).collect();
            prop_assert_eq!(pairs.len(), n_distinct(&truth));
        }
        let doses = [1000, n_parts / 2, n_parts / 4, 1].map(|k| rand_index(&truth, &at(k.max(1))));
        prop_assert!(falls(&doses) && doses[0] == 1.0 && doses[3] < 1.0, "{:?}", doses);
    }

    #[test]
    fn merging_a_share_is_merging_to_a_number(index in 0u64..40, seed in 0u64..1000, percent in 0u32..=100) {
        let part = part(index);
        let by_share = format!("step-merged-share-{percent}");
        let source = source_named(&by_share).unwrap();
        let n_left = source.labels(&part.0, seed).unwrap().n_labels();
        let by_number = format!("step-merged-{n_left}");
        prop_assert_eq!(labels(&by_share, &part, seed), labels(&by_number, &part, seed));
        let doses = [0, 20, 50, 100].map(|percent| {
            let merged = labels(&format!("step-merged-share-{percent}"), &part, seed);
            rand_index(&labels("step-parts", &part, seed), &merged)
        });
        prop_assert!(falls(&doses) && doses[0] == 1.0 && doses[3] < 1.0, "{:?}", doses);
    }

    #[test]
    fn splitting_keeps_the_bound_and_agreement_falls(index in 0u64..40, seed in 0u64..1000) {
        let part = part(index);
        let truth = labels("step-parts", &part, seed);
        let at = |k: usize| labels(&format!("step-split-{k}"), &part, seed);
        let n_parts = part.0.n_parts();
        for k in [1, n_parts, n_parts + 1, n_parts + 9, 60] {
            let split = at(k);
            prop_assert!(n_distinct(&split) <= k.max(n_parts));
            prop_assert!(split.iter().all(|&label| 0 <= label && (label as usize) < k.max(n_parts)));
            prop_assert_eq!(&split, &at(k));
            // A piece lies in one part.
            let pairs: BTreeSet<(i32, i32)> = truth.iter().copied().zip(split.iter().copied()).collect();
            prop_assert_eq!(pairs.len(), n_distinct(&split));
        }
        prop_assert!(n_distinct(&at(n_parts + 9)) > n_distinct(&truth));
        let doses = [n_parts, n_parts + 2, n_parts + 10, n_parts + 40].map(|k| rand_index(&truth, &at(k)));
        prop_assert!(falls(&doses) && doses[0] == 1.0 && doses[3] < 1.0, "{:?}", doses);
    }

    #[test]
    fn agreement_falls_as_boundaries_move_further(index in 0u64..40, seed in 0u64..1000) {
        let part = part(index);
        let truth = labels("step-parts", &part, seed);
        let at = |permille: u32| labels(&format!("step-jittered-{permille}"), &part, seed);
        prop_assert_eq!(&at(50), &at(50));
        let n_parts = part.0.n_parts() as i32;
        prop_assert!(at(50).iter().all(|label| (0..n_parts).contains(label)));
        let doses = [0, 5, 20, 50, 200].map(|permille| equal_share(&truth, &at(permille)));
        prop_assert!(falls(&doses) && doses[0] == 1.0 && doses[4] < 1.0, "{:?}", doses);
    }

    #[test]
    fn agreement_falls_as_more_faces_are_wrong(index in 0u64..40, seed in 0u64..1000) {
        let part = part(index);
        let at = |percent: u32| labels(&format!("step-flipped-{percent}"), &part, seed);
        prop_assert_eq!(&at(30), &at(30));
        prop_assert!(n_distinct(&at(60)) <= part.0.n_parts());
        prop_assert_eq!(rand_index(&labels("step-parts", &part, seed), &at(0)), 1.0);
        // One seed may swap two whole parts, which changes no pair of points.
        let truth = labels("step-parts", &part, seed);
        let others = (seed..seed + 8).map(|seed| labels("step-flipped-50", &part, seed));
        prop_assert!(others.map(|wrong| rand_index(&truth, &wrong)).any(|agreement| agreement < 1.0));
    }
}

#[test]
fn another_seed_gives_other_labels() {
    let part = part(0);
    for name in [
        "step-merged-2",
        "step-split-60",
        "step-flipped-50",
        "step-jittered-50",
    ] {
        let distinct: BTreeSet<Vec<i32>> = (0..8).map(|seed| labels(name, &part, seed)).collect();
        assert!(distinct.len() > 1, "{name}");
    }
}
