use super::*;
use crate::KBin;
use partprobe_carrier::{Mesh, ShapeKind};
use proptest::prelude::*;
use std::sync::LazyLock;

const RULE: SplitRule = SplitRule {
    fractions: SplitFractions {
        train: 0.7,
        valid: 0.1,
        test: 0.2,
    },
    near_difference: 0.03,
    train_share: TrainShare::ALL,
    seed: 0,
};

/// A shape of its own family with `n_parts` parts. Its surface is a triangle with this side.
fn candidate(id: &str, collection: &str, n_parts: usize, side: f64) -> SplitCandidate {
    SplitCandidate {
        id: id.to_owned(),
        collection: collection.to_owned(),
        n_parts,
        signature: signature(id, 0.5),
        descriptor: triangle(side),
    }
}

/// The descriptor of a triangle with a right angle, of which one side is 1 and the other one is given.
fn triangle(side: f64) -> Option<Descriptor> {
    Descriptor::of(&Mesh {
        vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, side, 0.0]],
        vertex_face: vec![0; 3],
        triangles: vec![[0, 1, 2]],
        tri_face: vec![0],
        vertex_normal: Vec::new(),
    })
}

/// Signatures of one family are equal if this fraction of the area is equal.
fn signature(family: &str, fraction: f64) -> Signature {
    Signature {
        type_histogram: [0; 11],
        n_edges: family
            .bytes()
            .fold(7, |sum, byte| sum * 31 + usize::from(byte)),
        relative_areas: vec![fraction, 1.0 - fraction],
        form: None,
        kind: ShapeKind::Brep,
    }
}

/// Shapes that have nothing in common, each in its own collection: long triangles, each 1.3 times as long as the previous one.
fn unrelated(n: usize) -> Vec<SplitCandidate> {
    (0..n)
        .map(|n| SplitCandidate {
            descriptor: None,
            ..candidate(&format!("{n:04}"), &format!("f{n}"), 2 + n % 18, 1.0)
        })
        .collect()
}

fn sizes(found: &Split) -> [usize; 3] {
    [found.train.len(), found.valid.len(), found.test.len()]
}

#[test]
fn unrelated_shapes_meet_the_fractions_in_each_bin() {
    let shapes = unrelated(1800);
    let found = split(&shapes, &RULE).unwrap();
    assert_eq!(sizes(&found), [1260, 180, 360]);
    let bin_of = |id: &String| {
        let shape = shapes.iter().find(|shape| shape.id == *id).unwrap();
        KBin::of(shape.n_parts)
    };
    for (bin, n) in [
        (KBin::K2To4, 300),
        (KBin::K5To9, 500),
        (KBin::K10To19, 1000),
    ] {
        let n_of_bin = |ids: &[String]| ids.iter().filter(|id| bin_of(id) == bin).count();
        assert_eq!(
            [n_of_bin(&found.valid), n_of_bin(&found.test)],
            [n / 10, n / 5]
        );
    }
    let other = split(&shapes, &SplitRule { seed: 4, ..RULE }).unwrap();
    assert_ne!(found.test, other.test);
}

#[test]
fn no_side_stays_empty_and_a_fraction_of_0_gets_nothing() {
    let fractions = |train, valid, test| SplitRule {
        fractions: SplitFractions { train, valid, test },
        ..RULE
    };
    for (n, rule, expected) in [
        (3, RULE, [1, 1, 1]),
        (2, RULE, [1, 0, 1]),
        (1, RULE, [1, 0, 0]),
        (0, RULE, [0, 0, 0]),
        (9, fractions(0.7, 0.0, 0.2), [7, 0, 2]),
        (4, fractions(0.0, 0.0, 1.0), [0, 0, 4]),
        (4, fractions(1.0, 0.0, 0.0), [4, 0, 0]),
    ] {
        let shapes: Vec<_> = unrelated(n)
            .into_iter()
            .map(|shape| SplitCandidate {
                n_parts: 3,
                ..shape
            })
            .collect();
        assert_eq!(
            sizes(&split(&shapes, &rule).unwrap()),
            expected,
            "{n} shapes"
        );
    }
}

#[test]
fn a_large_collection_is_not_held_out_if_small_ones_suffice() {
    let mut shapes = unrelated(60);
    for shape in &mut shapes[..30] {
        shape.collection = "large".to_owned();
    }
    for seed in 0..20 {
        let found = split(&shapes, &SplitRule { seed, ..RULE }).unwrap();
        assert!(found.train.contains(&"0000".to_owned()), "seed {seed}");
        assert!((10..=14).contains(&found.test.len()), "seed {seed}");
    }
}

#[test]
fn equal_shapes_count_once_and_collections_stay_together() {
    let mut shapes = vec![
        candidate("b", "f1", 3, 1.0),
        candidate("a", "f2", 3, 1.0),
        candidate("c", "f3", 3, 2.0),
        candidate("d", "f3", 3, 4.0),
        candidate("e", "f4", 3, 8.0),
    ];
    shapes[0].signature = signature("twin", 0.6);
    shapes[1].signature = signature("twin", 0.6005);
    let found = split(&shapes, &RULE).unwrap();
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
    assert_eq!(groups, [("a", "a"), ("c", "c"), ("d", "c"), ("e", "e")]);
}

#[test]
fn shapes_that_are_nearly_equal_to_a_held_out_one_are_removed() {
    // Two of each form, in other collections.
    let shapes: Vec<_> = (0..20)
        .map(|n| {
            let side = 1.4f64.powi(n / 2) * (1.0 + 0.004 * f64::from(n % 2));
            candidate(&format!("{n:02}"), &format!("f{n}"), 3, side)
        })
        .collect();
    let found = split(&shapes, &RULE).unwrap();
    assert_eq!(found.test.len(), 4);
    assert!(found.near.len() >= 2, "{:?}", found.near);
    let of = |id: &String| shapes.iter().find(|shape| shape.id == *id).unwrap();
    let difference = |a: &String, b: &String| {
        let [a, b] = [a, b].map(|id| of(id).descriptor.as_ref().unwrap());
        a.difference(b)
    };
    for near in &found.near {
        assert!(found.test.contains(&near.of) || found.valid.contains(&near.of));
        assert_eq!(near.difference, difference(&near.id, &near.of));
        assert!(near.difference <= RULE.near_difference);
    }
    for held_out in &found.test {
        for other in found.train.iter().chain(&found.valid) {
            assert!(difference(held_out, other) > RULE.near_difference);
        }
    }
    for nearest in &found.nearest_training {
        assert!(found.test.contains(&nearest.id) && found.train.contains(&nearest.of));
        assert!(nearest.difference > RULE.near_difference);
    }
    assert_eq!(found.nearest_training.len(), found.test.len());

    let all = split(
        &shapes,
        &SplitRule {
            near_difference: 0.0,
            ..RULE
        },
    );
    assert_eq!(all.unwrap().near, []);
}

#[test]
fn a_manifest_decides_the_sides() {
    let key = |number: u64| ShapeKey {
        source_sha256: format!("{number:064x}"),
        solid_step_id: Some(number),
    };
    let shapes: Vec<_> = (0..6)
        .map(|n| {
            (
                key(n),
                candidate(&format!("{n}"), &format!("f{n}"), 3, 1.0 + n as f64),
            )
        })
        .collect();
    let sides = [SideName::Train, SideName::Test, SideName::Valid];
    let lines = (0..5).map(|n| ManifestLine {
        key: key(n),
        side: sides[n as usize % 3],
        id: format!("other-{n}"),
        n_parts: 3,
    });
    let text = Manifest::of(lines).to_json_lines();
    let manifest = Manifest::from_json_lines(&text).unwrap();
    assert_eq!(manifest.to_json_lines(), text);

    let found = split_by_manifest(&shapes, &manifest, TrainShare::ALL).unwrap();
    assert_eq!(found.train, ["0", "3"]);
    assert_eq!(found.test, ["1", "4"]);
    assert_eq!(found.valid, ["2"]);
    assert_eq!(found.group_of("5"), None);

    let half = TrainShare {
        share: 0.5,
        seed: 0,
    };
    let fewer = split_by_manifest(&shapes, &manifest, half).unwrap();
    assert_eq!((fewer.train.len(), fewer.spared.len()), (1, 1));
    assert_eq!((fewer.valid, fewer.test), (found.valid, found.test));
}

#[test]
fn a_share_of_the_training_shapes_does_not_change_the_other_sides() {
    let shapes = unrelated(60);
    let with = |share| {
        let rule = SplitRule {
            train_share: TrainShare { share, seed: 3 },
            ..RULE
        };
        split(&shapes, &rule).unwrap()
    };
    let whole = with(1.0);
    assert!(whole.spared.is_empty());

    let mut larger = whole.clone();
    for (share, n) in [(0.5, 21), (0.25, 11), (0.001, 1)] {
        let found = with(share);
        assert_eq!(found.train.len(), n);
        assert_eq!((&found.valid, &found.test), (&whole.valid, &whole.test));
        assert!(found.train.iter().all(|id| larger.train.contains(id)));
        assert!(found.spared.iter().all(|id| found.group_of(id).is_none()));

        let mut all = [found.train.clone(), found.spared.clone()].concat();
        all.sort_unstable();
        assert_eq!(all, whole.train);
        larger = found;
    }
}

#[test]
fn a_damaged_manifest_is_refused_with_its_line() {
    let line = |side: &str, key: &str| {
        format!("{{\"side\":\"{side}\",\"source_sha256\":\"{key}\",\"solid_step_id\":null}}\n")
    };
    let train = line("train", "a");
    for (text, expected) in [
        (train.clone() + "{", "line 2: "),
        (line("left", "a"), "line 1: unknown variant"),
        ("{\"side\":\"train\"}".to_owned(), "line 1: missing field"),
        (train.clone() + "\n" + &line("test", "a"), "line 3 puts"),
    ] {
        let error = Manifest::from_json_lines(&text).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    let twice = Manifest::from_json_lines(&(train.clone() + &train)).unwrap();
    assert_eq!(twice.lines().count(), 1);
}

#[test]
fn an_equal_shape_is_reported_with_the_first_of_them() {
    let mut distinct = DistinctShapes::default();
    let mut add = |id: &str, family, fraction| {
        distinct
            .add(id, &signature(family, fraction))
            .map(|duplicate| duplicate.of)
    };
    assert_eq!(add("c", "1", 0.6), None);
    assert_eq!(add("a", "1", 0.6005), Some("c".to_owned()));
    // The shape was not added, so nothing is compared with it.
    assert_eq!(add("b", "1", 0.6015), None);
    assert_eq!(add("d", "2", 0.6), None);
}

#[test]
fn a_rank_is_of_the_seed_and_the_id() {
    assert_eq!(seeded_rank(1, "a"), seeded_rank(1, "a"));
    assert_ne!(seeded_rank(1, "a"), seeded_rank(2, "a"));
    assert_ne!(seeded_rank(1, "a"), seeded_rank(1, "b"));
}

#[test]
fn a_rule_that_divides_nothing_is_refused() {
    let refusal = |rule: SplitRule| split(&[], &rule).unwrap_err().to_string();
    let with = |train, valid, test| SplitRule {
        fractions: SplitFractions { train, valid, test },
        ..RULE
    };
    for train in [-0.1, f64::NAN, f64::INFINITY] {
        assert!(refusal(with(train, 0.1, 0.2)).contains("fractions of a split"));
    }
    assert!(refusal(with(0.0, 0.0, 0.0)).contains("one must be positive"));
    for near_difference in [-0.1, f64::NAN] {
        let refused = refusal(SplitRule {
            near_difference,
            ..RULE
        });
        assert!(refused.contains("split.near_difference"), "{refused}");
    }
    for share in [0.0, -0.5, 1.01, f64::NAN] {
        let refused = refusal(SplitRule {
            train_share: TrainShare { share, seed: 0 },
            ..RULE
        });
        assert!(refused.contains("split.train_share"), "{refused}");
    }
}

/// Descriptors take longer than all else in a test, so the properties share these.
static TRIANGLES: LazyLock<Vec<Option<Descriptor>>> =
    LazyLock::new(|| (0..60).map(|n| triangle(1.05f64.powi(n))).collect());

fn any_shapes() -> impl Strategy<Value = Vec<SplitCandidate>> {
    let shape = (0usize..30, 0usize..40, 1usize..25, 0usize..60);
    proptest::collection::vec(shape, 0..60).prop_map(|shapes| {
        let named = |(n, (family, file, n_parts, side)): (usize, (usize, usize, usize, usize))| {
            SplitCandidate {
                id: format!("{n:03}"),
                collection: format!("f{file}"),
                n_parts,
                signature: signature(&family.to_string(), 0.5),
                descriptor: TRIANGLES[side].clone(),
            }
        };
        shapes.into_iter().enumerate().map(named).collect()
    })
}

proptest! {
    #[test]
    fn every_shape_is_on_one_side_or_left_out_and_no_collection_is_divided(
        shapes in any_shapes(), seed in 0u64..5,
    ) {
        let found = split(&shapes, &SplitRule { seed, ..RULE }).unwrap();
        let sides = [&found.train, &found.valid, &found.test];
        let mut all: Vec<&String> = sides
            .into_iter()
            .flatten()
            .chain(found.duplicates.iter().map(|twin| &twin.id))
            .chain(found.near.iter().map(|near| &near.id))
            .collect();
        all.sort();
        prop_assert_eq!(all, shapes.iter().map(|shape| &shape.id).collect::<Vec<_>>());

        let side_of = |id: &String| sides.iter().position(|side| side.contains(id));
        for a in &shapes {
            for b in &shapes {
                if let (true, Some(x), Some(y)) = (a.collection == b.collection, side_of(&a.id), side_of(&b.id)) {
                    prop_assert_eq!(x, y);
                    prop_assert_eq!(&found.groups[&a.id], &found.groups[&b.id]);
                }
            }
        }
    }

    #[test]
    fn the_order_of_shapes_does_not_matter(shapes in any_shapes()) {
        let backward: Vec<SplitCandidate> = shapes.iter().rev().cloned().collect();
        prop_assert_eq!(split(&shapes, &RULE), split(&backward, &RULE));
    }
}
