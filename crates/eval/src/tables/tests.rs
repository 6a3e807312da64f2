use super::*;
use crate::bootstrap::Interval;
use crate::metrics::{ACCURACY, GTC_ACCURACY, GTC_MIOU, MIOU};
use proptest::prelude::*;

pub(crate) fn row(shape: &str, supervision: &str, seed: u64, k: usize, miou: f64) -> ScoreRow {
    let mut scores = BTreeMap::from([(MIOU, miou), (ACCURACY, 0.5 + 0.5 * miou)]);
    if supervision != "no-network" {
        scores.extend([(GTC_ACCURACY, 0.9), (GTC_MIOU, 0.8)]);
    }
    ScoreRow {
        shape: shape.to_owned(),
        supervision: supervision.to_owned(),
        seed,
        reference: "step-parts".to_owned(),
        clusterer: "k-means".to_owned(),
        k,
        scores,
        group: shape.split("__").next().unwrap_or(shape).to_owned(),
    }
}

pub(crate) fn settings() -> TableSettings {
    TableSettings {
        bin_reference: "step-parts".to_owned(),
        clusterer: "k-means".to_owned(),
        compared: vec![["step-parts".to_owned(), "brep-face".to_owned()]],
        primary: Vec::new(),
        seed_deviation: None,
        bootstrap: Bootstrap {
            draws: 200,
            seed: 0,
            least_groups: 2,
        },
        footer: Vec::new(),
    }
}

/// Two seeds, two supervisions and the two untrained rows over shapes in all bins.
pub(crate) fn example() -> Vec<ScoreRow> {
    let mut rows = Vec::new();
    for (n, (shape, k)) in [
        ("a__1", 3),
        ("a__2", 7),
        ("b__1", 12),
        ("c__1", 1),
        ("d__1", 25),
    ]
    .into_iter()
    .enumerate()
    {
        let miou = 0.5 + 0.0625 * n as f64;
        for seed in [0, 1] {
            let bonus = 0.125 * seed as f64;
            rows.push(row(shape, "step-parts", seed, k, miou + bonus));
            rows.push(row(shape, "brep-face", seed, k, miou + bonus - 0.25));
        }
        rows.push(row(shape, "untrained", 0, k, 0.25));
        rows.push(row(shape, "no-network", 0, k, 0.125));
    }
    rows
}

#[test]
fn means_are_over_seeds_then_over_shapes_of_the_papers_bins() {
    let found = tables(&example(), &settings());
    let names: Vec<&str> = found
        .rows
        .iter()
        .map(|row| row.supervision.as_str())
        .collect();
    assert_eq!(
        names,
        ["step-parts", "brep-face", "untrained", "no-network"]
    );
    let first = &found.rows[0];
    assert_eq!((first.n_seeds, first.n_shapes), (2, 3));
    assert!((first.means[&MIOU] - 0.625).abs() < 1e-12);
    assert!((first.miou_deviation.unwrap() - 0.0625).abs() < 1e-12);
    let bins: Vec<(usize, Option<f64>)> = first
        .bins
        .iter()
        .map(|bin| (bin.n_shapes, bin.miou))
        .collect();
    assert_eq!(
        bins,
        [
            (1, Some(0.75)),
            (1, Some(0.5625)),
            (1, Some(0.625)),
            (1, Some(0.6875)),
            (1, Some(0.8125))
        ]
    );
    assert_eq!(
        found.rows[3].means.keys().copied().collect::<Vec<_>>(),
        [MIOU, ACCURACY]
    );
}

#[test]
fn a_constant_difference_has_a_narrow_interval() {
    let found = tables(&example(), &settings());
    let [difference] = &found.differences[..] else {
        panic!("one table, one Δ row")
    };
    assert_eq!((difference.n_shapes, difference.n_groups), (3, 2));
    let miou = difference.differences[&MIOU];
    let interval = Interval {
        low: 0.25,
        high: 0.25,
    };
    assert_eq!((miou.mean, miou.interval), (0.25, Some(interval)));
    assert_eq!((miou.n_seeds, miou.seed_deviation), (2, Some(0.0)));
}

#[test]
fn another_reference_is_binned_by_the_binning_one() {
    let mut rows = example();
    rows.extend(example().into_iter().map(|row| ScoreRow {
        reference: "brep-face".to_owned(),
        k: 30,
        ..row
    }));
    let found = tables(&rows, &settings());
    assert_eq!(found.rows.len(), 8);
    assert_eq!(found.rows[4].n_shapes, 3);
    assert_eq!(found.differences.len(), 2);
    // A shape without a row of the binning reference counts by its own number of parts.
    let alone: Vec<ScoreRow> = rows
        .into_iter()
        .filter(|row| row.reference == "brep-face")
        .collect();
    let found = tables(&alone, &settings());
    assert_eq!(
        (found.rows[0].n_shapes, found.rows[0].bins[4].n_shapes),
        (0, 5)
    );
    assert_eq!(found.rows[0].means, BTreeMap::new());
}

#[test]
fn trainings_of_one_source_are_compared_seed_by_seed() {
    let found = tables(&example(), &settings());
    let names: Vec<&[String; 2]> = found.same_source.iter().map(|row| &row.compared).collect();
    assert_eq!(
        names,
        [
            &[
                "step-parts, seed 0".to_owned(),
                "step-parts, seed 1".to_owned()
            ],
            &[
                "brep-face, seed 0".to_owned(),
                "brep-face, seed 1".to_owned()
            ],
        ]
    );
    // `untrained` and `no-network` have one seed and are not trained.
    assert_eq!(found.same_source[0].differences[&MIOU].mean, -0.125);
}

#[test]
fn the_home_advantage_compares_both_homes() {
    // On `step-parts` the first source wins by 0.25; on `brep-face` its lead is 0.25 − 0.0625 · the index of the shape.
    let mut rows = example();
    let lost = |row: &ScoreRow| {
        let step = ["a__1", "a__2", "b__1"]
            .iter()
            .position(|shape| *shape == row.shape);
        match step {
            Some(idx) if row.supervision == "step-parts" => 0.0625 * idx as f64,
            _ => 0.0,
        }
    };
    rows.extend(example().into_iter().map(|mut row| {
        let miou = row.scores[&MIOU] - lost(&row);
        row.scores.insert(MIOU, miou);
        ScoreRow {
            reference: "brep-face".to_owned(),
            ..row
        }
    }));
    let found = tables(&rows, &settings());
    let [advantage] = &found.home_advantages[..] else {
        panic!("one clusterer, one pair")
    };
    assert_eq!(advantage.compared, ["step-parts", "brep-face"]);
    assert_eq!((advantage.n_shapes, advantage.n_groups), (3, 2));
    // (S − N on S) + (S − N on N), in the mean over the three shapes.
    let expected = 0.25 + (0.25 + 0.1875 + 0.125) / 3.0;
    let miou = advantage.differences[&MIOU];
    assert!((miou.mean - expected).abs() < 1e-12, "{miou:?}");
    assert!(
        miou.interval
            .is_some_and(|interval| interval.low <= expected && expected <= interval.high)
    );
    assert!(
        found
            .to_markdown()
            .contains("| `step-parts`, `brep-face` | +0.438 [")
    );
    assert!(tables(&example(), &settings()).home_advantages.is_empty());
}

#[test]
fn tables_without_rows_are_empty() {
    let found = tables(&[], &settings());
    assert!(found.rows.is_empty() && found.differences.is_empty());
    let one_sided: Vec<ScoreRow> = example()
        .into_iter()
        .filter(|row| row.supervision != "brep-face")
        .collect();
    assert!(tables(&one_sided, &settings()).differences.is_empty());
}

#[test]
fn json_holds_every_number() {
    let json: serde_json::Value =
        serde_json::from_str(&tables(&example(), &settings()).to_json()).unwrap();
    assert_eq!(json["rows"][0]["means"]["miou"], 0.625);
    assert_eq!(json["rows"][0]["bins"][4]["bin"], "20+");
    assert_eq!(
        json["differences"][0]["differences"]["accuracy"]["interval"]["low"],
        0.125
    );
}

proptest! {
    #[test]
    fn the_order_of_rows_does_not_matter(order in Just(example()).prop_shuffle()) {
        prop_assert_eq!(tables(&order, &settings()), tables(&example(), &settings()));
    }
}
