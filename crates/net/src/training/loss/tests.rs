use super::*;
use partprobe_carrier::{keyed_rng, unit_interval};
use proptest::prelude::*;

const CONFIG: LossConfig = LossConfig {
    pull_weight: 1.0,
    push_weight: 0.7,
    proto_ce_weight: 0.4,
    pull_margin: 0.1,
    push_margin: 0.0,
    temperature: 0.1,
    pull: Pull::Cosine,
    hinge: Hinge::Linear,
    weight: LossWeight::Part,
};

fn random_rows(n: usize, dim: usize, seed: u64) -> Vec<f64> {
    let rng = &mut keyed_rng(seed, &["rows"]);
    (0..n * dim)
        .map(|_| unit_interval(rng) * 2.0 - 0.9)
        .collect()
}

#[track_caller]
fn check_gradient(z: &[f64], dim: usize, labels: &[i32], config: &LossConfig) {
    let loss = cosdisc(z, dim, labels, config).unwrap();
    let numeric: Vec<f64> = (0..z.len())
        .map(|i| {
            let at = |step: f64| {
                let mut moved = z.to_vec();
                moved[i] += step;
                cosdisc(&moved, dim, labels, config).unwrap().terms.total
            };
            (at(1e-6) - at(-1e-6)) / 2e-6
        })
        .collect();
    let off: f64 = loss
        .gradient
        .iter()
        .zip(&numeric)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt();
    let size: f64 = numeric.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert!(
        size > 1e-3 && off <= 1e-5 * size,
        "off by {off:e} of {size:e}"
    );
}

#[test]
fn the_gradient_agrees_with_central_differences() {
    let labels: Vec<i32> = (0..18).map(|i| i % 3).collect();
    check_gradient(&random_rows(18, 6, 1), 6, &labels, &CONFIG);
    for term in 0..3 {
        let weight = |of: usize| if of == term { 1.0 } else { 0.0 };
        let [pull_weight, push_weight, proto_ce_weight] = [weight(0), weight(1), weight(2)];
        let single = LossConfig {
            pull_weight,
            push_weight,
            proto_ce_weight,
            ..CONFIG
        };
        check_gradient(&random_rows(18, 6, 2), 6, &labels, &single);
    }
}

#[test]
fn squared_hinges_and_equal_points_agree_with_central_differences() {
    let labels: Vec<i32> = (0..18).map(|i| i * i % 4).collect();
    for hinge in [Hinge::Linear, Hinge::Squared] {
        for weight in [LossWeight::Part, LossWeight::Point] {
            check_gradient(
                &random_rows(18, 6, 6),
                6,
                &labels,
                &LossConfig {
                    hinge,
                    weight,
                    ..CONFIG
                },
            );
        }
    }
}

#[test]
fn the_chord_agrees_with_central_differences_and_with_its_formula() {
    let labels: Vec<i32> = (0..18).map(|i| i % 3).collect();
    for (hinge, pull_margin) in [(Hinge::Linear, 0.1), (Hinge::Squared, 0.0)] {
        let config = LossConfig {
            pull: Pull::Chord,
            hinge,
            pull_margin,
            ..CONFIG
        };
        check_gradient(&random_rows(18, 6, 9), 6, &labels, &config);
    }

    // The center of part 0 lies between its two tokens, 45° from each; part 1 is its own center.
    let z = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let config = LossConfig {
        pull: Pull::Chord,
        ..CONFIG
    };
    let pull = cosdisc(&z, 3, &[0, 0, 1], &config).unwrap().terms.pull;
    let chord = 2.0 * 22.5f64.to_radians().sin();
    assert!((pull - (chord - 0.1) / 2.0).abs() < 1e-12, "{pull}");
}

#[test]
fn a_squared_hinge_squares_and_equal_points_forget_their_parts() {
    // Part 0 has three tokens, two of them alike; part 1 has one.
    let z = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let loss = |hinge, weight| {
        cosdisc(
            &z,
            3,
            &[0, 0, 0, 1],
            &LossConfig {
                hinge,
                weight,
                ..CONFIG
            },
        )
        .unwrap()
        .terms
    };
    let part = loss(Hinge::Linear, LossWeight::Part);
    let point = loss(Hinge::Linear, LossWeight::Point);
    // The single token has no pull. The sum of the other three has the weight 1/(2·3) in one case and 1/4 in the other.
    assert!(
        (point.pull / part.pull - 1.5).abs() < 1e-12,
        "{part:?} {point:?}"
    );
    let cosines = [2.0, 2.0, 1.0].map(|x: f64| x / 5.0f64.sqrt());
    let squares: f64 = cosines
        .iter()
        .map(|cosine| (0.9 - cosine).max(0.0).powi(2))
        .sum();
    assert!((loss(Hinge::Squared, LossWeight::Part).pull - squares / 6.0).abs() < 1e-12);
}

#[test]
fn single_tokens_ignored_tokens_and_gaps_in_the_labels_are_exact_too() {
    check_gradient(&random_rows(7, 5, 3), 5, &[4, 4, -1, 9, 4, -1, 9], &CONFIG);
    check_gradient(&random_rows(5, 4, 4), 4, &[0, 1, 1, 1, 1], &CONFIG);
}

#[test]
fn inactive_hinges_give_no_gradient() {
    let config = LossConfig {
        proto_ce_weight: 0.0,
        ..CONFIG
    };
    let z = [3.0, 0.1, 2.0, -0.1, -0.1, 1.0, 0.1, 4.0];
    let loss = cosdisc(
        &z,
        2,
        &[0, 0, 1, 1],
        &LossConfig {
            push_margin: 0.5,
            ..config.clone()
        },
    )
    .unwrap();
    assert_eq!(
        (loss.terms.total, loss.terms.pull, loss.terms.push),
        (0.0, 0.0, 0.0)
    );
    assert!(loss.gradient.iter().all(|&g| g == 0.0));
}

#[test]
fn the_terms_have_their_closed_forms() {
    // Two parts along the axes, one token each: the cosine of the centers is 0.
    let loss = cosdisc(
        &[2.0, 0.0, 0.0, 5.0],
        2,
        &[0, 1],
        &LossConfig {
            push_margin: -0.5,
            ..CONFIG
        },
    )
    .unwrap();
    assert_eq!((loss.terms.pull, loss.terms.push), (0.0, 0.5));
    assert!((loss.terms.ce - (1.0 + (-10.0f64).exp()).ln()).abs() < 1e-12);
    assert!((loss.terms.total - (0.7 * 0.5 + 0.4 * loss.terms.ce)).abs() < 1e-12);
}

#[test]
fn one_part_or_none_has_no_loss() {
    let z = random_rows(3, 4, 5);
    assert_eq!(cosdisc(&z, 4, &[2, 2, 2], &CONFIG), None);
    assert_eq!(cosdisc(&z, 4, &[2, -1, -1], &CONFIG), None);
    assert_eq!(cosdisc(&z, 4, &[-1, -1, -1], &CONFIG), None);
}

#[test]
fn opposite_embeddings_and_zeros_stay_finite() {
    let z = [1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let loss = cosdisc(&z, 2, &[0, 0, 1, 1], &CONFIG).unwrap();
    assert!(loss.terms.total.is_finite() && loss.gradient.iter().all(|g| g.is_finite()));
}

proptest! {
    #[test]
    fn names_of_labels_and_lengths_of_rows_do_not_matter(seed: u64, factor in 0.5f64..4.0) {
        let z = random_rows(12, 4, seed);
        let labels: Vec<i32> = (0..12).map(|i| i % 3).collect();
        let base = cosdisc(&z, 4, &labels, &CONFIG).unwrap();
        let renamed: Vec<i32> = labels.iter().map(|label| 70 - 10 * label).collect();
        prop_assert!((cosdisc(&z, 4, &renamed, &CONFIG).unwrap().terms.total - base.terms.total).abs() < 1e-12);
        let longer: Vec<f64> = z.iter().map(|x| x * factor).collect();
        prop_assert!((cosdisc(&longer, 4, &labels, &CONFIG).unwrap().terms.total - base.terms.total).abs() < 1e-12);
    }
}
