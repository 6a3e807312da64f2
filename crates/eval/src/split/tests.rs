use super::*;
use partprobe_carrier::ShapeKind;
use proptest::prelude::*;

const FRACTIONS: SplitFractions = SplitFractions {
    train: 0.7,
    valid: 0.1,
    test: 0.2,
};

/// A shape in a family of its own number, whose large face has this fraction of the area.
fn candidate(
    id: &str,
    file: &str,
    product: Option<&str>,
    family: usize,
    fraction: f64,
) -> SplitCandidate {
    let signature = Signature {
        type_histogram: [0; 11],
        n_edges: family,
        relative_areas: vec![fraction, 1.0 - fraction],
        form: None,
        kind: ShapeKind::Brep,
    };
    SplitCandidate {
        id: id.to_owned(),
        source_file: file.to_owned(),
        product: product.map(str::to_owned),
        signature,
    }
}

fn unrelated(n: usize) -> Vec<SplitCandidate> {
    (0..n)
        .map(|n| candidate(&format!("{n:04}"), &format!("f{n}"), None, n, 0.5))
        .collect()
}

#[test]
fn unrelated_shapes_meet_the_fractions() {
    let found = split(&unrelated(1000), &FRACTIONS, 3).unwrap();
    assert_eq!(
        [found.train.len(), found.valid.len(), found.test.len()],
        [700, 100, 200]
    );
    assert_ne!(
        found.test,
        split(&unrelated(1000), &FRACTIONS, 4).unwrap().test
    );
}

#[test]
fn no_side_stays_empty_and_a_fraction_of_0_gets_nothing() {
    let found = split(&unrelated(3), &FRACTIONS, 0).unwrap();
    assert_eq!(
        [found.train.len(), found.valid.len(), found.test.len()],
        [1, 1, 1]
    );
    let found = split(
        &unrelated(9),
        &SplitFractions {
            valid: 0.0,
            ..FRACTIONS
        },
        0,
    )
    .unwrap();
    assert_eq!(
        [found.train.len(), found.valid.len(), found.test.len()],
        [7, 0, 2]
    );
    assert_eq!(split(&[], &FRACTIONS, 0), Ok(Split::default()));
}

#[test]
fn twins_count_once_and_relatives_stay_together() {
    let shapes = [
        candidate("b", "f1", None, 1, 0.6),
        candidate("a", "f2", None, 1, 0.6005),
        candidate("c", "f3", Some("bolt"), 1, 0.8),
        candidate("d", "f4", Some("bolt"), 2, 0.5),
        candidate("e", "f4", None, 3, 0.5),
        candidate("f", "f5", None, 4, 0.5),
    ];
    let found = split(&shapes, &FRACTIONS, 0).unwrap();
    assert_eq!(
        found.duplicates,
        [Duplicate {
            id: "b".to_owned(),
            of: "a".to_owned()
        }]
    );
    let groups: Vec<(&str, &str)> = found
        .groups
        .iter()
        .map(|(id, group)| (id.as_str(), group.as_str()))
        .collect();
    assert_eq!(
        groups,
        [("a", "a"), ("c", "a"), ("d", "a"), ("e", "a"), ("f", "f")]
    );
}

#[test]
fn an_equal_shape_is_told_by_the_one_that_came_first() {
    let mut distinct = DistinctShapes::default();
    let mut add = |id: &str, family, fraction| {
        let shape = candidate(id, "f", None, family, fraction);
        distinct
            .add(id, &shape.signature)
            .map(|duplicate| duplicate.of)
    };
    assert_eq!(add("c", 1, 0.6), None);
    assert_eq!(add("a", 1, 0.6005), Some("c".to_owned()));
    // Not added, so that nothing is compared with it.
    assert_eq!(add("b", 1, 0.6015), None);
    assert_eq!(add("d", 2, 0.6), None);
}

#[test]
fn a_rank_is_of_the_seed_and_the_id() {
    assert_eq!(seeded_rank(1, "a"), seeded_rank(1, "a"));
    assert_ne!(seeded_rank(1, "a"), seeded_rank(2, "a"));
    assert_ne!(seeded_rank(1, "a"), seeded_rank(1, "b"));
}

#[test]
fn fractions_that_divide_nothing_are_refused() {
    for train in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(split(&[], &SplitFractions { train, ..FRACTIONS }, 0).is_err());
    }
    let nothing = SplitFractions {
        train: 0.0,
        valid: 0.0,
        test: 0.0,
    };
    assert!(
        split(&[], &nothing, 0)
            .unwrap_err()
            .to_string()
            .contains("one must be positive")
    );
}

fn any_shapes() -> impl Strategy<Value = Vec<SplitCandidate>> {
    let shape = (
        0usize..30,
        0usize..40,
        proptest::option::of(0usize..40),
        2u32..8,
    );
    proptest::collection::vec(shape, 0..60).prop_map(|shapes| {
        let named = |(n, (family, file, product, fraction)): (
            usize,
            (usize, usize, Option<usize>, u32),
        )| {
            let product = product.map(|product| format!("p{product}"));
            candidate(
                &format!("{n:03}"),
                &format!("f{file}"),
                product.as_deref(),
                family,
                f64::from(fraction) / 10.0,
            )
        };
        shapes.into_iter().enumerate().map(named).collect()
    })
}

proptest! {
    #[test]
    fn every_shape_is_on_one_side_and_no_tie_crosses(shapes in any_shapes(), seed in 0u64..5) {
        let found = split(&shapes, &FRACTIONS, seed).unwrap();
        let sides = [&found.train, &found.valid, &found.test];
        let mut all: Vec<&String> = sides.into_iter().flatten().chain(found.duplicates.iter().map(|twin| &twin.id)).collect();
        all.sort();
        prop_assert_eq!(all, shapes.iter().map(|shape| &shape.id).collect::<Vec<_>>());
        let side_of = |id: &String| sides.iter().position(|side| side.contains(id));
        for a in &shapes {
            for b in &shapes {
                let related = a.signature.family() == b.signature.family()
                    || a.source_file == b.source_file
                    || (a.product.is_some() && a.product == b.product);
                if let (true, Some(x), Some(y)) = (related, side_of(&a.id), side_of(&b.id)) {
                    prop_assert_eq!(x, y);
                    prop_assert_eq!(&found.groups[&a.id], &found.groups[&b.id]);
                }
            }
        }
    }

    #[test]
    fn the_order_of_shapes_does_not_matter(shapes in any_shapes()) {
        let backward: Vec<SplitCandidate> = shapes.iter().rev().cloned().collect();
        prop_assert_eq!(split(&shapes, &FRACTIONS, 1), split(&backward, &FRACTIONS, 1));
    }
}
