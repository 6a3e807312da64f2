//! Tests laws of the controls of granularity: their number of labels, and that they invent no boundary.
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
            seed: 6,
            min_parts: 3,
            max_parts: 20,
        },
        index,
    );
    let name = format!("part-{index}");
    let file = label(part.step.as_bytes(), &name, &LabelOptions::default()).unwrap();
    let carrier = file.shapes.into_iter().next().unwrap().carrier.unwrap();
    let mut rng = keyed_rng(1, &["test"]);
    let sample = sample_by_area(carrier.mesh(), 2000, NormalKind::Triangle, &mut rng).unwrap();
    (carrier, sample)
}

fn labels(name: &str, (carrier, sample): &(Carrier, PointSample), seed: u64) -> Vec<i32> {
    let labels = source_named(name).unwrap().labels(carrier, seed).unwrap();
    labels.label_of_points(sample).unwrap()
}

fn n_labels(name: &str, carrier: &Carrier) -> u32 {
    let labels = source_named(name).unwrap().labels(carrier, 0).unwrap();
    labels.n_labels()
}

fn distinct<T: Ord>(items: impl Iterator<Item = T>) -> usize {
    items.collect::<BTreeSet<T>>().len()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn a_control_has_the_number_of_its_source(index in 0u64..40, seed in 0u64..1000) {
        let part = part(index);
        for other in ["brep-face", "ward-5", "normal-kmeans-20"] {
            let k = n_labels(other, &part.0);
            for kind in ["merged", "split"] {
                let found = labels(&format!("step-{kind}-to-{other}"), &part, seed);
                prop_assert_eq!(found, labels(&format!("step-{kind}-{k}"), &part, seed));
            }
        }
    }

    #[test]
    fn a_cap_merges_and_invents_no_boundary(index in 0u64..40) {
        let part = part(index);
        let n_parts = part.0.n_parts();
        for other in ["step-parts", "brep-face", "normal-kmeans-20", "ward-20", "step-split-40"] {
            let (own, capped) = (labels(other, &part, 0), labels(&format!("capped-{other}"), &part, 0));
            prop_assert!(distinct(capped.iter()) <= n_parts, "{}", other);
            // Points of one label stay together.
            let pairs = own.iter().zip(&capped);
            prop_assert_eq!(distinct(pairs), distinct(own.iter()), "{}", other);
        }
        let same = distinct(labels("step-parts", &part, 0).into_iter().zip(labels("capped-step-parts", &part, 0)));
        prop_assert_eq!(same, distinct(labels("capped-step-parts", &part, 0).into_iter()));
    }
}
